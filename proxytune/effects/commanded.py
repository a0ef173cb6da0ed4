"""Curves over commands and their past: what a driver, a receiver or a supply does to them that has no name.

`LearntCommands` is the effect, beside `Learnt`, which looks at motion; both wheels are treated alike. `COMMAND_GROUPS`
are its signals, each a function of the duties that reach the motors and of what was commanded before.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import FilterContext, Signal, Stage, Trace
from proxytune.effects.features import (
    MOTION_GROUPS,
    Channel,
    Group,
    Knots,
    LearntCurve,
    hats,
    low_passes,
    newest_signs,
    play,
    ramp,
)
from proxytune.space import Parameter

STILL = 0.02
"""A duty smaller than this moves no wheel."""
SAME = 1e-9
"""Duties that differ by less are the same."""
LONG_S = 1e6
"""Before the start the resting command had been given for so long."""


class Commands(NamedTuple):
    """Duties and their past, wheel by wheel (…, time, 2) where nothing else is said."""

    duty: Signal  # the duties that reach the motors
    held: Signal  # since either of them last changed [s]
    begun: Signal  # since each last was still, for more than a sample [s]
    turned: Signal  # since each last took the other sign [s]
    dragged: Signal  # each through plays of some widths (…, time, 2, widths)
    slow: Signal  # low-passes of each (…, time, 2, time constants)
    ramped: Signal  # each where its size grows and shrinks no faster than in such times (…, time, 2, pairs of times)


class CommandState(NamedTuple):
    """The past of the next chunk: `Commands` without the time axis, and the sign of each wheel's last motion."""

    last: Commands
    sign: Signal
    rate_hz: float


def _within(seconds: Signal, knots: Knots) -> Signal:
    """1 until so long has passed, then 0 (…, knots)."""
    return (seconds[..., None] < np.asarray(knots)).astype(float)


def _moving(commands: Commands) -> Signal:
    return np.minimum(1.0, np.abs(commands.duty) / STILL)[..., None]


def _group(title: str, unit: str, *, of: str = "of the command", **bases: Callable[[Commands, Knots], Signal]) -> Group:
    """Curves that add to the duty of either wheel a share of something, or a push."""
    channels = {to: Channel("duty", "duty" if to == "push" else of, basis) for to, basis in bases.items()}
    return Group(title, unit, channels, 0.0 if "," in unit else 1e-3)


COMMAND_GROUPS: Mapping[str, Group] = MappingProxyType(
    {
        "duty": _group(
            "size of the command", "duty", of="duty", duty=lambda c, k: hats(np.abs(c.duty), k, np.sign(c.duty))
        ),
        "drawn": _group(
            "sum of both commands",
            "duty",
            duty=lambda c, k: hats(np.abs(c.duty).sum(axis=-1, keepdims=True), k, c.duty),
        ),
        "held": _group(
            "time since a command changed", "s", duty=lambda c, k: c.duty[..., None] * (1.0 - _within(c.held, k))
        ),
        "begun": _group(
            "time since a command began",
            "s",
            share=lambda c, k: c.duty[..., None] * _within(c.begun, k),
            push=lambda c, k: np.sign(c.duty)[..., None] * _moving(c) * _within(c.begun, k),
        ),
        "turned": _group(
            "time since a command turned round", "s", duty=lambda c, k: c.duty[..., None] * _within(c.turned, k)
        ),
        "dragged": _group(
            "way in which a command changes", "duty", of="of the play", duty=lambda c, k: c.dragged - c.duty[..., None]
        ),
        "ramped": _group(
            "how fast a command grows and shrinks",
            "s, s",
            of="of how far it is behind",
            duty=lambda c, k: c.ramped - c.duty[..., None],
        ),
        "ended": _group(
            "time since a command ended", "s", duty=lambda c, k: c.slow * (np.abs(c.duty) < STILL)[..., None]
        ),
    }
)
"""Every group over commands. All are 0 where a command has been 0 from the start on."""
GROUPS: Mapping[str, Group] = MappingProxyType({**MOTION_GROUPS, **COMMAND_GROUPS})
"""Every group that a learnt effect can have."""


