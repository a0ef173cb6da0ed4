"""The node that plays the next drive tells what its table says, in the units of the robot's driver, and stops."""

import importlib.util
import sys
import types
from typing import ClassVar

import numpy as np
import pytest

from proxytune.diagnosis import NextDrive, commands_as
from proxytune.driving import read_robot
from proxytune.logs import read_commands
from proxytune.report.export.nodes import commands_text, player_text

DUTIES = np.array([[0.2, 0.4], [-0.5, 0.5], [0.9, 0.7]])


class Twist:
    def __init__(self):
        self.linear, self.angular = types.SimpleNamespace(x=0.0), types.SimpleNamespace(z=0.0)


class Stamped:
    def __init__(self):
        self.twist, self.header = Twist(), types.SimpleNamespace(stamp=None)


class Ackermann:
    def __init__(self):
        self.header = types.SimpleNamespace(stamp=None)
        self.drive = types.SimpleNamespace(speed=0.0, steering_angle=0.0)


class Node:
    parameters: ClassVar = {}

    def __init__(self, name):
        self.told = {}

    def declare_parameter(self, name, value):
        return types.SimpleNamespace(value=self.parameters.get(name, value))

    def create_publisher(self, kind, topic, depth):
        return types.SimpleNamespace(publish=self.told.setdefault(topic, []).append)

    def create_timer(self, period, tell):
        self.period, self.tick = period, tell

    def get_clock(self):
        return types.SimpleNamespace(now=lambda: types.SimpleNamespace(to_msg=lambda: "now"))


def played(folder, monkeypatch, robot, kind, **parameters):
    drive = NextDrive("d", "so", ("a", "b"), 9.0, DUTIES, 20.0, 3, (4.0, 3.0), None)
    diagnosis = types.SimpleNamespace(next_drive=drive, command=kind, robot=read_robot(robot))
    (folder / "commands.csv").write_text(commands_text(diagnosis))
    (folder / "play_commands.py").write_text(player_text(diagnosis))
    modules = {
        "rclpy": {},
        "rclpy.node": {"Node": Node},
        "geometry_msgs": {},
        "geometry_msgs.msg": {"Twist": Twist, "TwistStamped": Stamped},
        "ackermann_msgs": {},
        "ackermann_msgs.msg": {"AckermannDriveStamped": Ackermann},
        "std_msgs": {},
        "std_msgs.msg": {"Float64MultiArray": types.SimpleNamespace},
    }
    for name, content in modules.items():
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        vars(sys.modules[name]).update(content)
    monkeypatch.setattr(Node, "parameters", parameters)
    spec = importlib.util.spec_from_file_location("play_commands", folder / "play_commands.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    player = module.Player()
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
    expected = [*commands_as("speed_steering", read_robot("car"), DUTIES), (0.0, 0.0)]
    np.testing.assert_allclose(told, expected, rtol=1e-4)
