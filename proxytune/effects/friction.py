"""Effects of friction, play and wheels that are out of round.

Dead band, stiction and backlash depend on how a wheel's duty came about; ripple on the angle that it has turned by.
"""

import math
from typing import NamedTuple

import numpy as np

from proxytune.arrays import Flags
from proxytune.effects.effect import (
    FEW,
    Cue,
    DeadReckoning,
    FilterContext,
    Form,
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
    parameter,
    reckon,
    start_reckoning,
)
from proxytune.effects.motors import IMBALANCE, per_wheel, wheel_forms
from proxytune.space import Parameter


@effect("dead_band", Stage.ACTUATION)
class DeadBand(ShippedEffect):
    """A wheel does not turn for duties up to `width`, and by that much less for larger ones."""

    width: float = parameter("duty", 0.0, 0.95, probes=(0.02, 0.04, 0.08, 0.15, 0.3), usual=(0.0, 0.5),
        source="friction of small gear motors: 0.05 to 0.2 of full duty")  # fmt: skip
    imbalance: float = like(IMBALANCE)
    trace = Trace((Cue.WHEEL_COMMAND,), WheelCurve.STEADY, forms=wheel_forms("width"))

    def begin(self, context: FilterContext) -> Signal:
        """The width on each wheel (2,)."""
        return per_wheel(self.width, self.imbalance)

    def apply(self, signal: Signal, memory: Signal) -> tuple[Signal, Signal]:
        """sign(u) · max(0, |u| − width)."""
        return signal - np.clip(signal, -memory, memory), memory


class StictionState(NamedTuple):
    """At which duties each wheel breaks away, stops and turns the other way at once (2,), and whether wheels move."""

    breakaway: Signal
    stop: Signal
    turn: Signal
    sample: Signal
    moving: Flags


@effect("stiction", Stage.ACTUATION)
class Stiction(ShippedEffect):
    """A resting wheel needs a duty of `breakaway` to start; a moving one goes on down to `release` times that.

    A wheel whose duty changes sign comes to rest on the way, unless that duty is large enough: from what keeps a wheel
    going, at a `reversal` of 0, to what breaks it away, at 1.
    """

    breakaway: float = parameter("duty", 0.0, 0.95, probes=(0.03, 0.06, 0.12, 0.2, 0.3, 0.45), usual=(0.0, 0.6),
        source="small gear motors start at 0.1 to 0.3 of full duty")  # fmt: skip
    imbalance: float = like(IMBALANCE)
    release: float = parameter("", 0.0, 1.0, 0.5, probes=(0.2, 0.35, 0.65, 0.8, 0.9, 1.0),
        source="rolling friction by sticking friction: about half, nearly all where a driver cuts small duties",
        shape=True)  # fmt: skip
    reversal: float = parameter("", 0.0, 1.0, 1.0, probes=(0.0, 0.25, 0.5, 0.75),
        source="1: friction catches a slow wheel as it passes rest; 0: a wheel with momentum runs through",
        shape=True)  # fmt: skip
    trace = Trace(
        (Cue.WHEEL_COMMAND, Cue.REVERSAL),
        WheelCurve.STEADY,
        forms=(
            *wheel_forms("breakaway", "release"),
            Form((("breakaway",), ("release",)), "runs through reversals", fixed={"reversal": 0.0}),
        ),
        stepwise=True,
    )

    def begin(self, context: FilterContext) -> StictionState:
        """A wheel moves from the start if its resting duty keeps a moving wheel going."""
        breakaway = per_wheel(self.breakaway, self.imbalance)
        rest = np.asarray(context.rest, dtype=float)[..., None, :]
        stop = self.release * breakaway
        return StictionState(breakaway, stop, stop + self.reversal * (breakaway - stop), rest, np.abs(rest) >= stop)

    def apply(self, signal: Signal, memory: StictionState) -> tuple[Signal, StictionState]:
        """A Schmitt trigger on each wheel's duty."""
        if signal.shape[-2] > FEW and signal.dtype == float and (compiled := fastest(signal.size)):
            moved, moving = compiled.trigger(signal, np.stack(memory[:3]), memory.sample, memory.moving)
            return moved, memory._replace(sample=signal[..., -1:, :], moving=moving)
        size = np.abs(signal)
        before = np.concatenate((memory.sample, signal[..., :-1, :]), axis=-2)
        starts = size >= memory.breakaway
        stops = ~starts & ((size < memory.stop) | (signal * before < 0.0) & (size < memory.turn))
        moving = _latest(starts, stops, memory.moving)
        return np.where(moving, signal, 0.0), memory._replace(sample=signal[..., -1:, :], moving=moving[..., -1:, :])


def _latest(on: Flags, off: Flags, first: Flags) -> Flags:
    """Tell whether the latest event was an `on`, sample by sample: a sample's number, doubled, leaves a bit for it."""
    numbers = 2 * np.arange(1, on.shape[-2] + 1)[:, None]
    events = np.where(on | off, numbers + on, 0)
    events[..., :1, :] = np.where(events[..., :1, :] > 0, events[..., :1, :], first)
    return np.asarray(np.maximum.accumulate(events, axis=-2) % 2 == 1)


class BacklashState(NamedTuple):
    """Half the play of each wheel (2,), and how far each gear is ahead of the middle of it (…, 1, 2).

    Both in samples at full speed.
    """

    half: Signal
    ahead: Signal


