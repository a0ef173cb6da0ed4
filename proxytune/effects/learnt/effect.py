"""Motion that was learnt from drives and has no name: curves over causal features. It is not physics."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.body.floor import REST_SPEED
from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.known import Known, beforehand, values_along
from proxytune.effects.learnt.bases import Asked, Knots
from proxytune.effects.learnt.features import GROUPS, HEADING
from proxytune.effects.learnt.past import low_passes, moved_since, play, rings, rolled_since
from proxytune.effects.trace import Trace
from proxytune.space import Parameter


class Curve(NamedTuple):
    """One channel of one group: a weight for each of its knots, in their order."""

    group: str
    channel: str
    knots: Knots
    weights: tuple[float, ...]


class Seen(NamedTuple):
    """The speeds [m/s] and yaw rates [rad/s] that the fit saw: what is asked for beyond them counts as the last."""

    forward: tuple[float, float]
    yaw: tuple[float, float]


class Past(NamedTuple):
    """What has been so far: arrays of the batch's shape, and low-passes with their time constants last.

    Attributes:
        seconds: Since the start [s].
        use: Minutes at full speed.
        slow: Low-passes of each wheel's speed (2, …, time constants).
        load: Low-passes of the mean wheel speed's size (…, time constants).
        rolled: How far each wheel, and the robot, has gone since it last turned the other way [m] (3, …), negative
            backwards.
        started: Since each wheel last stood [s] (2, …).
        last: Each wheel's newest speed (2, …).
        ring: Swings of each wheel's speed, complex (2, …, frequencies).
        dragged: Each wheel's speed through plays (2, …, widths).
        bearing: The heading, and headings that are known beforehand.
        rate_hz: Samples per second.
        baseline: The robot's effective baseline [m].
        full_speed: The robot's full speed [m/s].
    """

    seconds: Signal
    use: Signal
    slow: Signal
    load: Signal
    rolled: Signal
    started: Signal
    last: Signal
    ring: Signal
    dragged: Signal
    bearing: Known
    rate_hz: float
    baseline: float
    full_speed: float


@dataclass(frozen=True)
class Learnt:
    """Adds to the twist the sum of curves over features of the twist that is asked for.

    It vanishes where the robot stands, and beyond what the fit saw it is what it is at the edge.
    """

    seen: Seen
    curves: tuple[Curve, ...]
    name: ClassVar[str] = "learnt"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> Past:
        """At rest, unused."""
        batch = np.shape(setting.rest)[:-1]
        slow = np.zeros((2, *batch, len(self._constants("transients"))))
        load = np.zeros((*batch, len(self._constants("load"))))
        nominal = setting.nominal
        figures = (setting.rate_hz, nominal["effective_baseline"], nominal["full_speed"])
        return Past(
            np.zeros(batch),
            np.zeros(batch),
            slow,
            load,
            np.zeros((3, *batch)),
            np.zeros((2, *batch)),
            np.zeros((2, *batch)),
            np.zeros((2, *batch, len(self._constants("ringing"))), dtype=complex),
            np.zeros((2, *batch, len(self._constants("play")))),
            beforehand(setting.headings, setting),
            *figures,
        )

    def apply(self, signal: Signal, memory: Past) -> tuple[Signal, Past]:
        """Add what the curves say."""
        asked, after = self._asked(signal, memory)
        moved = signal + self._added(asked, memory.baseline, of_heading=False)
        if self._constants(HEADING):
            moved, onwards = self._bent(moved, asked, memory)
            after = after._replace(bearing=onwards)
        return moved, after

    def _bent(self, moved: Signal, asked: Asked, memory: Past) -> tuple[Signal, Known]:
        """The motion with what depends on the heading: sample by sample where that leads to another heading."""
        bearing, length = memory.bearing, moved.shape[-2]
        at_once = bearing.values.shape[-1] - bearing.next >= length or not self._turns_by_heading
        out = []
        for begin in range(0, length, length if at_once else 1):
            here = slice(begin, length if at_once else begin + 1)
            course, _ = values_along(moved[..., here, 2], bearing)
            there = asked._replace(forward=asked.forward[..., here], yaw=asked.yaw[..., here], heading=course)
            out.append(moved[..., here, :] + self._added(there, memory.baseline, of_heading=True))
            _, bearing = values_along(out[-1][..., 2], bearing)
        return np.concatenate(out, axis=-2), bearing

    @property
    def _turns_by_heading(self) -> bool:
        return any(
            curve.group == HEADING and GROUPS[HEADING].channels[curve.channel].to == "yaw" for curve in self.curves
        )

    def recall(self, setting: Setting, signal: Signal, row: Signal, sample: Signal) -> Past:
        """The memory as of given samples of longer signals: the past of windows that begin amid drives.

        Args:
            setting: Of the windows (W, …).
            signal: What was asked for from the start on (rows, time, 3).
            row: The row of each window (W,).
            sample: The sample of its row at which each window begins (W,).
        """
        whole = self.begin(Setting(setting.rate_hz, np.zeros((len(signal), 3)), setting.nominal))
        asked, _ = self._asked(signal, whole)

        def before(values: Signal) -> Signal:
            return np.where((sample > 0).reshape(-1, *[1] * (values.ndim - 2)), values[row, sample - 1], 0.0)

        slow = [
            wheel[..., None] - np.cumsum(band, axis=-1) for wheel, band in zip(asked.wheels, asked.bands, strict=True)
        ]
        return self.begin(setting)._replace(
            seconds=sample / setting.rate_hz,
            use=before(asked.use),
            slow=np.stack([before(one) for one in slow]),
            load=before(asked.loads),
            rolled=np.stack([before(one) for one in asked.rolled]),
            started=np.stack([before(one) for one in asked.started]),
            last=np.stack([before(one) for one in asked.wheels]),
            ring=np.stack([before(one) for one in asked.rings]),
            dragged=np.stack([before(one) for one in asked.played]),
        )

    def features(self, signal: Signal, memory: Past) -> list[tuple[Signal, Signal]]:
        """What each weight adds, curve by curve: its features (…, time, knots) and the twist of one unit (3,).

        The heading is taken from what is known beforehand and from the twist that is asked for.
        """
        asked, _ = self._asked(signal, memory)
        course, _ = values_along(signal[..., 2], memory.bearing)
        asked = asked._replace(heading=course)
        channels = [(curve, GROUPS[curve.group].channels[curve.channel]) for curve in self.curves]
        return [(one.basis(asked, curve.knots), _direction(one.to, memory.baseline)) for curve, one in channels]

    def _added(self, asked: Asked, baseline: float, *, of_heading: bool) -> Signal:
        added = np.zeros((*asked.forward.shape, 3))
        for curve in self.curves:
            if (curve.group == HEADING) == of_heading:
                channel = GROUPS[curve.group].channels[curve.channel]
                amount = channel.basis(asked, curve.knots) @ np.asarray(curve.weights)
                added += amount[..., None] * _direction(channel.to, baseline)
        return added

    def _constants(self, group: str) -> Knots:
        """The knots of a group, none where the effect has no such group."""
        return next((curve.knots for curve in self.curves if curve.group == group), ())

    def _asked(self, signal: Signal, past: Past) -> tuple[Asked, Past]:
        """What is asked for and its past, and the past of the next chunk; no heading yet."""
        forward, yaw = np.clip(signal[..., 0], *self.seen.forward), np.clip(signal[..., 2], *self.seen.yaw)
        turn = yaw * (past.baseline / 2.0)
        wheels = np.stack((forward - turn, forward + turn))
        effort = np.abs(wheels).mean(axis=0) / past.full_speed
        seconds = past.seconds[..., None] + np.arange(1, forward.shape[-1] + 1) / past.rate_hz
        use = past.use[..., None] + np.cumsum(effort, axis=-1) / (60.0 * past.rate_hz)
        slow = low_passes(wheels, past.slow, self._constants("transients"), past.rate_hz)
        load = low_passes(effort, past.load, self._constants("load"), past.rate_hz)
        bands = -np.diff(slow, axis=-1, prepend=wheels[..., None])
        rolled = rolled_since(np.stack((*wheels, forward)), past.rolled, past.rate_hz)
        started = moved_since(wheels, past.started, REST_SPEED, past.rate_hz)
        change = np.diff(wheels, axis=-1, prepend=past.last[..., None])
        ringing = rings(change, past.ring, self._constants("ringing"), past.rate_hz)
        played = play(wheels, past.dragged, self._constants("play"))
        after = past._replace(seconds=seconds[..., -1], use=use[..., -1], slow=slow[..., -1, :], load=load[..., -1, :])
        of_wheels = (bands, load, rolled, started, ringing, played)
        asked = Asked(forward, yaw, wheels, seconds, use, np.zeros_like(yaw), *of_wheels)
        after = after._replace(rolled=rolled[..., -1], started=started[..., -1], last=wheels[..., -1])
        return asked, after._replace(ring=ringing[..., -1, :], dragged=played[..., -1, :])


def _direction(to: str, baseline: float) -> Signal:
    """The twist that a unit of forward, sideways, yaw, or of a wheel's speed makes (3,)."""
    wheel = {"left": (0.5, 0.0, -1.0 / baseline), "right": (0.5, 0.0, 1.0 / baseline)}
    body = {"forward": (1.0, 0.0, 0.0), "sideways": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
    return np.array({**wheel, **body}[to])
