"""Long drives are made short, in the same blocks, without a pose that was not measured."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import TRUTH, planted_drives

from proxytune.diagnosis.horizon.windows import cut
from proxytune.diagnosis.measured import thinning
from proxytune.diagnosis.measured.split import cut_into_blocks
from proxytune.diagnosis.measured.thinning import join_increments, thin
from proxytune.diagnosis.model.replay import increments


@pytest.fixture(scope="module")
def drives():
    return cut_into_blocks(planted_drives(TRUTH, episodes=4, seconds=20.0, noise=None))


def test_short_drives_stay_as_they_are(drives):
    assert thin(drives) is drives
    assert join_increments(drives, 1) is drives


@pytest.mark.parametrize("times", [2, 3, 7])
def test_joined_increments_lead_from_the_first_pose_to_the_last(drives, times):
    few = join_increments(drives, times)
    assert (few.last - few.first).sum() == (drives.last - drives.first).sum()
    assert set(map(tuple, few.poses.reshape(-1, 3))) <= set(map(tuple, drives.poses.reshape(-1, 3)))
    assert few.travel.sum(axis=0) == pytest.approx(drives.travel.sum(axis=0))
    assert set(few.block) == set(drives.block)
    assert (~few.linked).sum() == (~drives.linked).sum()


def test_a_right_model_predicts_joined_increments_too(drives):
    few = join_increments(drives, 3)
    assert np.abs(few.measured - increments(few, TRUTH)).max() < 1e-9


def test_a_block_is_shortened_and_none_is_lost(drives, monkeypatch):
    monkeypatch.setattr(thinning, "MOST", 300)
    monkeypatch.setattr(thinning, "STRETCH_S", 1.0)
    few = thin(drives)
    assert 250 <= len(few.episode) <= 300 + len(set(drives.block))
    assert set(few.block) == set(drives.block)
    usual = float(np.median(few.last - few.first)) / few.tick_hz
    assert usual == pytest.approx(thinning.JOINED_S)
    sizes = np.bincount(few.block)
    assert sizes.max() <= 2 * sizes.min()
    assert len(set(few.first[~few.linked])) > 1, "not always a block's beginning"


def test_drives_of_two_seconds_stay_whole_and_fewer_are_taken(monkeypatch):
    monkeypatch.setattr(thinning, "MOST", 300)
    drives = cut_into_blocks(planted_drives(TRUTH, episodes=60, seconds=2.1, noise=None))
    few = thin(drives)
    assert thinning.FEWEST_BLOCKS <= len(set(few.block)) < 60
    assert len(cut(few, 2.0).begin) == len(set(few.block))


def test_poses_that_are_missing_stay_missing(drives):
    gaps = drives.only(np.arange(len(drives.episode)) % 50 > 4)
    few = join_increments(gaps, 4)
    assert (few.last - few.first).max() <= 4 * (drives.last - drives.first).max()
    assert np.abs(few.measured - increments(few, TRUTH)).max() < 1e-9
