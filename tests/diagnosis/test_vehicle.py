"""A log's robot is one of ours, or what its log says of it."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import driven_log, planted_log

from proxytune.diagnosis.measured.commands import duties_of
from proxytune.diagnosis.measured.vehicle import robot_of
from proxytune.driving.robot import read_robot
from proxytune.errors import LogError, SettingsError

OWN = {"wheel_radius": 0.05, "effective_baseline": 0.4}


@pytest.fixture(scope="module")
def log():
    return planted_log({}, episodes=2, seconds=10.0, noise=None)


def with_commands(log, kind, commands, geometry=OWN):
    episodes = tuple(replace(e, commands=np.array(commands, dtype=float)) for e in log.episodes)
    return replace(log, robot="tractor", command=kind, geometry=dict(geometry), episodes=episodes)


def test_a_robot_with_a_folder_is_read_from_it(log):
    assert robot_of(log) == read_robot("duckiebot")


def test_another_robot_can_be_named(log):
    assert robot_of(log, "husky") == read_robot("husky")
    assert robot_of(replace(log, robot="tractor"), "duckiebot") == read_robot("duckiebot")


def test_an_unknown_name_is_refused_with_the_nearest(log):
    with pytest.raises(SettingsError, match="robot 'duckybot' is unknown"):
        robot_of(log, "duckybot")


@pytest.mark.parametrize(
    ("geometry", "missing"),
    [
        ({}, "wheel_radius_m and baseline_m"),
        ({"wheel_radius": 0.05}, "baseline_m"),
        ({"effective_baseline": 0.4}, "wheel_radius_m"),
    ],
)
def test_an_unknown_robot_needs_its_geometry(log, geometry, missing):
    with pytest.raises(LogError, match=f"robot 'tractor' is unknown .* does not state {missing};"):
        robot_of(replace(log, robot="tractor", geometry=geometry))


def test_an_unknown_robot_has_the_geometry_of_its_log_and_obeys_at_once(log):
    robot = robot_of(replace(log, robot="tractor", geometry={**OWN, "full_speed": 1.5}))
    assert (robot.name, robot.theta, robot.urdf) == ("tractor", {}, None)
    assert dict(robot.figures) == {**OWN, "full_speed": 1.5, "motor_time_constant": 0.0, "control_rate": 20.0}


def test_a_robot_of_the_logs_own_figures_may_be_named_as_the_log_names_it(log):
    own = replace(log, robot="tractor", geometry={**OWN, "full_speed": 1.5})
    assert robot_of(own, "tractor") == robot_of(own)


@pytest.mark.parametrize(
    ("kind", "command", "fastest"),
    [("twist", (0.8, 1.0), 1.0), ("twist", (0.0, -3.0), 0.6), ("wheel_speed", (10.0, -23.0), 1.2)],
)
def test_full_speed_is_taken_from_the_fastest_command_and_then_no_command_is_beyond_it(log, kind, command, fastest):
    told = with_commands(log, kind, [command, (0.0, 0.0)])
    robot = robot_of(told)
    assert robot.figures["full_speed"] == pytest.approx(fastest)
    assert np.abs(duties_of(told, robot, told.episodes[0].commands)).max() <= 1.0 + 1e-9


@pytest.mark.parametrize("rows", [1200, 40])
def test_full_speed_of_duties_is_how_fast_it_drove(rows):
    at_once = {"delay": 0.0, "motor_lag.time_constant": 0.0}
    straight = driven_log(at_once, np.full((3, rows, 2), 0.5), np.zeros((3, 3)), noise=None)
    robot = robot_of(replace(straight, robot="tractor", geometry=dict(OWN)))
    assert robot.figures["full_speed"] == pytest.approx(0.6, rel=0.05)


def test_full_speed_of_a_robot_that_never_moved_is_still_positive(log):
    still = with_commands(log, "duty", np.zeros((200, 2)))
    assert robot_of(still).figures["full_speed"] > 0.0
