"""Effects between the motion that the wheels ask of the body and the motion that the body makes."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.trace import TURN, Cue, Means, Panel, Trace
from proxytune.space import Parameter


def _moved(forward: Signal, sideways: Signal, yaw: Signal) -> Signal:
    return np.stack((forward, sideways, yaw), axis=-1)


@dataclass(frozen=True)
class YawScrub:
    """Tyres that scrub turn the robot as if its wheels were `baseline` apart."""

    baseline: float
    name: ClassVar[str] = "yaw_scrub"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="baseline",
            unit="m",
            low=0.03,
            high=3.0,
            neutral="effective_baseline",
            probes=(0.05, 0.08, 0.12, 0.2, 0.3, 0.5, 1.0),
            source="wheel distance on hard tyres to a few times it with scrub: 0.16 m instead of 0.10 m on a Duckiebot",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TURN_RATE, Cue.COMMAND_DIFFERENCE), shown=Means(Cue.TURN_RATE, (Panel("turn", TURN, "turn"),))
    )

    def begin(self, setting: Setting) -> float:
        """The factor on the yaw rate."""
        return setting.nominal["effective_baseline"] / self.baseline

    def apply(self, signal: Signal, memory: float) -> tuple[Signal, float]:
        """Scale the yaw rate."""
        return _moved(signal[..., 0], signal[..., 1], signal[..., 2] * memory), memory


@dataclass(frozen=True)
class TurnSlip:
    """Turning costs forward speed: it shrinks by the factor 1 − loss · |yaw rate|."""

    loss: float
    name: ClassVar[str] = "turn_slip"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="loss",
            unit="s/rad",
            low=0.0,
            high=1.5,
            neutral=0.0,
            probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8),
            source="tyres in a bend: some hundredths of the speed at 1 rad/s, tracks up to half",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TURN_RATE, Cue.COMMAND_DIFFERENCE),
        shown=Means(Cue.TURN_RATE, (Panel("turn", TURN, "forward", share=True),)),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow the robot down in bends, at most to a stop."""
        kept = np.maximum(0.0, 1.0 - self.loss * np.abs(signal[..., 2]))
        return _moved(signal[..., 0] * kept, signal[..., 1], signal[..., 2]), None


@dataclass(frozen=True)
class LateralSlip:
    """The robot slides outwards in bends, by `slip` times its forward speed and its yaw rate."""

    slip: float
    name: ClassVar[str] = "lateral_slip"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="slip",
            unit="s",
            low=-0.5,
            high=0.5,
            neutral=0.0,
            probes=(-0.2, -0.08, -0.03, 0.03, 0.08, 0.2),
            source="slip angle of some degrees at 1 rad/s; a pose that is not measured at the axle looks the same",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TURN_RATE,),
        shown=Means(Cue.TURN_RATE, (Panel("bend", "forward speed times turn rate [m/s²]", "sideways"),)),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slide to the right in a bend to the left."""
        outwards = self.slip * signal[..., 0] * signal[..., 2]
        return _moved(signal[..., 0], signal[..., 1] - outwards, signal[..., 2]), None
