"""How weights move windows is what replays with other weights show."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from learnt_truth import MANY, TURNING
from planted import TRUTH, planted_drives

from proxytune.diagnosis.horizon.window_slopes import FITTED_S, POSES, choose_windows, slopes_of
from proxytune.effects.learnt.table import learnt_effect

SIZE = 1e-4


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=2, seconds=8.0, noise=None)


@pytest.mark.parametrize("extra", [TURNING, MANY], ids=["turning", "many"])
@pytest.mark.parametrize("named", [{}, {"marker_offset.forward": 0.05, "heading_offset": 4.0}], ids=["plain", "marker"])
def test_the_change_per_weight_is_that_of_replays(drives, extra, named):
    offered = learnt_effect(extra)
    theta = {**TRUTH, **named}
    still = slopes_of(drives, theta, offered)
    weights = [name for name in extra if "range" not in name]
    order = [f"learnt.{curve.group}.{curve.channel}@{knot!r}" for curve in offered.curves for knot in curve.knots]
    assert sorted(order) == sorted(weights)
    none = dict.fromkeys(weights, 0.0)
    for column, name in enumerate(order):
        moved = slopes_of(drives, {**theta, **extra, **none, name: SIZE}, offered)
        seen = (still.left - moved.left) / SIZE
        np.testing.assert_allclose(still.columns[..., column], seen, rtol=0, atol=2e-3 * np.abs(seen).max() + 1e-6)


def test_a_model_that_is_right_leaves_nothing(drives):
    assert np.abs(slopes_of(drives, TRUTH, learnt_effect(TURNING)).left).max() < 1e-9


def test_windows_are_thinned_to_a_few_poses_that_reach_their_end(drives):
    windows = choose_windows(drives)
    counts = np.bincount(windows.window)
    assert counts.max() == POSES
    lasts = (drives.last[windows.increment] - drives.first[windows.begin][windows.window]) / drives.tick_hz
    assert lasts.max() == FITTED_S
    assert np.all(np.diff(lasts)[np.diff(windows.window) == 0] > 0.0)
