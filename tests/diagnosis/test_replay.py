"""What a model says of recorded commands: paths, their increments, and windows that start from measured states."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import TRUTH, planted_drives

from proxytune.diagnosis.measured.drives import relative
from proxytune.diagnosis.model.replay import (
    arrived_commands,
    disturbed_increments,
    expected_theta,
    increments,
    increments_along,
    lateness,
    paths,
    wheel_speeds,
    window_paths,
)
from proxytune.effects import PARAMETERS
from proxytune.errors import SettingsError

RICH = {
    **TRUTH,
    "motor_lag.time_constant": 0.3,
    "dead_band.width": 0.05,
    "turn_slip": 0.05,
    "lateral_slip": 0.03,
    "command_quantisation": 0.1,
    "marker_offset.forward": 0.02,
    "heading_offset": 2.0,
}


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=3, seconds=8.0, noise=None)


@pytest.mark.parametrize("theta", [TRUTH, RICH], ids=["declared", "rich"])
def test_increments_are_the_differences_of_paths(drives, theta):
    walked = paths(drives, theta)
    assert walked.shape == (3, drives.duties.shape[1] + 1, 3)
    for index in (0, 7, 40, len(drives.episode) - 1):
        episode, first, last = (int(row[index]) for row in (drives.episode, drives.first, drives.last))
        np.testing.assert_array_equal(
            increments(drives, theta)[index], relative(walked[episode, first], walked[episode, last])
        )
    np.testing.assert_array_equal(increments(drives, theta), increments_along(drives, walked))


def test_the_model_that_drove_says_what_was_measured(drives):
    np.testing.assert_allclose(increments(drives, TRUTH), drives.measured, atol=1e-9)


@pytest.mark.parametrize("theta", [TRUTH, RICH], ids=["declared", "rich"])
def test_windows_from_an_episodes_start_are_its_path(drives, theta):
    begins = np.flatnonzero(np.isin(np.arange(len(drives.episode)), np.unique(drives.episode, return_index=True)[1]))
    begins = begins[drives.first[begins] == 0]
    assert len(begins) == 3
    walked = window_paths(drives, theta, begins, 300)
    np.testing.assert_allclose(walked, paths(drives, theta)[drives.episode[begins], :301], atol=1e-9)


@pytest.mark.parametrize("theta", [TRUTH, RICH], ids=["declared", "rich"])
def test_a_window_in_the_middle_knows_the_commands_before_it(drives, theta):
    begin = np.array([50])
    walked = window_paths(drives, theta, begin, 60)[0]
    whole = paths(drives, theta)[drives.episode[50], drives.first[50] : drives.first[50] + 61]
    np.testing.assert_allclose(relative(walked[0], walked), relative(whole[0], whole), atol=1e-9)


def test_a_window_starts_from_the_measured_wheel_speeds_where_there_are_any(drives):
    full = np.ones_like(drives.duties)
    turning = replace(drives, wheels=full)
    begin = np.array([50])
    moved = [window_paths(one, TRUTH, begin, 1)[0, 1, 0] for one in (drives, turning)]
    assert moved[1] > moved[0]
    assert moved[1] == pytest.approx(0.6 / 60.0, rel=0.1)


def test_a_window_past_the_end_goes_on_with_the_last_command(drives):
    last = np.array([np.flatnonzero(drives.episode == 0)[-1]])
    walked = window_paths(drives, TRUTH, last, 200)
    steps = np.diff(walked[0], axis=0)
    np.testing.assert_allclose(np.hypot(*steps[-1, :2]), np.hypot(*steps[-50, :2]), rtol=0.2)
    assert np.isfinite(walked).all()


def test_nothing_measured_after_a_windows_start_changes_it(drives):
    poses = drives.poses.copy()
    poses[60:] += 5.0
    later = replace(drives, poses=poses)
    begin = np.array([50])
    np.testing.assert_array_equal(
        window_paths(later, {**TRUTH, "floor_slope.x": 0.05}, begin, 90),
        window_paths(drives, {**TRUTH, "floor_slope.x": 0.05}, begin, 90),
    )


@pytest.mark.parametrize(
    ("theta", "late"),
    [
        ({}, 0.0),
        ({"delay_jitter": 0.1}, 0.05),
        ({"dropped_commands": 0.2}, 0.25 / 20.0),
        ({"dropped_commands": 0.5, "delay_jitter": 0.02}, 1.0 / 20.0 + 0.01),
    ],
)
def test_random_effects_make_commands_late_by_their_mean(theta, late):
    assert lateness(theta, 20.0) == pytest.approx(late)
    calm = expected_theta({"trim": 0.02, "delay": 0.1, **theta}, 20.0)
    assert calm == pytest.approx({"trim": 0.02, "delay": 0.1 + late})


def test_the_mean_lateness_is_that_of_drawn_drives():
    drawn = planted_drives({**TRUTH, "dropped_commands": 0.3}, episodes=6, seconds=30.0, noise=None)

    def strays(delay):
        return np.square(drawn.measured - increments(drawn, {"trim": TRUTH["trim"], "delay": delay}))[:, 0].sum()

    best = min(np.arange(0.1, 0.18, 0.004), key=strays)
    assert best == pytest.approx(TRUTH["delay"] + lateness({"dropped_commands": 0.3}, 20.0), abs=0.012)


def test_a_random_effect_without_a_declared_delay_is_late_from_nothing():
    assert expected_theta({"delay_jitter": 0.1}, 20.0) == {"delay": 0.05}


def test_what_is_added_to_the_twists_moves_the_robot(drives):
    extra = np.zeros((*drives.duties.shape[:2], 3))
    np.testing.assert_allclose(disturbed_increments(drives, TRUTH, extra), increments(drives, TRUTH), atol=1e-12)
    extra[..., 2] = 0.6
    turned = disturbed_increments(drives, TRUTH, extra)[:, 2] - increments(drives, TRUTH)[:, 2]
    np.testing.assert_allclose(turned, 0.6 * (drives.last - drives.first) / 60.0, atol=1e-9)


def test_wheels_and_arrived_commands_have_the_shape_of_duties(drives):
    assert wheel_speeds(drives, RICH).shape == arrived_commands(drives, RICH).shape == drives.duties.shape
    late = arrived_commands(drives, {"delay": 0.2})
    np.testing.assert_allclose(late[:, 12:], drives.duties[:, :-12], atol=1e-9)


def test_a_value_out_of_bounds_is_refused(drives):
    with pytest.raises(SettingsError, match="delay: must be between"):
        increments(drives, {"delay": PARAMETERS["delay"].high + 0.1})


def test_windows_with_measured_wheels_are_told_where_they_point(drives):
    theta = {**TRUTH, "floor_slope.x": 0.05, "floor_slope.y": 0.02}
    begin = np.flatnonzero(drives.first % 60 == 0)[2:9]
    assert len(begin) != len(drives.duties)
    measured = replace(drives, wheels=wheel_speeds(drives, theta))
    plain, known = (window_paths(one, theta, begin, 60) for one in (drives, measured))
    np.testing.assert_allclose(known, plain, atol=0.02)
    level = window_paths(measured, TRUTH, begin, 60)
    assert np.abs(level - known).max() > 0.02
