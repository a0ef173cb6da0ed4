"""Effects between a command that has arrived and the speed that a wheel turns at, as a fraction of full speed.

An effect with `imbalance` is shared out between the wheels: value · (1 − imbalance) left, value · (1 + imbalance)
right. `wheel_forms` are the forms in which a diagnosis tries such an effect: both wheels alike, one alone, or unevenly.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proxytune.effects.effect import (
    Cue,
    FilterContext,
    Form,
    LowPassState,
    Means,
    Panel,
    ShippedEffect,
    Signal,
    Stage,
    Trace,
    WheelCurve,
    effect,
    fastest,
    like,
    low_pass,
    low_pass_at,
    parameter,
)
from proxytune.space import Parameter

IMBALANCE = Parameter(name="imbalance", unit="", low=-1.0, high=1.0, neutral=0.0, probes=(-1.0, -0.5, 0.5, 1.0),
                      source="by definition: −1 is the left wheel alone, 1 the right one", shape=True)  # fmt: skip
"""How much more of an effect the right wheel has than the left one."""
SLIGHT_IMBALANCE = replace(IMBALANCE, probes=(-0.5, -0.2, 0.2, 0.5))
"""The same where a wheel without any of the effect is no sensible guess."""


def per_wheel(value: float, imbalance: float) -> Signal:
    """A value's share on each wheel, (2,): value · (1 − imbalance) left, value · (1 + imbalance) right."""
    return np.array((value * (1.0 - imbalance), value * (1.0 + imbalance)))


def wheel_forms(*parameters: str) -> tuple[Form, ...]:
    """Forms with these parameters free: both wheels alike, one of them alone, or, where both have it, unevenly."""
    free = tuple((name,) for name in parameters)
    return (
        Form(free),
        Form(free, "left wheel", fixed={"imbalance": -1.0}, present=False),
        Form(free, "right wheel", fixed={"imbalance": 1.0}, present=False),
        Form((*free, ("imbalance",)), "uneven wheels", moved=("imbalance",), present=True),
    )


@effect("driver_map", Stage.ACTUATION)
class DriverMap(ShippedEffect):
    """The motor driver jumps to a smallest output as soon as the duty leaves zero.

    |output| = offset + (1 − offset)·|duty| from a duty of 0.01 on, nothing below it.
    """

    offset: float = parameter("duty", 0.0, 0.4, probes=(0.02, 0.04, 0.08, 0.15, 0.3),
        source="Duckiebot motor driver: (195|u| + 60)/255 above a duty of 0.01")  # fmt: skip
    trace = Trace((Cue.WHEEL_COMMAND,), WheelCurve.STEADY)

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Map each sample on its own."""
        size = np.abs(signal)
        jumped = np.sign(signal) * (self.offset + (1.0 - self.offset) * size)
        return (signal if self.offset == 0.0 else np.where(size < 0.01, 0.0, jumped)), None


@effect("trim", Stage.ACTUATION)
class Trim(ShippedEffect):
    """The right wheel runs faster than the left: left · (1 − trim), right · (1 + trim)."""

    trim: float = parameter("", -0.5, 0.5, probes=(-0.2, -0.1, -0.05, 0.05, 0.1, 0.2),
        source="31 calibrated Duckiebots: −0.014 ± 0.057; box of the paper ±0.3")  # fmt: skip
    trace = Trace((Cue.WHEEL_COMMAND,), WheelCurve.STEADY)

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Scale the two wheels apart."""
        return signal * np.array((1.0 - self.trim, 1.0 + self.trim)), None


GAIN = Parameter(name="gain", unit="", low=0.03, high=10.0, neutral=1.0, probes=(0.7, 0.85, 0.95, 1.05, 1.15, 1.3),
                 usual=(0.3, 1.7), source="31 calibrated Duckiebots: 1.01 ± 0.14")  # fmt: skip


@effect("gain", Stage.ACTUATION)
class Gain(ShippedEffect):
    """Both wheels turn faster or slower than nominal by one factor: on a single column, all that a gain is."""

    gain: float = like(GAIN)
    trace = Trace((Cue.WHEEL_COMMAND,), WheelCurve.STEADY)

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Scale both."""
        return signal * self.gain, None


@effect("wheel_gain", Stage.ACTUATION)
class WheelGain(ShippedEffect):
    """Each wheel turns faster or slower than nominal by a factor of its own."""

    left: float = like(GAIN)
    right: float = like(GAIN)
    trace = Trace(
        (Cue.WHEEL_COMMAND,),
        WheelCurve.STEADY,
        forms=(Form((("left", "right"),)), Form((("left",),), "left wheel"), Form((("right",),), "right wheel")),
    )

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Scale each wheel."""
        return signal * np.array((self.left, self.right)), None


