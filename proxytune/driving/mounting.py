"""How a robot's camera is mounted once effects have set its figures."""

from collections.abc import Iterable

from proxytune.driving.cameras import CameraFigures
from proxytune.driving.robot import Robot
from proxytune.effects import Effect, Setting, Stage, stage_chain

_RATE_HZ = 60.0
"""Camera effects hold for good: no rate changes what they do."""


def mounted_camera(robot: Robot, effects: Iterable[Effect]) -> CameraFigures:
    """The robot's nominal camera with the figures that camera effects set.

    Raises:
        SettingsError: If the robot has no camera, or no camera can have these figures.
    """
    figures = robot.camera_figures()
    nominal = figures.channels()
    mounting = stage_chain(effects, Stage.CAMERA)
    memory = mounting.begin(Setting(_RATE_HZ, nominal, robot.figures))
    return figures.with_channels(mounting.apply(nominal[None], memory)[0][0])