@effect("backlash", Stage.ACTUATION)
class Backlash(ShippedEffect):
    """The gear turns through a gap before it takes the wheel along, whenever it reverses."""

    gap: float = parameter("rad", 0.0, 6.2, probes=(0.05, 0.1, 0.2, 0.4, 0.8, 1.5), usual=(0.0, 1.5),
        source="plastic gearboxes: some degrees, worn ones some tens")  # fmt: skip
    imbalance: float = like(IMBALANCE)
    trace = Trace((Cue.REVERSAL, Cue.TRANSIENTS), WheelCurve.REVERSAL, forms=wheel_forms("gap"))

    def begin(self, context: FilterContext) -> BacklashState:
        """In the middle of the play."""
        full_speed = context.nominal["full_speed"] / context.nominal["wheel_radius"]
        half = per_wheel(self.gap, self.imbalance) / 2.0 * (context.rate_hz / full_speed)
        return BacklashState(half, np.zeros_like(np.asarray(context.rest, dtype=float))[..., None, :])

    def apply(self, signal: Signal, memory: BacklashState) -> tuple[Signal, BacklashState]:
        """The wheel's angle stays while it is within the gear's angle ± half the gap."""
        gear = memory.ahead + np.cumsum(signal, axis=-2)
        ahead = gear - taken_along(gear, memory.half)
        gained = np.diff(ahead, axis=-2, prepend=memory.ahead)
        return signal - gained, memory._replace(ahead=ahead[..., -1:, :])


def taken_along(gear: Signal, half: Signal) -> Signal:
    """The wheel's angle as the gear's angle ± half the gap takes it along from 0 on (…, time, 2).

    Clips of clips are clips: bounds are composed within √time blocks side by side, then the blocks follow each other.
    """
    size = math.isqrt(gear.shape[-2])
    # Blocks side by side (time in block, …, block, 2), the last value held to fill up
    filled = np.concatenate((gear, np.repeat(gear[..., -1:, :], -gear.shape[-2] % size, axis=-2)), axis=-2)
    cut = filled.reshape(*gear.shape[:-2], -1, size, gear.shape[-1])
    blocks = np.ascontiguousarray(np.moveaxis(cut, -2, 0))
    low, high = blocks - half, blocks + half
    for inside in range(1, len(blocks)):
        bounds = low[inside], high[inside]
        low[inside], high[inside] = _within(low[inside - 1], *bounds), _within(high[inside - 1], *bounds)
    starts = np.zeros_like(blocks[0])
    for block in range(1, starts.shape[-2]):
        starts[..., block, :] = _within(*(angle[..., block - 1, :] for angle in (starts, low[-1], high[-1])))
    wheel = np.moveaxis(_within(starts, low, high), 0, -2)
    return wheel.reshape(*gear.shape[:-2], -1, gear.shape[-1])[..., : gear.shape[-2], :]


def _within(angle: Signal, low: Signal, high: Signal) -> Signal:
    """The same as numpy's clip, in less time."""
    return np.asarray(np.minimum(np.maximum(angle, low), high))


class RippleState(NamedTuple):
    """The angle of each wheel as known beforehand, half the distance between them [m], and their radius [m]."""

    angles: tuple[DeadReckoning, DeadReckoning]
    half: float
    radius: float


RIPPLE = Parameter(
    name="ripple", unit="", low=-0.6, high=0.6, neutral=0.0, probes=(-0.3, -0.1, -0.03, 0.03, 0.1, 0.3),
    source="a hub some tenths of a millimetre to some millimetres off the middle of a small wheel")  # fmt: skip


@effect("wheel_ripple", Stage.MOTION)
class WheelRipple(ShippedEffect):
    """Each wheel rolls faster and slower once a turn: by the factor 1 + sine · sin(angle) + cosine · cos(angle).

    Its amplitude is √(sine² + cosine²). Angles count from the start of the episode.
    """

    left_sine: float = like(RIPPLE)
    left_cosine: float = like(RIPPLE)
    right_sine: float = like(RIPPLE)
    right_cosine: float = like(RIPPLE)
    trace = Trace(
        (Cue.LEFT_ANGLE, Cue.RIGHT_ANGLE),
        Means(
            Cue.LEFT_ANGLE,
            tuple(
                Panel(f"{side} angle", f"angle of the {side} wheel [rad]", side, share=True)
                for side in ("left", "right")
            ),
        ),
    )

    def begin(self, context: FilterContext) -> RippleState:
        """With the angles that are known beforehand."""
        angles = np.asarray(context.angles, dtype=float)
        left, right = (start_reckoning(angles[..., side], context) for side in (0, 1))
        return RippleState((left, right), context.nominal["effective_baseline"] / 2.0, context.nominal["wheel_radius"])

    def apply(self, signal: Signal, memory: RippleState) -> tuple[Signal, RippleState]:
        """Add what each wheel gains or loses, by its angle in the middle of each sample."""
        forward, sideways, yaw = np.moveaxis(signal, -1, 0)
        parts = ((self.left_sine, self.left_cosine), (self.right_sine, self.right_cosine))
        extra, after = [], []
        for side, (sine, cosine), known in zip((-1.0, 1.0), parts, memory.angles, strict=True):
            speed = forward + side * memory.half * yaw
            angles, later = reckon(speed / memory.radius, known)
            middle = angles + speed / (2.0 * memory.radius * known.rate_hz)
            extra.append(speed * (sine * np.sin(middle) + cosine * np.cos(middle)))
            after.append(later)
        turned = yaw + (extra[1] - extra[0]) / (2.0 * memory.half)
        moved = np.stack((forward + (extra[0] + extra[1]) / 2.0, sideways, turned), axis=-1)
        return moved, memory._replace(angles=(after[0], after[1]))
