"""Effects between the pose of the robot and the pose that is measured of it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.trace import TURN, Cue, Means, Panel, Trace
from proxytune.space import Parameter


@dataclass(frozen=True)
class MarkerOffset:
    """The point that is tracked lies ahead of the middle of the axle and to the left of it."""

    forward: float
    left: float
    name: ClassVar[str] = "marker_offset"
    stage: ClassVar[Stage] = Stage.MEASUREMENT
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=direction,
            unit="m",
            low=-0.3,
            high=0.3,
            neutral=0.0,
            probes=(-0.1, -0.04, -0.015, 0.015, 0.04, 0.1),
            source="a marker is anywhere on the robot: up to half its length",
        )
        for direction in ("forward", "left")
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TURN_RATE,),
        shown=Means(Cue.TURN_RATE, (Panel("turn", TURN, "forward"), Panel("turn", TURN, "sideways"))),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Move each pose to the tracked point."""
        x, y, heading = signal[..., 0], signal[..., 1], signal[..., 2]
        cosine, sine = np.cos(heading), np.sin(heading)
        tracked_x = x + self.forward * cosine - self.left * sine
        tracked_y = y + self.forward * sine + self.left * cosine
        return np.stack((tracked_x, tracked_y, heading), axis=-1), None


@dataclass(frozen=True)
class HeadingOffset:
    """The marker is stuck on turned: measured headings are off by a constant angle."""

    angle: float
    name: ClassVar[str] = "heading_offset"
    stage: ClassVar[Stage] = Stage.MEASUREMENT
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="angle",
            unit="deg",
            low=-45.0,
            high=45.0,
            neutral=0.0,
            probes=(-20.0, -8.0, -3.0, 3.0, 8.0, 20.0),
            source="a marker stuck on by hand: some degrees; more where its axes are another's",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TURN_RATE,), shown=Means(Cue.TURN_RATE, (Panel("forward", "forward speed [m/s]", "sideways"),))
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Add the angle to each heading."""
        return signal + np.array((0.0, 0.0, np.radians(self.angle))), None
