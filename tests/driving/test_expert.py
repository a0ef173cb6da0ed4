"""The expert keeps to the lane by the true pose, and shows how to come back to it when it is pushed off."""

import dataclasses
import functools
from pathlib import Path

import numpy as np
import pytest

from proxytune.driving.episode import TICK_HZ, Course, Sight, drive
from proxytune.driving.expert import MEMORY, Expert
from proxytune.driving.family import lane_following
from proxytune.driving.planar import PlanarPlant
from proxytune.driving.road.lane import lane_point, off_map
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.robot import read_robot
from proxytune.driving.task import driving_score, start_pose
from proxytune.effects import Stage, stage_chain
from proxytune.settings import Section

ROAD = shipped_map("small_loop")
ROBOT = read_robot("duckiebot")
LOOK_AHEAD, SPEED, GAIN, DISTURBANCE = ROBOT.expert_figures()
FAMILY = lane_following(Section(Path("study.toml"), "domain.", {"plant": "planar"}), model=None)
SECONDS = 20.0
NOMINAL = ()
SHIFTED = (("trim", 0.06), ("delay", 0.19))
STEPS = np.array([(1.6, 0.6 + 0.004 * step, np.pi / 2 + 0.02 * np.sin(step / 9.0)) for step in range(80)])
"""Poses that are shown to the expert one after the other, whatever it does."""


class Dark:
    """A camera that costs nothing: the expert does not look."""

    def render(self, poses):
        return np.zeros((len(poses), 1, 1, 3), dtype=np.uint8)


def expert(seed=0, *, look_ahead=LOOK_AHEAD, disturbance=0.0, gain=GAIN):
    return Expert(ROAD, look_ahead, SPEED, gain, disturbance, seed)


@functools.lru_cache
def lesson(start, theta=NOMINAL, seconds=SECONDS, seed=0, **figures):
    unseen = {"camera": Dark(), "image": stage_chain((), Stage.IMAGE)}
    instance = dataclasses.replace(FAMILY.instance(dict(theta)), **unseen)
    begin = np.array(start_pose(ROAD, start, seed=seed, position_noise_m=0.01, heading_noise_deg=2.0))
    course = Course(begin, seconds, seed, functools.partial(off_map, ROAD))
    return drive(instance, PlanarPlant(begin, 1 / TICK_HZ), expert(seed, **figures), course, Sight)


def score(driven):
    distance = ROBOT.figures["wheel_distance"]
    return driving_score(ROAD, driven.poses, wheel_distance=distance, tick_s=1 / TICK_HZ, seconds=SECONDS)


def shown(driver, poses=STEPS):
    """What is driven and what is left in the end when the expert is shown these poses."""
    memory, driven = driver.begin(ROBOT), []
    for step, pose in enumerate(poses):
        command, memory = driver.act(Sight(np.full((1, 1, 3), step % 256, dtype=np.uint8), pose), memory)
        driven.append(command)
    return np.array(driven), memory


def pushes(seed, steps=80, disturbance=DISTURBANCE):
    """What is added to the right wheel and taken off the left one."""
    standing = np.tile(STEPS[:1], (steps, 1))
    driven, memory = shown(expert(seed, disturbance=disturbance), standing)
    return driven - np.array(memory.commands)


@pytest.mark.slow
@pytest.mark.parametrize("theta", [NOMINAL, SHIFTED], ids=("nominal", "shifted"))
def test_undisturbed_it_keeps_both_wheels_in_the_lane_from_all_ten_starts(theta):
    scores = [score(lesson(start, theta)) for start in range(len(ROAD.starts))]
    assert scores == pytest.approx([SECONDS] * 10)


@pytest.mark.parametrize("start", [0, 1, 8])
def test_looking_half_a_metre_ahead_cuts_the_corners_where_trim_and_delay_are_off(start):
    assert score(lesson(start, SHIFTED, look_ahead=0.5)) < 0.6 * SECONDS
    assert score(lesson(start, SHIFTED)) == pytest.approx(SECONDS)


def test_looking_half_a_metre_ahead_takes_a_wheel_out_of_the_lane_in_the_nominal_robot_too():
    assert score(lesson(1, look_ahead=0.5)) < SECONDS - 1.0


def test_the_robots_own_figures_are_those_that_keep_to_the_lane():
    assert ROBOT.expert_figures() == (0.25, 0.2, 1.0, 0.1)


@pytest.mark.parametrize("outer", [True, False])
@pytest.mark.parametrize("left", [-0.06, 0.06])
def test_off_the_centre_line_it_turns_back_to_it(outer, left):
    here, ahead = (lane_point(ROAD, outer, 0.28 + way) for way in (0.0, 0.01))
    heading = np.arctan2(*(ahead - here)[::-1])
    aside = here + left * np.array((-np.sin(heading), np.cos(heading)))
    command = shown(expert(), [np.array((*aside, heading))])[0][0]
    assert (command[1] - command[0]) * left < 0


