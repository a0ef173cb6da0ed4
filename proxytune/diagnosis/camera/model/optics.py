"""A robot's camera as values in θ, for pictures of a log's own size."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from proxytune.driving.cameras import CameraFigures
from proxytune.driving.mounting import mounted_camera
from proxytune.driving.robot import Robot
from proxytune.effects import Stage, effect_of, effects_from

LATENCY = "camera_latency"
READOUT = "rolling_shutter"
MOVING = (LATENCY, READOUT)
"""Effects that show where a marking lies in the picture only while the robot moves, by their names in θ."""

DISTORTION = "lens_distortion"

SPREAD = 0.4
"""Standard deviation that is expected of a parameter, as a share of the way to the farther end of its range: it decides
what views cannot."""

STEP = 1e-4
"""How far a parameter is moved for a derivative, as a share of its range."""


@dataclass(frozen=True)
class Optics:
    """A robot's camera whose figures are set by θ.

    Attributes:
        robot: Whose camera.
        rows: Height of the log's pictures [pixel].
        columns: Width of the log's pictures [pixel].
    """

    robot: Robot
    rows: int
    columns: int

    def figures(self, theta: Mapping[str, float]) -> CameraFigures:
        """The camera with these values; whatever θ says of anything else is left alone."""
        own = {name: value for name, value in theta.items() if name in self.mounting}
        effects = effects_from(own, self.robot.figures, self.robot.catalogue)
        return replace(mounted_camera(self.robot, effects), rows=self.rows, columns=self.columns)

    @cached_property
    def mounting(self) -> tuple[str, ...]:
        """The names in θ of what places the camera and shapes its lens, a user's own effects included."""
        catalogue = self.robot.catalogue
        effects = [name for name in catalogue.names if catalogue.effect(name).stage is Stage.CAMERA]
        return tuple(name for effect in effects for name in catalogue.theta_names(effect))

    def neutral(self, name: str) -> float:
        """The value at which a parameter changes nothing."""
        return self.robot.catalogue.parameters[name].neutral_value(self.robot.figures)

    def spread(self, name: str) -> float:
        """How far a parameter may be expected from its neutral value, as a standard deviation."""
        parameter, neutral = self.robot.catalogue.parameters[name], self.neutral(name)
        return SPREAD * max(parameter.high - neutral, neutral - parameter.low)

    def step(self, name: str, value: float) -> float:
        """How far a parameter is moved from a value for a derivative, away from the end of its range."""
        parameter = self.robot.catalogue.parameters[name]
        step = STEP * (parameter.high - parameter.low)
        return step if value + step <= parameter.high else -step

    def clipped(self, name: str, value: float) -> float:
        """The nearest value within the parameter's bounds."""
        return self.robot.catalogue.parameters[name].clipped(value)


def effects_of(names: tuple[str, ...]) -> tuple[str, ...]:
    """The effects that parameters belong to, each once."""
    return tuple(dict.fromkeys(effect_of(name) for name in names))
