"""Instances to export."""

from proxytune.driving import read_robot
from proxytune.report.export.instance import Instance

ROBOT = read_robot("duckiebot")


def instance(robot=ROBOT, intervals=None, **theta):
    """The Duckiebot with these values, written `effect__parameter` where an effect has more than one."""
    named = {name.replace("__", "."): value for name, value in theta.items()}
    return Instance(robot, {**robot.theta, **named}, intervals or {}, "a test")
