"""Effects on commands between the agent that issues them and the motors that obey them."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.trace import Cue, Trace, WheelCurve
from proxytune.space import Parameter


class History(NamedTuple):
    """The newest past samples, and the delay as whole samples and a fraction of one."""

    samples: Signal
    fraction: float


@dataclass(frozen=True)
class Delay:
    """Commands arrive late by a constant time, interpolated between samples.

    A command holds over its sample interval, so the mean of the delayed command over an interval is the linear
    interpolation between two samples: exact for a delay of any length, and continuous in it.
    """

    delay: float
    name: ClassVar[str] = "delay"
    stage: ClassVar[Stage] = Stage.COMMAND
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="delay",
            unit="s",
            low=0.0,
            high=0.6,
            neutral=0.0,
            probes=(0.02, 0.04, 0.08, 0.15, 0.3),
            source="Duckiebot image-to-motor latency about 0.14 s; box of the paper 0 to 0.30 s",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(cues=(Cue.TRANSIENTS,), shown=WheelCurve.STEP)

    def begin(self, setting: Setting) -> History:
        """As if the robot had been at rest for ever."""
        samples = self.delay * setting.rate_hz
        whole = int(np.floor(samples + 1e-9))
        rest = np.asarray(setting.rest, dtype=float)[..., None, :]
        return History(np.repeat(rest, whole + 1, axis=-2), max(0.0, samples - whole))

    def apply(self, signal: Signal, memory: History) -> tuple[Signal, History]:
        """Interpolate between the two samples that the delay falls between."""
        length = signal.shape[-2]
        joined = np.concatenate((memory.samples, signal), axis=-2)
        late = (1.0 - memory.fraction) * joined[..., 1 : length + 1, :] + memory.fraction * joined[..., :length, :]
        return late, History(joined[..., length:, :], memory.fraction)


@dataclass(frozen=True)
class CommandQuantisation:
    """Commands are rounded to multiples of a step on their way."""

    step: float
    name: ClassVar[str] = "command_quantisation"
    stage: ClassVar[Stage] = Stage.COMMAND
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="step",
            unit="duty",
            low=0.0,
            high=0.5,
            neutral=0.0,
            probes=(0.02, 0.05, 0.1, 0.2, 0.4),
            source="8 bits: 0.008; drivers with a few speed levels: 0.1 to 0.3",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(cues=(Cue.WHEEL_COMMAND,), shown=WheelCurve.STEADY, stepwise=True)

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Round each sample, halves to the even multiple."""
        return (signal if self.step == 0.0 else np.rint(signal / self.step) * self.step), None