@effect("motor_lag", Stage.ACTUATION)
class MotorLag(ShippedEffect):
    """Wheels follow the speed asked of them with a first-order lag, τ dω/dt = ω* − ω."""

    time_constant: float = parameter("s", 0.0, 10.0, "motor_time_constant", probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8),
        usual=(0.0, 1.0), source="gym-duckietown's dynamics fit: 0.20 s")  # fmt: skip
    imbalance: float = like(SLIGHT_IMBALANCE)
    trace = Trace((Cue.TRANSIENTS, Cue.WHEEL_COMMAND), WheelCurve.STEP, forms=wheel_forms("time_constant"))

    def begin(self, context: FilterContext) -> tuple[LowPassState, ...]:
        """Wheels turn at the speed asked of them before time zero."""
        samples = per_wheel(self.time_constant * context.rate_hz, self.imbalance).tolist()
        rest = np.asarray(context.rest, dtype=float)
        if not self.imbalance:  # one filter over both wheels is faster than one for each
            return (low_pass_at(rest, samples[0]),)
        return tuple(low_pass_at(rest[..., side : side + 1], value) for side, value in enumerate(samples))

    def apply(self, signal: Signal, memory: tuple[LowPassState, ...]) -> tuple[Signal, tuple[LowPassState, ...]]:
        """The mean speed over each sample, exact for a command that holds over it."""
        if len(memory) == 1:
            mean, after = low_pass(signal, memory[0])
            return mean, (after,)
        sides = [low_pass(signal[..., side : side + 1], state) for side, state in enumerate(memory)]
        return np.concatenate([mean for mean, _ in sides], axis=-1), tuple(after for _, after in sides)


class SlewState(NamedTuple):
    """The newest duty (…, 2), and how far it can change within a sample."""

    duty: Signal
    step: float


@effect("slew_rate", Stage.ACTUATION)
class SlewRate(ShippedEffect):
    """The motor driver changes each wheel's duty no faster than from rest to full within `rise_time`."""

    rise_time: float = parameter("s", 0.0, 30.0, probes=(0.05, 0.1, 0.2, 0.4, 0.8, 1.6), usual=(0.0, 3.0),
        source="ramps of motor drivers: some tenths of a second to a few seconds from rest to full speed")  # fmt: skip
    trace = Trace((Cue.TRANSIENTS, Cue.WHEEL_COMMAND), WheelCurve.STEP)

    def begin(self, context: FilterContext) -> SlewState:
        """The resting duty has been reached."""
        step = 1.0 / (self.rise_time * context.rate_hz) if self.rise_time > 0.0 else np.inf
        return SlewState(np.asarray(context.rest, dtype=float), step)

    def apply(self, signal: Signal, memory: SlewState) -> tuple[Signal, SlewState]:
        """Go towards each sample by one step at most."""
        series = np.moveaxis(np.asarray(signal, dtype=float), -2, -1)
        start = np.broadcast_to(memory.duty, series.shape[:-1])
        ramps = _ramps(series.reshape(-1, series.shape[-1]), start.ravel(), memory.step)
        reached = np.moveaxis(ramps.reshape(series.shape), -1, -2)
        return reached, memory._replace(duty=reached[..., -1, :])


def _ramps(wanted: Signal, start: Signal, step: float) -> Signal:
    """Each row (rows, time) followed by one step a sample at most: one ramp for each change of what is wanted."""
    if wanted.size and (compiled := fastest(wanted.size)):
        return compiled.ramps(wanted, start, step)  # type: ignore[no-any-return]
    begins = np.flatnonzero(np.diff(wanted, axis=1, prepend=np.nan))
    lengths = np.diff(begins, append=wanted.size)
    held = wanted.ravel()[begins]
    gaps = np.empty(len(begins))
    row, here = 0, 0.0
    ramps = zip(begins.tolist(), held.tolist(), (lengths * step).tolist(), strict=True)
    for number, (first, value, reach) in enumerate(ramps):
        if first % wanted.shape[1] == 0:
            row, here = row + 1, float(start[row])
        gaps[number] = gap = here - value
        here = value + (gap - reach if gap > reach else gap + reach if gap < -reach else 0.0)
    of = np.repeat(np.arange(len(begins)), lengths)
    way = (np.arange(wanted.size) - begins[of] + 1) * step
    ramp = np.sign(gaps[of]) * np.maximum(0.0, np.abs(gaps[of]) - way)
    return np.asarray((held[of] + ramp).reshape(wanted.shape))


def _fading(cue: Cue, label: str) -> Means:
    return Means(cue, (Panel("", label, "forward", share=True),))