def test_on_a_straight_it_drives_straight_on_at_its_speed():
    here = lane_point(ROAD, True, 0.1)
    command = shown(expert(), [np.array((*here, np.pi / 2))])[0][0]
    assert command == pytest.approx(np.full(2, SPEED / ROBOT.figures["full_speed"]))


def test_it_steers_along_the_circle_through_the_point_pursued():
    here = lane_point(ROAD, True, 0.1)
    pose = np.array((*here, np.pi / 2 + 0.2))
    left, right = shown(expert(), [pose])[0][0] * ROBOT.figures["full_speed"]
    radius = SPEED * ROBOT.figures["effective_baseline"] / (right - left)
    middle = here + radius * np.array((-np.sin(pose[2]), np.cos(pose[2])))
    assert np.hypot(*(lane_point(ROAD, True, 0.1 + LOOK_AHEAD) - middle)) == pytest.approx(abs(radius))
    assert (left + right) / 2 == pytest.approx(SPEED)


def test_the_gain_multiplies_the_turn_alone():
    once, twice = (shown(expert(gain=gain), STEPS[:30])[0] for gain in (1.0, 1.5))
    assert np.diff(twice) == pytest.approx(1.5 * np.diff(once))
    assert twice.sum(axis=1) == pytest.approx(once.sum(axis=1))


def test_what_is_shown_is_the_undisturbed_command_and_what_is_driven_is_not():
    calm, calm_memory = shown(expert())
    pushed, pushed_memory = shown(expert(disturbance=DISTURBANCE))
    np.testing.assert_array_equal(calm_memory.commands, pushed_memory.commands)
    np.testing.assert_array_equal(calm, calm_memory.commands)
    assert (pushed != calm).all()


def test_a_push_turns_the_robot_and_does_not_speed_it_up():
    left, right = pushes(0).T
    assert left == pytest.approx(-right)
    assert np.abs(right).min() > 0


def test_the_disturbance_is_a_function_of_seed_and_step_alone():
    driven, memory = shown(expert(3, disturbance=DISTURBANCE))
    np.testing.assert_allclose(driven - np.array(memory.commands), pushes(3), atol=1e-12)
    np.testing.assert_array_equal(pushes(3, 20), pushes(3)[:20])
    assert (pushes(3) != pushes(4)).all()


def test_the_disturbance_has_the_standard_deviation_it_was_given_and_lasts_for_half_a_second():
    right = pushes(1, 2000)[:, 1]
    assert right.std() == pytest.approx(DISTURBANCE, rel=0.1)
    assert right.mean() == pytest.approx(0.0, abs=0.2 * DISTURBANCE)
    half_a_second = round(ROBOT.figures["control_rate"] / 2)
    for lag in (1, 2, 5, half_a_second):
        assert np.corrcoef(right[:-lag], right[lag:])[0, 1] == pytest.approx(MEMORY**lag, abs=0.1), lag
    assert MEMORY**half_a_second == pytest.approx(np.exp(-1), abs=0.03)


def test_driven_commands_are_duties_however_hard_it_is_pushed():
    driven, memory = shown(expert(disturbance=5.0))
    assert np.abs(driven).max() == 1.0
    assert np.abs(memory.commands).max() < 1.0


def test_the_same_lesson_is_the_same_to_the_last_bit_and_another_seed_is_another():
    first, again, other = (lesson.__wrapped__(3, seconds=3.0, seed=s, disturbance=DISTURBANCE) for s in (1, 1, 2))
    np.testing.assert_array_equal(first.poses, again.poses)
    np.testing.assert_array_equal(first.memory.commands, again.memory.commands)
    assert (first.commands != other.commands).all()


def test_a_picture_a_shown_command_and_whether_on_the_road_belong_to_every_step():
    driven, memory = shown(expert(disturbance=DISTURBANCE))
    assert len(memory.pictures) == len(memory.commands) == len(memory.on_road) == len(driven) == len(STEPS)
    assert [int(picture[0, 0, 0]) for picture in memory.pictures] == list(range(len(STEPS)))
    assert [len(part) for part in expert().begin(ROBOT)[2:]] == [0, 0, 0]


@pytest.mark.parametrize("heading", [np.pi / 2, -np.pi / 2], ids=("outer", "inner"))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_road_ends_with_the_outer_edges_of_its_two_lanes(heading, side):
    edge, middle = ROAD.lane_offset + ROAD.lane_width / 2, ROAD.size[0] - ROAD.width / 2
    aside = (0.0, edge - 0.001, edge + 0.001)
    poses = [np.array((middle + side * way, ROAD.size[0] / 2, heading)) for way in aside]
    assert shown(expert(), poses)[1].on_road == (True, True, False)


def test_a_lesson_that_leaves_the_road_says_at_which_steps():
    driven = lesson(1, (("trim", 0.5),))
    middles = driven.poses[:-1:3, :2]
    inside = np.abs(middles - ROAD.size[0] / 2).max(axis=1)
    assert len(driven.memory.on_road) == len(driven.commands)
    assert not all(driven.memory.on_road)
    assert not any(driven.memory.on_road[step] for step in np.flatnonzero(inside < 0.2))
