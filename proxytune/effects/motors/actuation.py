"""Effects between a command that has arrived and the speed that a wheel turns at, as a fraction of full speed."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.lag import Lag, follow, lag_of
from proxytune.effects.motors.wheels import SLIGHT_IMBALANCE, per_wheel, wheel_forms
from proxytune.effects.trace import Cue, Form, Trace, WheelCurve
from proxytune.space import Parameter


@dataclass(frozen=True)
class DriverMap:
    """The motor driver jumps to a smallest output as soon as the duty leaves zero.

    |output| = offset + (1 − offset)·|duty| from a duty of 0.01 on, nothing below it.
    """

    offset: float
    name: ClassVar[str] = "driver_map"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="offset",
            unit="duty",
            low=0.0,
            high=0.4,
            neutral=0.0,
            probes=(0.02, 0.04, 0.08, 0.15, 0.3),
            source="Duckiebot motor driver: (195|u| + 60)/255 above a duty of 0.01",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(cues=(Cue.WHEEL_COMMAND,), shown=WheelCurve.STEADY)

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Map each sample on its own."""
        size = np.abs(signal)
        jumped = np.sign(signal) * (self.offset + (1.0 - self.offset) * size)
        return (signal if self.offset == 0.0 else np.where(size < 0.01, 0.0, jumped)), None


@dataclass(frozen=True)
class Trim:
    """The right wheel runs faster than the left: left · (1 − trim), right · (1 + trim)."""

    trim: float
    name: ClassVar[str] = "trim"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="trim",
            unit="",
            low=-0.5,
            high=0.5,
            neutral=0.0,
            probes=(-0.2, -0.1, -0.05, 0.05, 0.1, 0.2),
            source="31 calibrated Duckiebots: −0.014 ± 0.057; box of the paper ±0.3",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(cues=(Cue.WHEEL_COMMAND,), shown=WheelCurve.STEADY)

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Scale the two wheels apart."""
        return signal * np.array((1.0 - self.trim, 1.0 + self.trim)), None


@dataclass(frozen=True)
class WheelGain:
    """Each wheel turns faster or slower than nominal by a factor of its own."""

    left: float
    right: float
    name: ClassVar[str] = "wheel_gain"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=side,
            unit="",
            low=0.3,
            high=1.7,
            neutral=1.0,
            probes=(0.7, 0.85, 0.95, 1.05, 1.15, 1.3),
            source="31 calibrated Duckiebots: 1.01 ± 0.14",
        )
        for side in ("left", "right")
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.WHEEL_COMMAND,),
        shown=WheelCurve.STEADY,
        forms=(Form((("left", "right"),)), Form((("left",),), "left wheel"), Form((("right",),), "right wheel")),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Scale each wheel."""
        return signal * np.array((self.left, self.right)), None


class Spin(NamedTuple):
    """Wheel speed at the end of the last sample, and the lag of the wheels: one for both, or one for each."""

    speed: Signal
    lags: tuple[Lag, ...]


@dataclass(frozen=True)
class MotorLag:
    """Wheels follow the speed asked of them with a first-order lag, τ dω/dt = ω* − ω."""

    time_constant: float
    imbalance: float
    name: ClassVar[str] = "motor_lag"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="time_constant",
            unit="s",
            low=0.0,
            high=1.0,
            neutral="motor_time_constant",
            probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8),
            source="gym-duckietown's dynamics fit: 0.20 s",
        ),
        SLIGHT_IMBALANCE,
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.TRANSIENTS, Cue.WHEEL_COMMAND), shown=WheelCurve.STEP, forms=wheel_forms("time_constant")
    )

    def begin(self, setting: Setting) -> Spin:
        """Wheels turn at the speed asked of them before time zero."""
        samples = per_wheel(self.time_constant * setting.rate_hz, self.imbalance)
        # One filter over both wheels is faster than one for each
        apart = samples if self.imbalance else samples[:1]
        return Spin(np.asarray(setting.rest, dtype=float), tuple(lag_of(value) for value in apart.tolist()))

    def apply(self, signal: Signal, memory: Spin) -> tuple[Signal, Spin]:
        """The mean speed over each sample, exact for a command that holds over it."""
        if len(memory.lags) == 1:
            mean, speed = follow(signal, memory.speed, memory.lags[0])
            return mean, Spin(speed, memory.lags)
        sides = [
            follow(signal[..., side : side + 1], memory.speed[..., side : side + 1], lag)
            for side, lag in enumerate(memory.lags)
        ]
        mean, speed = (np.concatenate(parts, axis=-1) for parts in zip(*sides, strict=True))
        return mean, memory._replace(speed=speed)