@effect("thermal_fade", Stage.ACTUATION)
class ThermalFade(ShippedEffect):
    """Both wheels turn slower the harder they have worked of late, by `loss` after long work at full duty.

    Their speed is multiplied by 1 − loss · load, where load follows mean |u| with a lag of `time_constant`.
    """

    loss: float = parameter("", 0.0, 0.9, probes=(0.05, 0.1, 0.2, 0.4, 0.8),
        source="windings that are 80 °C warmer have a third more resistance")  # fmt: skip
    time_constant: float = parameter("s", 0.5, 1200.0, 8.0, probes=(2.0, 4.0, 15.0, 40.0), usual=(0.5, 120.0),
        source="small motors warm up within seconds to minutes", shape=True)  # fmt: skip
    trace = Trace((Cue.USE, Cue.TIME), _fading(Cue.USE, "use so far [s at full duty]"))

    def begin(self, context: FilterContext) -> LowPassState:
        """With motors as warm as the resting duty keeps them."""
        rest = np.abs(np.asarray(context.rest, dtype=float)).mean(axis=-1, keepdims=True)
        return low_pass_at(rest, self.time_constant * context.rate_hz)

    def apply(self, signal: Signal, memory: LowPassState) -> tuple[Signal, LowPassState]:
        """Slow both wheels by one factor."""
        load, after = low_pass(np.abs(signal).mean(axis=-1, keepdims=True), memory)
        return signal * (1.0 - self.loss * np.minimum(1.0, load)), after


SMALLEST_LIMIT = 0.05
"""A wheel keeps so much of its duty, however the lost part is shared out."""


@effect("saturation", Stage.ACTUATION)
class Saturation(ShippedEffect):
    """Wheels turn no faster than at a duty of `limit`; the lost part, 1 − limit, is what the wheels share."""

    limit: float = parameter("duty", 0.1, 1.0, 1.0, probes=(0.15, 0.25, 0.4, 0.6, 0.8, 0.9),
        source="drivers that cap the duty, batteries run down: 0.5 to 1")  # fmt: skip
    imbalance: float = like(IMBALANCE)
    trace = Trace((Cue.WHEEL_COMMAND,), WheelCurve.STEADY, forms=wheel_forms("limit"))

    def begin(self, context: FilterContext) -> Signal:
        """The limit of each wheel (2,)."""
        return np.maximum(SMALLEST_LIMIT, 1.0 - per_wheel(1.0 - self.limit, self.imbalance))

    def apply(self, signal: Signal, memory: Signal) -> tuple[Signal, Signal]:
        """Clip at ± limit."""
        return np.clip(signal, -memory, memory), memory


class BatteryState(NamedTuple):
    """Minutes at full duty since the start (…,), number of the next sample, and how many minutes a sample lasts."""

    use: Signal
    next: int
    minutes: float


@effect("battery_sag", Stage.ACTUATION)
class BatterySag(ShippedEffect):
    """Both wheels turn slower under load, and the slower the more, or the longer, has been driven since the start.

    Their speed is multiplied by (1 − load · mean |u|) · exp(−fade · use − fade_with_time · time), use being the
    integral of mean |u|.
    """

    load: float = parameter("", 0.0, 0.8, probes=(0.03, 0.06, 0.12, 0.25, 0.5),
        source="inner resistance of small batteries: some hundredths at full load, old ones some tenths")  # fmt: skip
    fade: float = parameter("1/min", 0.0, 10.0, probes=(0.03, 0.06, 0.12, 0.25, 0.5, 1.0), usual=(0.0, 1.0),
        source="a battery that lasts minutes to an hour at full duty")  # fmt: skip
    fade_with_time: float = parameter("1/min", 0.0, 10.0, probes=(0.03, 0.06, 0.12, 0.25, 0.5, 1.0), usual=(0.0, 1.0),
        source="what else a battery feeds empties it too, driving or not")  # fmt: skip
    trace = Trace(
        (Cue.USE, Cue.TIME),
        WheelCurve.STEADY,
        forms=(
            Form((("load",),), "load"),
            Form((("fade",),), "fade", shown=_fading(Cue.USE, "use so far [s at full duty]")),
            Form((("fade_with_time",),), "fade with time", shown=_fading(Cue.TIME, "time in the episode [s]")),
        ),
    )

    def begin(self, context: FilterContext) -> BatteryState:
        """With the battery as it is at the start."""
        return BatteryState(np.zeros(np.shape(context.rest)[:-1]), 0, 1.0 / (60.0 * context.rate_hz))

    def apply(self, signal: Signal, memory: BatteryState) -> tuple[Signal, BatteryState]:
        """Slow both wheels by one factor, its fading taken at the middle of each sample."""
        mean = (np.abs(signal[..., 0]) + np.abs(signal[..., 1])) / 2.0
        used = memory.use[..., None] + np.cumsum(mean, axis=-1) * memory.minutes
        numbers = np.arange(memory.next, memory.next + mean.shape[-1])
        time = (numbers + 0.5) * memory.minutes
        faded = np.exp(-self.fade * (used - mean * (memory.minutes / 2.0)) - self.fade_with_time * time)
        factor = np.maximum(0.0, 1.0 - self.load * mean) * faded
        return signal * factor[..., None], memory._replace(use=used[..., -1], next=memory.next + mean.shape[-1])