@dataclass(frozen=True)
class LearntCommands:
    """Adds to each duty the sum of curves over the duties and their past: weight · feature. It is not physics."""

    curves: tuple[LearntCurve, ...]
    name: ClassVar[str] = "learnt"
    stage: ClassVar[Stage] = Stage.COMMAND
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    trace: ClassVar[Trace | None] = None

    def begin(self, context: FilterContext) -> CommandState:
        """The resting command has been given for ever."""
        rest = np.asarray(context.rest, dtype=float)
        long, begun = np.full(rest.shape, LONG_S), np.where(np.abs(rest) < STILL, 0.0, LONG_S)
        knots = map(self._knots, ("dragged", "ended", "ramped"))
        dragged, slow, ramped = (np.repeat(rest[..., None], len(own), axis=-1) for own in knots)
        return CommandState(Commands(rest, long, begun, long, dragged, slow, ramped), np.sign(rest), context.rate_hz)

    def apply(self, signal: Signal, memory: CommandState) -> tuple[Signal, CommandState]:
        """Add what the curves say."""
        commands, after = self._recall(signal, memory)
        added = sum(_basis(curve)(commands, curve.knots) @ np.asarray(curve.weights) for curve in self.curves)
        return signal + added, after

    def features(self, signal: Signal, memory: CommandState) -> Iterator[Signal]:
        """Features that weights scale, curve by curve (…, time, 2, knots), as they are asked for."""
        commands, _ = self._recall(signal, memory)
        for curve in self.curves:
            yield _basis(curve)(commands, curve.knots)

    def _knots(self, group: str) -> Knots:
        return next((curve.knots for curve in self.curves if curve.group == group), ())

    def _recall(self, signal: Signal, past: CommandState) -> tuple[Commands, CommandState]:
        """Duties with their past, and the past of the next chunk."""

        def since(event: Signal, before: Signal) -> Signal:
            """Time since an event (…, time, 2) [s], 0 while there is one."""
            number = np.arange(1.0, signal.shape[-2] + 1.0)[:, None]
            newest = np.maximum.accumulate(np.where(event, number, -before[..., None, :] * past.rate_hz), axis=-2)
            return np.asarray((number - newest) / past.rate_hz)

        last, before = past.last, np.concatenate((past.last.duty[..., None, :], signal), axis=-2)
        changed = (np.abs(np.diff(before, axis=-2)) > SAME).any(axis=-1, keepdims=True)
        # A delay that is no whole number of samples mixes two commands: one of each sign make no stop.
        still = np.abs(before) < STILL
        wheels = np.moveaxis(signal, -2, -1)
        course = newest_signs(np.concatenate((past.sign[..., None], np.sign(wheels)), axis=-1))
        turned = np.moveaxis(np.diff(course, axis=-1) * course[..., :-1] != 0.0, -1, -2)
        dragged = np.moveaxis(play(wheels, last.dragged, self._knots("dragged")), -2, -3)
        slow = np.moveaxis(low_passes(wheels, last.slow, self._knots("ended"), past.rate_hz), -2, -3)
        fewest = np.maximum(np.reshape(self._knots("ramped"), (-1, 2)) * past.rate_hz, 1.0 / LONG_S)
        ramped = np.moveaxis(ramp(wheels, last.ramped, *(1.0 / fewest.T)), -2, -3)
        commands = Commands(
            duty=signal,
            held=since(np.broadcast_to(changed, signal.shape), last.held),
            begun=since(still[..., 1:, :] & still[..., :-1, :], last.begun),
            turned=since(turned, last.turned),
            dragged=dragged,
            slow=slow,
            ramped=ramped,
        )
        newest = Commands._make(part.take(-1, axis=signal.ndim - 2) for part in commands)
        return commands, CommandState(newest, course[..., -1], past.rate_hz)


def _basis(curve: LearntCurve) -> Callable[[Commands, Knots], Signal]:
    return COMMAND_GROUPS[curve.group].channels[curve.channel].basis
