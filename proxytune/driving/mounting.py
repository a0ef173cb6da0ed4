"""A robot's camera once effects have set its figures, and the effects on its pictures."""

from collections.abc import Iterable, Mapping

from proxytune.driving.cameras import CameraFigures
from proxytune.driving.robot import Robot
from proxytune.effects import Chain, Effect, Setting, Stage, stage_chain

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


def image_chain(effects: Iterable[Effect], figures: Mapping[str, float]) -> Chain:
    """The image effects that change a picture, given the nominal figures: neutral ones would only cost time."""
    chain = stage_chain(effects, Stage.IMAGE)
    return Chain(tuple(effect for effect in chain.effects if not _is_neutral(effect, figures)))


def _is_neutral(effect: Effect, figures: Mapping[str, float]) -> bool:
    return all(getattr(effect, one.name, None) == one.neutral_value(figures) for one in effect.parameters)
