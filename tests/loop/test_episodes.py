"""Which episode of the righted agent is shown; the page that shows it is in test_loop.py."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from episodes import paired, recorded
from tiny_loop import FOUND, write_tiny

from proxytune.domain import make_episode
from proxytune.loop import Closed
from proxytune.loop.episodes import drive_both, mean_gap_m
from proxytune.loop.opening import Loop
from proxytune.seeds import episode_seed
from proxytune.study import drive_side_by_side, load_family, read_study_settings

THETA = {"trim": 0.1, "delay": 0.1}


@pytest.fixture
def closed(tmp_path):
    """As much of a closed loop as an episode needs: four starts, the proxy before and the one that was found."""
    settings = read_study_settings(write_tiny(tmp_path / "tiny", ("starts = 2", "starts = 4")))
    model = settings.folder / "found.toml"
    model.write_text(FOUND, encoding="utf-8")
    families = [load_family(settings, path) for path in (None, model)]
    studies = [SimpleNamespace(settings=settings, family=family) for family in families]
    before, after = (SimpleNamespace(theta=THETA, result=SimpleNamespace(study=study)) for study in studies)
    return Closed(Loop(settings, families[0], "duckiebot", settings.truth, None, ()), before, {}, after, None, (), 0)


def test_the_start_furthest_from_the_target_is_shown_and_nothing_without_a_twin_or_of_failing_starts(closed):
    study, gaps = closed.before.result.study, []
    target = load_family(study.settings, closed.loop.twin)
    for start in range(4):
        episode = make_episode(THETA, agent="crawler", start=start, seed=episode_seed(study.settings.seed, start))
        gaps.append(mean_gap_m(drive_side_by_side(episode, proxy=study.family, target=target)))
    before, after = drive_both(closed, "crawler").values()
    assert before.episode.start == after.episode.start == np.argmax(gaps)
    assert before.episode.seed == after.episode.seed
    assert np.array_equal(before.target.places, after.target.places)
    assert mean_gap_m(after) < mean_gap_m(before)
    assert drive_both(closed, "nobody") is None
    assert drive_both(replace(closed, loop=replace(closed.loop, twin=None)), "crawler") is None


def test_a_robot_whose_episode_has_ended_stays_where_it_is():
    moving, standing = recorded(lambda time: time), recorded(lambda time: 0.0 * time, seconds=0.5)
    assert mean_gap_m(paired(moving, standing)) == mean_gap_m(paired(standing, moving)) == pytest.approx(1.0)
