"""Pictures of another size than the robot's agents are given."""

from dataclasses import replace
from types import MappingProxyType

from proxytune.driving.robot import Robot


def with_columns(robot: Robot, least: int) -> Robot:
    """The robot with a camera of at least so many columns, rows in proportion; every other figure is the same.

    Raises:
        SettingsError: If the robot has no camera.
    """
    camera = robot.camera_figures()
    columns = max(camera.columns, least)
    rows = round(camera.rows * columns / camera.columns)
    size = {"camera_columns": float(columns), "camera_rows": float(rows)}
    return replace(robot, figures=MappingProxyType({**robot.figures, **size}))
