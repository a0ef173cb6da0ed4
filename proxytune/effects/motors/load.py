"""Effects of what a motor and its driver can bear: commands that rise slowly, motors that tire under load."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.lag import Lag, follow, lag_of
from proxytune.effects.trace import Cue, Means, Panel, Trace, WheelCurve
from proxytune.space import Parameter


class Ramp(NamedTuple):
    """The newest duty (…, 2), and how far it can change within a sample."""

    duty: Signal
    step: float


@dataclass(frozen=True)
class SlewRate:
    """The motor driver changes each wheel's duty no faster than from rest to full within `rise_time`."""

    rise_time: float
    name: ClassVar[str] = "slew_rate"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="rise_time",
            unit="s",
            low=0.0,
            high=3.0,
            neutral=0.0,
            probes=(0.05, 0.1, 0.2, 0.4, 0.8, 1.6),
            source="ramps of motor drivers: some tenths of a second to a few seconds from rest to full speed",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(cues=(Cue.TRANSIENTS, Cue.WHEEL_COMMAND), shown=WheelCurve.STEP)

    def begin(self, setting: Setting) -> Ramp:
        """The resting duty has been reached."""
        step = 1.0 / (self.rise_time * setting.rate_hz) if self.rise_time > 0.0 else np.inf
        return Ramp(np.asarray(setting.rest, dtype=float), step)

    def apply(self, signal: Signal, memory: Ramp) -> tuple[Signal, Ramp]:
        """Go towards each sample by one step at most."""
        series = np.moveaxis(np.asarray(signal, dtype=float), -2, -1)
        start = np.broadcast_to(memory.duty, series.shape[:-1])
        ramps = _ramps(series.reshape(-1, series.shape[-1]), start.ravel(), memory.step)
        reached = np.moveaxis(ramps.reshape(series.shape), -1, -2)
        return reached, memory._replace(duty=reached[..., -1, :])


def _ramps(wanted: Signal, start: Signal, step: float) -> Signal:
    """Each row (rows, time) followed by one step a sample at most: one ramp for each change of what is wanted."""
    begins = np.flatnonzero(np.diff(wanted, axis=1, prepend=np.nan))
    lengths = np.diff(begins, append=wanted.size)
    held = wanted.ravel()[begins]
    gaps = np.empty(len(begins))
    row, here = 0, 0.0
    for number, (first, value, reach) in enumerate(
        zip(begins.tolist(), held.tolist(), (lengths * step).tolist(), strict=True)
    ):
        if first % wanted.shape[1] == 0:
            row, here = row + 1, float(start[row])
        gaps[number] = gap = here - value
        here = value + (gap - reach if gap > reach else gap + reach if gap < -reach else 0.0)
    of = np.repeat(np.arange(len(begins)), lengths)
    way = (np.arange(wanted.size) - begins[of] + 1) * step
    ramp = np.sign(gaps[of]) * np.maximum(0.0, np.abs(gaps[of]) - way)
    return np.asarray((held[of] + ramp).reshape(wanted.shape))


class Heat(NamedTuple):
    """The load of late (…, 1), and how it follows the load of the moment."""

    load: Signal
    lag: Lag


@dataclass(frozen=True)
class ThermalFade:
    """Both wheels turn slower the harder they have worked of late, by `loss` after long work at full duty.

    Their speed is multiplied by 1 − loss · load, where load follows mean |u| with a lag of `time_constant`.
    """

    loss: float
    time_constant: float
    name: ClassVar[str] = "thermal_fade"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="loss",
            unit="",
            low=0.0,
            high=0.9,
            neutral=0.0,
            probes=(0.05, 0.1, 0.2, 0.4, 0.8),
            source="windings that are 80 °C warmer have a third more resistance",
        ),
        Parameter(
            name="time_constant",
            unit="s",
            low=0.5,
            high=120.0,
            neutral=8.0,
            probes=(2.0, 4.0, 15.0, 40.0),
            source="small motors warm up within seconds to minutes",
            shape=True,
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.USE, Cue.TIME),
        shown=Means(Cue.USE, (Panel("", "use so far [s at full duty]", "forward", share=True),)),
    )

    def begin(self, setting: Setting) -> Heat:
        """With motors as warm as the resting duty keeps them."""
        rest = np.abs(np.asarray(setting.rest, dtype=float)).mean(axis=-1, keepdims=True)
        return Heat(rest, lag_of(self.time_constant * setting.rate_hz))

    def apply(self, signal: Signal, memory: Heat) -> tuple[Signal, Heat]:
        """Slow both wheels by one factor."""
        late, load = follow(np.abs(signal).mean(axis=-1, keepdims=True), memory.load, memory.lag)
        return signal * (1.0 - self.loss * np.minimum(1.0, late)), memory._replace(load=load)
