"""The node that plays the next drive tells what its table says, in the units of the robot's driver, and stops."""

import types

import numpy as np
import pytest
from ros_stubs import load_node

from proxytune.diagnosis import NextDrive, commands_as
from proxytune.driving import read_robot
from proxytune.logs import read_commands
from proxytune.report.export.ros import commands_text, player_text

DUTIES = np.array([[0.2, 0.4], [-0.5, 0.5], [0.9, 0.7]])


def played(folder, monkeypatch, robot, kind, **parameters):
    drive = NextDrive("d", "so", ("a", "b"), 9.0, DUTIES, 20.0, 3, (4.0, 3.0), None)
    diagnosis = types.SimpleNamespace(next_drive=drive, command=kind, robot=read_robot(robot))
    (folder / "commands.csv").write_text(commands_text(diagnosis))
    (folder / "play_commands.py").write_text(player_text(diagnosis))
    player = load_node(folder / "play_commands.py", monkeypatch, **parameters).Player()
    while not player.done:
        player.tick()
    return player


@pytest.mark.parametrize("kind", ["duty", "twist", "wheel_speed"])
@pytest.mark.parametrize("stamped", [False, True])
def test_two_wheels_are_told_velocities_and_their_own_commands_and_then_to_stop(tmp_path, monkeypatch, kind, stamped):
    player = played(tmp_path, monkeypatch, "duckiebot", kind, stamped=stamped)
    assert player.period == pytest.approx(0.05)
    twists = [one.twist if stamped else one for one in player.told["cmd_vel"]]
    expected = [*commands_as("twist", read_robot("duckiebot"), DUTIES), (0.0, 0.0)]
    np.testing.assert_allclose([(one.linear.x, one.angular.z) for one in twists], expected, rtol=1e-4)
    told, drives = read_commands(tmp_path / "commands.csv")
    times, commands = drives["next"]
    assert told == kind
    np.testing.assert_allclose(times, (0.0, 0.05, 0.1))
    np.testing.assert_allclose([one.data for one in player.told["wheel_commands"]], [*commands, (0.0, 0.0)])


@pytest.mark.parametrize("kind", ["ackermann", "speed_steering"])
def test_a_car_is_told_speed_and_steering_angle(tmp_path, monkeypatch, kind):
    player = played(tmp_path, monkeypatch, "car", kind)
    told = [(one.drive.speed, one.drive.steering_angle) for one in player.told["drive"]]
    np.testing.assert_allclose(told, [*commands_as("speed_steering", read_robot("car"), DUTIES), (0.0, 0.0)], rtol=1e-4)
