"""One episode of a study's proxy: its scores are those of a trial, and what moved has times."""

import re

import numpy as np
import pandas as pd
import pytest
from one_line import complaint_of

from proxytune.api.driving import drive
from proxytune.api.study import run_study
from proxytune.errors import EpisodeError, RunError

PLANAR = {"plant": '"planar"', "seconds": "2.0", "position_noise_m": "0.0"}
THETA = {"trim": 0.1}


@pytest.fixture(scope="module")
def lane(make_studies):
    """A study of lane following."""
    agents = '["steady", "braitenberg"]'
    return make_studies("lane", domain=PLANAR, family='"proxytune.driving.family:lane_following"', agents=agents)


@pytest.fixture(scope="module")
def driven(lane):
    return drive(lane, "steady", THETA)


def test_poses_and_commands_have_times_and_scores_are_of_the_same_drive(driven):
    assert list(driven.poses.columns) == ["time", "x", "y", "heading"]
    assert np.allclose(np.diff(driven.poses.time), 1 / 60)
    assert driven.poses.time.iloc[[0, -1]].tolist() == [0.0, pytest.approx(2.0)]
    start = driven.poses.iloc[0]
    assert [start.x, start.y] == [0.4237, 0.702]
    assert list(driven.commands.columns) == ["time", "left", "right"]
    assert np.allclose(driven.commands.time, np.arange(40) / 20)
    assert driven.commands[["left", "right"]].abs().to_numpy().max() <= 1.0
    steps = np.hypot(driven.poses.x.diff(), driven.poses.y.diff())[1:]
    assert driven.scores["survival_time"] == 2.0
    assert driven.scores["speed"] == pytest.approx(steps.sum() / 2.0)


def test_the_same_episode_is_the_same_start_seed_and_theta_change_it_and_a_trial_scores_alike(lane, driven, make_study):
    pd.testing.assert_frame_equal(drive(lane / "study.toml", "steady", THETA, seed=1).poses, driven.poses)
    for other in (drive(lane, "steady", THETA, start=1), drive(lane, "steady", THETA, seed=2), drive(lane, "steady")):
        assert not other.poses.equals(driven.poses)
    folder = make_study(budget="1", initial="1")
    report = run_study(folder)
    distances = [drive(folder, "agent0", report.theta, start=start).scores["distance"] for start in range(3)]
    proxy = report.best.assessment.inputs.proxy
    assert np.mean(distances) == proxy.means[proxy.agents.index("agent0"), 0]


def test_an_episode_is_driven_before_there_are_scores_of_the_target_also_where_no_poses_are_kept(make_study):
    folder = make_study()
    (folder / "target.csv").unlink()
    assert set(drive(folder, "agent0").scores) == {"distance", "survival_time"}
    driven = drive(make_study(), "agent0")
    assert driven.poses is driven.commands is None
    assert driven.scores["distance"] > 0.0


def test_an_episode_that_fails_and_a_folder_that_is_no_study_are_one_line(make_study, tmp_path):
    folder = make_study(domain={"faults": '["agent1:2:raises"]'})
    with pytest.raises(EpisodeError) as problem:
        drive(folder, "agent1", start=2)
    words = "agent 'agent1' failed from start 2: agent 'agent1' raised ValueError at 1.20 s: it lost its way"
    assert str(problem.value) == words
    assert isinstance(problem.value, RunError)
    assert "study.toml: no such file" in complaint_of(drive, tmp_path, "steady")


@pytest.mark.parametrize(
    ("arguments", "changes", "words"),
    [
        (("agent9",), {}, "no agent 'agent9'; did you mean 'agent"),
        (("agent0", {"trimm": 0.1}), {}, "θ: unknown parameter 'trimm'; did you mean 'trim'"),
        (("agent0", {"trim": 0.5}), {}, r"θ: trim must lie within \[-0.3, 0.3\], got 0.5"),
        (("agent0", {"trim": float("nan")}), {}, r"θ: trim must lie within \[-0.3, 0.3\], got nan"),
        (("agent0", {"trim": "0.1"}), {}, "θ: trim must be a number, got '0.1'"),
        (("agent0", {"trim": None}), {}, "θ: trim must be a number, got None"),
        (("agent0", {"trim": False}), {}, "θ: trim must be a number, got False"),
        (("agent0",), {"start": 5}, "start 5: the family has 5; give 0 to 4"),
        (("agent0",), {"seed": -1}, "seed must be at least 0, got -1"),
        (("agent0",), {"seed": 1.5}, "seed must be a whole number, got 1.5"),
        (("agent0",), {"start": "0"}, "start must be a whole number, got '0'"),
        ((None,), {}, "agent must be a name, as in 'steady', got None"),
    ],
)
def test_what_the_family_has_not_is_refused_with_what_it_has(make_study, arguments, changes, words):
    assert re.search(words, complaint_of(drive, make_study(), *arguments, **changes))


def test_a_theta_may_be_called_best_or_nominal_as_on_the_command_line(lane, driven, make_study):
    nominal = drive(lane, "steady", "nominal")
    pd.testing.assert_frame_equal(nominal.poses, drive(lane, "steady").poses)
    assert not nominal.poses.equals(driven.poses)
    folder = make_study(budget="1", initial="1")
    theta = run_study(folder).theta
    assert drive(folder, "agent0", "best").scores == drive(folder, "agent0", theta).scores
