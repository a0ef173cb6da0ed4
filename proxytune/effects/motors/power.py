"""Effects of the battery and the motor's limits on how fast wheels can turn."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.motors.wheels import IMBALANCE, per_wheel, wheel_forms
from proxytune.effects.trace import Cue, Form, Means, Panel, Trace, WheelCurve
from proxytune.space import Parameter

SMALLEST_LIMIT = 0.05
"""A wheel keeps so much of its duty, however the lost part is shared out."""


@dataclass(frozen=True)
class Saturation:
    """Wheels turn no faster than at a duty of `limit`; the lost part, 1 − limit, is what the wheels share."""

    limit: float
    imbalance: float
    name: ClassVar[str] = "saturation"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="limit",
            unit="duty",
            low=0.1,
            high=1.0,
            neutral=1.0,
            probes=(0.15, 0.25, 0.4, 0.6, 0.8, 0.9),
            source="drivers that cap the duty, batteries run down: 0.5 to 1",
        ),
        IMBALANCE,
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.WHEEL_COMMAND,), shown=WheelCurve.STEADY, forms=wheel_forms("limit")
    )

    def begin(self, setting: Setting) -> Signal:
        """The limit of each wheel (2,)."""
        return np.maximum(SMALLEST_LIMIT, 1.0 - per_wheel(1.0 - self.limit, self.imbalance))

    def apply(self, signal: Signal, memory: Signal) -> tuple[Signal, Signal]:
        """Clip at ± limit."""
        return np.clip(signal, -memory, memory), memory


def _fading(cue: Cue, label: str) -> Means:
    return Means(cue, (Panel("", label, "forward", share=True),))


class Charge(NamedTuple):
    """Minutes at full duty since the start (…,), number of the next sample, and how many minutes a sample lasts."""

    use: Signal
    next: int
    minutes: float


@dataclass(frozen=True)
class BatterySag:
    """Both wheels turn slower under load, and the slower the more, or the longer, has been driven since the start.

    Their speed is multiplied by (1 − load · mean |u|) · exp(−fade · use − fade_with_time · time), use being the
    integral of mean |u|.
    """

    load: float
    fade: float
    fade_with_time: float
    name: ClassVar[str] = "battery_sag"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="load",
            unit="",
            low=0.0,
            high=0.8,
            neutral=0.0,
            probes=(0.03, 0.06, 0.12, 0.25, 0.5),
            source="inner resistance of small batteries: some hundredths at full load, old ones some tenths",
        ),
        Parameter(
            name="fade",
            unit="1/min",
            low=0.0,
            high=1.0,
            neutral=0.0,
            probes=(0.03, 0.06, 0.12, 0.25, 0.5, 1.0),
            source="a battery that lasts minutes to an hour at full duty",
        ),
        Parameter(
            name="fade_with_time",
            unit="1/min",
            low=0.0,
            high=1.0,
            neutral=0.0,
            probes=(0.03, 0.06, 0.12, 0.25, 0.5, 1.0),
            source="what else a battery feeds empties it too, driving or not",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.USE, Cue.TIME),
        shown=WheelCurve.STEADY,
        forms=(
            Form((("load",),), "load"),
            Form((("fade",),), "fade", shown=_fading(Cue.USE, "use so far [s at full duty]")),
            Form((("fade_with_time",),), "fade with time", shown=_fading(Cue.TIME, "time in the episode [s]")),
        ),
    )

    def begin(self, setting: Setting) -> Charge:
        """With the battery as it is at the start."""
        return Charge(np.zeros(np.shape(setting.rest)[:-1]), 0, 1.0 / (60.0 * setting.rate_hz))

    def apply(self, signal: Signal, memory: Charge) -> tuple[Signal, Charge]:
        """Slow both wheels by one factor, its fading taken at the middle of each sample."""
        mean = (np.abs(signal[..., 0]) + np.abs(signal[..., 1])) / 2.0
        used = memory.use[..., None] + np.cumsum(mean, axis=-1) * memory.minutes
        numbers = np.arange(memory.next, memory.next + mean.shape[-1])
        time = (numbers + 0.5) * memory.minutes
        faded = np.exp(-self.fade * (used - mean * (memory.minutes / 2.0)) - self.fade_with_time * time)
        factor = np.maximum(0.0, 1.0 - self.load * mean) * faded
        return signal * factor[..., None], memory._replace(use=used[..., -1], next=memory.next + mean.shape[-1])
