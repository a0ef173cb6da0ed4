"""Effects on how driving and turning mix: each is changed by the other, or turning comes late."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.lag import Lag, follow, lag_of
from proxytune.effects.trace import TURN, Cue, Means, Panel, Trace
from proxytune.space import Parameter


@dataclass(frozen=True)
class CrossCoupling:
    """Turning pushes the robot forwards, and driving turns it, whichever way it turns and drives.

    The forward speed grows by `forward` times the square of the yaw rate, the yaw rate by `turn` times |forward speed|.
    """

    forward: float
    turn: float
    name: ClassVar[str] = "cross_coupling"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="forward",
            unit="m·s/rad²",
            low=-0.2,
            high=0.2,
            neutral=0.0,
            probes=(-0.03, -0.01, -0.003, 0.003, 0.01, 0.03),
            source="a centre of turning some millimetres to centimetres off the middle of the axle",
        ),
        Parameter(
            name="turn",
            unit="rad/m",
            low=-2.0,
            high=2.0,
            neutral=0.0,
            probes=(-0.6, -0.2, -0.06, 0.06, 0.2, 0.6),
            source="a dragging caster or a tyre that pulls: some degrees to tens of degrees a metre",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TURN_RATE, Cue.DIRECTION, Cue.COMMAND_DIFFERENCE),
        shown=Means(Cue.TURN_RATE, (Panel("turn", TURN, "forward"), Panel("forward", "forward speed [m/s]", "turn"))),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Add to each what comes of the other."""
        forward, yaw = signal[..., 0], signal[..., 2]
        pushed, turned = forward + self.forward * yaw**2, yaw + self.turn * np.abs(forward)
        return np.stack((pushed, signal[..., 1], turned), axis=-1), None


@dataclass(frozen=True)
class Understeer:
    """The faster the robot drives the less it turns: the yaw rate is divided by 1 + gain · |forward speed|."""

    gain: float
    name: ClassVar[str] = "understeer"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gain",
            unit="s/m",
            low=0.0,
            high=5.0,
            neutral=0.0,
            probes=(0.03, 0.1, 0.3, 0.8, 2.0),
            source="tyres that slip sideways: some tenths of the turn at 1 m/s, small robots more",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TURN_RATE, Cue.COMMAND_DIFFERENCE),
        shown=Means(Cue.TURN_RATE, (Panel("forward", "forward speed [m/s]", "turn", share=True),)),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Scale the yaw rate."""
        turned = signal[..., 2] / (1.0 + self.gain * np.abs(signal[..., 0]))
        return np.stack((signal[..., 0], signal[..., 1], turned), axis=-1), None


class Turning(NamedTuple):
    """The yaw rate at the end of the last sample (…, 1), and how it follows."""

    yaw: Signal
    lag: Lag


@dataclass(frozen=True)
class YawLag:
    """The yaw rate follows the one that the wheels ask for with a first-order lag; the forward speed does not."""

    time_constant: float
    name: ClassVar[str] = "yaw_lag"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="time_constant",
            unit="s",
            low=0.0,
            high=1.0,
            neutral=0.0,
            probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8),
            source="a body that has to be turned on tyres that give: some hundredths to tenths of a second",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TRANSIENTS, Cue.TURN_RATE), shown=Means(Cue.TURN_RATE, (Panel("turn", TURN, "turn"),))
    )

    def begin(self, setting: Setting) -> Turning:
        """The resting yaw rate has been reached."""
        return Turning(np.asarray(setting.rest, dtype=float)[..., 2:], lag_of(self.time_constant * setting.rate_hz))

    def apply(self, signal: Signal, memory: Turning) -> tuple[Signal, Turning]:
        """The mean yaw rate over each sample."""
        late, yaw = follow(signal[..., 2:], memory.yaw, memory.lag)
        return np.concatenate((signal[..., :2], late), axis=-1), memory._replace(yaw=yaw)
