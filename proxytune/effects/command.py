"""Effects on commands between the agent that issues them and the motors that obey them.

Delay and quantisation treat every sample alike. Jitter and loss strike single messages, so they draw one number for
each message of the robot's control rate, found by the message's number: the same in every chunk and batch.
"""

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.arrays import Whole
from proxytune.effects.effect import (
    Cue,
    Draws,
    FilterContext,
    Form,
    Lateness,
    ShippedEffect,
    Signal,
    Stage,
    Trace,
    WheelCurve,
    effect,
    parameter,
)
from proxytune.effects.features import newest_signs
from proxytune.seeds import message_generator


class DelayLine(NamedTuple):
    """The newest past samples, and the delay as whole samples and a fraction of one."""

    samples: Signal
    fraction: float


@effect("delay", Stage.COMMAND)
class Delay(ShippedEffect):
    """Commands arrive late by a constant time, interpolated between samples.

    A command holds over its sample interval, so the mean of the delayed command over an interval is the linear
    interpolation between two samples: exact for a delay of any length, and continuous in it.
    """

    delay: float = parameter("s", 0.0, 0.6, probes=(0.02, 0.04, 0.08, 0.15, 0.3),
        source="Duckiebot image-to-motor latency about 0.14 s; box of the paper 0 to 0.30 s")  # fmt: skip
    trace = Trace((Cue.TRANSIENTS,), WheelCurve.STEP)

    def begin(self, context: FilterContext) -> DelayLine:
        """Begin as if the robot had been at rest for ever."""
        samples = self.delay * context.rate_hz
        whole = int(np.floor(samples + 1e-9))
        rest = np.asarray(context.rest, dtype=float)[..., None, :]
        return DelayLine(np.repeat(rest, whole + 1, axis=-2), max(0.0, samples - whole))

    def apply(self, signal: Signal, memory: DelayLine) -> tuple[Signal, DelayLine]:
        """Interpolate between the two samples that the delay falls between."""
        length = signal.shape[-2]
        joined = np.concatenate((memory.samples, signal), axis=-2)
        late = (1.0 - memory.fraction) * joined[..., 1 : length + 1, :] + memory.fraction * joined[..., :length, :]
        return late, DelayLine(joined[..., length:, :], memory.fraction)


@effect("command_quantisation", Stage.COMMAND)
class CommandQuantisation(ShippedEffect):
    """Commands are rounded to multiples of a step on their way."""

    step: float = parameter("duty", 0.0, 0.5, probes=(0.02, 0.05, 0.1, 0.2, 0.4),
        source="8 bits: 0.008; drivers with a few speed levels: 0.1 to 0.3")  # fmt: skip
    trace = Trace((Cue.WHEEL_COMMAND,), WheelCurve.STEADY, stepwise=True)

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Round each sample, halves to the even multiple."""
        return (signal if self.step == 0.0 else np.rint(signal / self.step) * self.step), None


class ReversalState(NamedTuple):
    """Which way each wheel was last driven, how many samples ago that ended and its rest began (…, 2), and the pause.

    Times are in samples.
    """

    way: Signal
    ended: Signal
    rested: Signal
    pause: float


@effect("reversal_pause", Stage.COMMAND)
class ReversalPause(ShippedEffect):
    """The motor driver lets a wheel rest for `pause` before it drives it the other way.

    Of a stand before the command to turn round, a share `stand` counts as rest. The delay comes after it: it blends
    neighbouring commands, and the sign of a blend would depend on the delay.
    """

    pause: float = parameter("s", 0.0, 5.0, probes=(0.05, 0.1, 0.2, 0.4, 0.8, 1.6), usual=(0.0, 2.0),
        source="drivers that brake before they reverse: tenths of a second, of model cars up to two")  # fmt: skip
    stand: float = parameter("", 0.0, 1.0, 1.0, probes=(0.0, 0.25, 0.5, 0.75),
        source="1: the driver waits for the motor to rest; 0: for a time, whenever the sign of the command changes",
        shape=True)  # fmt: skip
    trace = Trace(
        (Cue.TRANSIENTS, Cue.WHEEL_COMMAND),
        WheelCurve.REVERSAL,
        forms=(Form((("pause",),)), Form((("pause",),), "after a stand too", fixed={"stand": 0.0})),
    )

    def begin(self, context: FilterContext) -> ReversalState:
        """The resting duty has been on for ever."""
        rest = np.asarray(context.rest, dtype=float)
        return ReversalState(
            np.sign(rest), np.zeros(rest.shape), np.full(rest.shape, np.inf), self.pause * context.rate_hz
        )

    def apply(self, signal: Signal, memory: ReversalState) -> tuple[Signal, ReversalState]:
        """Let through what of each sample comes after the pause."""
        duty = np.moveaxis(signal, -2, -1)
        starts, shape = np.arange(float(signal.shape[-2])), duty.shape[:-1]
        before, ended = (np.broadcast_to(known, shape)[..., None] for known in (memory.way, -memory.ended))
        way = newest_signs(np.concatenate((before, np.sign(duty)), axis=-1))
        drives = np.where(duty != 0.0, starts + 1.0, -np.inf)
        ended = np.maximum.accumulate(np.concatenate((ended, drives), axis=-1), axis=-1)
        turned, rest = duty * way[..., :-1] < 0.0, starts - self.stand * (starts - ended[..., :-1])
        rested = np.maximum(np.where(turned, rest, -np.inf), -memory.rested[..., None])
        rested = np.maximum.accumulate(rested, axis=-1)
        share = np.clip(starts + 1.0 - rested - memory.pause, 0.0, 1.0)
        ended, rested = (len(starts) - newest[..., -1] for newest in (ended, rested))
        return np.moveaxis(duty * share, -1, -2), ReversalState(way[..., -1], ended, rested, memory.pause)


BLOCK = 256
"""So many draws come from one generator: the draws of any message are found without those of the ones before."""


@functools.lru_cache(maxsize=1024)
def _block(seed: int, number: int) -> Signal:
    drawn = message_generator(seed, number).random(BLOCK)
    drawn.setflags(write=False)
    return drawn


@dataclass(frozen=True)
class Messages:
    """The messages that a signal comes in, numbered from time zero: so many per sample, and the seed of the draws."""

    per_sample: float
    seed: int

    def numbers(self, samples: Signal) -> Whole:
        """The message that each sample belongs to."""
        return np.floor(samples * self.per_sample + 1e-9).astype(np.int64)

    def starts(self, numbers: Signal) -> Whole:
        """The first sample of each message."""
        return np.ceil((numbers - 1e-9) / self.per_sample).astype(np.int64)

    def draws(self, low: int, high: int) -> Signal:
        """A number from 0 to 1 for each message from `low` on and before `high`: the same in every chunk and batch."""
        blocks = [_block(self.seed, number) for number in range(low // BLOCK, (high - 1) // BLOCK + 1)]
        begin = low // BLOCK * BLOCK
        return np.concatenate(blocks)[low - begin : high - begin]


def messages(context: FilterContext) -> Messages:
    """One message per control step of the robot."""
    return Messages(context.nominal["control_rate"] / context.rate_hz, context.seed)


MOST_LOST = 4
"""Commands lost in a row that are reckoned with."""


def _jittered(spread: float, rate_hz: float) -> Lateness:
    """Late by any time from 0 to the spread."""
    commands = spread / (1.0 / rate_hz) * (np.linspace(0.0, 1.0, 9) - 0.5)
    return Lateness(spread / 2.0, commands, np.full(len(commands), -np.log(len(commands))))


def _lost(probability: float, rate_hz: float) -> Lateness:
    """None lost, or one or more in a row."""
    number = np.arange(MOST_LOST + 1)
    mean = probability / (1.0 - probability)
    return Lateness(mean / rate_hz, number - mean, np.log1p(-probability) + number * np.log(probability))


class JitterState(NamedTuple):
    """The number of the next sample, the newest past samples, and the greatest extra delay [samples]."""

    next: int
    samples: Signal
    spread: float
    messages: Messages


@effect("delay_jitter", Stage.COMMAND)
class DelayJitter(ShippedEffect):
    """Every command is late by an extra time of its own, drawn evenly from 0 to `spread`.

    The order is kept: a command never arrives before the one that was sent before it. A command that arrives within a
    sample counts for the rest of it.
    """

    spread: float = parameter("s", 0.0, 0.3, probes=(0.02, 0.04, 0.08, 0.15, 0.3),
        source="wireless links: tens of milliseconds, now and then some tenths of a second")  # fmt: skip
    trace = Trace((Cue.TRANSIENTS,), WheelCurve.STEP, draws=Draws(_jittered, (2e-3, 0.3)))

    def begin(self, context: FilterContext) -> JitterState:
        """Begin as if the robot had been at rest for ever."""
        spread = self.spread * context.rate_hz
        rest = np.asarray(context.rest, dtype=float)[..., None, :]
        return JitterState(0, np.repeat(rest, math.ceil(spread), axis=-2), spread, messages(context))

    def apply(self, signal: Signal, memory: JitterState) -> tuple[Signal, JitterState]:
        """The mean over each sample of the commands in force: the same messages for all members of a batch."""
        begin, end, past, sent = memory.next, memory.next + signal.shape[-2], memory.samples.shape[-2], memory.messages
        late = math.ceil((memory.spread + 1.0) * sent.per_sample) + 1
        newest = int(sent.numbers(np.array(end - 1)))
        # Twice: a message in force at the beginning may have waited for one that was as late as can be
        oldest = max(0, int(sent.numbers(np.array(begin))) - 2 * late)
        starts = sent.starts(np.arange(oldest, newest + 2))
        times = np.maximum.accumulate(starts[:-1] + memory.spread * sent.draws(oldest, newest + 1))
        # Each sample is cut where another message comes into force
        inside = times[(times > begin) & (times < end)]
        edges = np.sort(np.concatenate((np.arange(begin, end + 1), inside)))
        # A message's own samples pass as they are, for the delay before may have blended two messages in one sample
        lasts = np.concatenate(([starts[0] - 1], starts[1:] - 1))[np.searchsorted(times, edges[:-1], side="right")]
        sources = np.minimum(np.floor(edges[:-1]).astype(np.int64), lasts)
        joined = np.concatenate((memory.samples, signal), axis=-2)
        values = np.take(joined, sources + (past - begin), axis=-2) * np.diff(edges)[:, None]
        arrived = np.add.reduceat(values, np.searchsorted(edges[:-1], np.arange(begin, end)), axis=-2)
        return arrived, memory._replace(next=end, samples=joined[..., end - begin :, :])


class LastReceived(NamedTuple):
    """The number of the next sample, and the newest sample that was received."""

    next: int
    sample: Signal
    messages: Messages


@effect("dropped_commands", Stage.COMMAND)
class DroppedCommands(ShippedEffect):
    """Some commands never arrive; the one before stays in force."""

    probability: float = parameter("", 0.0, 0.9, probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.7),
        source="wireless links: some in a hundred, in bad places half")  # fmt: skip
    trace = Trace((Cue.TRANSIENTS,), WheelCurve.STEP, draws=Draws(_lost, (1e-3, 0.6)))

    def begin(self, context: FilterContext) -> LastReceived:
        """At rest until the first command arrives."""
        return LastReceived(0, np.asarray(context.rest, dtype=float)[..., None, :], messages(context))

    def apply(self, signal: Signal, memory: LastReceived) -> tuple[Signal, LastReceived]:
        """Hold the last sample of the last message that was received."""
        numbers = memory.messages.numbers(np.arange(memory.next, memory.next + signal.shape[-2]))
        received = memory.messages.draws(int(numbers[0]), int(numbers[-1]) + 1) >= self.probability
        places = np.arange(1, len(numbers) + 1)
        newest = np.maximum.accumulate(np.where(received[numbers - numbers[0]], places, 0))
        held = np.take(np.concatenate((memory.sample, signal), axis=-2), newest, axis=-2)
        return held, memory._replace(next=memory.next + len(numbers), sample=held[..., -1:, :])
