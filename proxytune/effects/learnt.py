"""Motion that was learnt from drives and has no name: the twist grows by Σ weight · feature. It is not physics.

`Learnt` is the effect. Its values are names of θ, `learnt.GROUP.CHANNEL@KNOT`, and tables of a model.toml,
`[effects.learnt.GROUP]`; both ways of writing it are read and checked here.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.commanded import GROUPS, LearntCommands
from proxytune.effects.effect import DeadReckoning, FilterContext, Signal, Stage, Trace, reckon, start_reckoning
from proxytune.effects.features import (
    HEADING,
    MOTION_GROUPS,
    OF_PLACE,
    AskedMotion,
    Group,
    Knot,
    Knots,
    LearntCurve,
    low_passes,
    moved_since,
    play,
    rings,
    rolled_since,
)
from proxytune.effects.motion import REST_SPEED, PoseReckoning, pose_after, start_poses
from proxytune.errors import SettingsError
from proxytune.settings import Section, nearest
from proxytune.space import Parameter, Theta


class FittedRange(NamedTuple):
    """The speeds [m/s] and yaw rates [rad/s] that the fit saw: what is asked for beyond them counts as the last."""

    forward: tuple[float, float]
    yaw: tuple[float, float]


class LearntState(NamedTuple):
    """State of all that has been so far: arrays of the batch's shape, and low-passes with their time constants last."""

    seconds: Signal  # since the start [s]
    use: Signal  # minutes at full speed
    slow: Signal  # low-passes of each wheel's speed (2, …, time constants)
    load: Signal  # low-passes of the mean wheel speed's size (…, time constants)
    rolled: Signal  # way of each wheel and the robot since it last turned the other way [m] (3, …), negative backwards
    started: Signal  # since each wheel last stood [s] (2, …)
    last: Signal  # each wheel's newest speed (2, …)
    ring: Signal  # swings of each wheel's speed, complex (2, …, frequencies)
    dragged: Signal  # each wheel's speed through plays (2, …, widths)
    bearing: DeadReckoning  # the heading, and headings that are known beforehand
    spot: PoseReckoning  # the pose, and poses that are known beforehand
    rate_hz: float  # samples per second
    baseline: float  # the robot's effective baseline [m]
    full_speed: float  # the robot's full speed [m/s]


def track_of(nominal: Mapping[str, float]) -> float:
    """Length [m] by which a yaw rate is the difference of two wheels' speeds; of a car between the rear ones."""
    if "effective_baseline" in nominal:
        return nominal["effective_baseline"]
    return nominal.get("wheel_distance", nominal["wheelbase"])


@dataclass(frozen=True)
class Learnt:
    """Adds to the twist the sum of curves over features of the twist that is asked for.

    It vanishes where the robot stands, and beyond what the fit saw it is what it is at the edge. Curves over commands
    are no motion: `commands` are an effect of their own.
    """

    seen: FittedRange
    curves: tuple[LearntCurve, ...]
    name: ClassVar[str] = "learnt"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    trace: ClassVar[Trace | None] = None

    @property
    def commands(self) -> LearntCommands:
        """The effect of the curves over commands."""
        return LearntCommands(tuple(curve for curve in self.curves if curve.group not in MOTION_GROUPS))

    @property
    def parts(self) -> tuple["LearntCommands | Learnt", ...]:
        """The effects that it takes: one that has no curves is none."""
        return (*([self.commands] if self.commands.curves else []), *([self] if self._of_motion else []))

    @property
    def _of_motion(self) -> list[LearntCurve]:
        return [curve for curve in self.curves if curve.group in MOTION_GROUPS]

    def begin(self, context: FilterContext) -> LearntState:
        """At rest, unused."""
        batch, nominal = np.shape(context.rest)[:-1], context.nominal
        return LearntState(
            seconds=np.zeros(batch),
            use=np.zeros(batch),
            slow=np.zeros((2, *batch, len(self._bands))),
            load=np.zeros((*batch, len(self._constants("load")))),
            rolled=np.zeros((3, *batch)),
            started=np.zeros((2, *batch)),
            last=np.zeros((2, *batch)),
            ring=np.zeros((2, *batch, len(self._constants("ringing"))), dtype=complex),
            dragged=np.zeros((2, *batch, len(self._constants("play")))),
            bearing=start_reckoning(context.headings, context),
            spot=start_poses(context),
            rate_hz=context.rate_hz,
            baseline=track_of(nominal),
            full_speed=nominal["full_speed"],
        )

    def apply(self, signal: Signal, memory: LearntState) -> tuple[Signal, LearntState]:
        """Add what the curves say."""
        asked, after = self._asked(signal, memory)
        moved = signal + self._added(asked, memory.baseline, of_pose=False)
        if self._constants(HEADING) or self._knows_places:
            moved, bearing, spot = self._bent(moved, asked, memory)
            after = after._replace(bearing=bearing, spot=spot)
        return moved, after

    def _bent(
        self, moved: Signal, asked: AskedMotion, memory: LearntState
    ) -> tuple[Signal, DeadReckoning, PoseReckoning]:
        """The motion with what depends on the pose: sample by sample where that leads to another pose."""
        bearing, spot, length = memory.bearing, memory.spot, moved.shape[-2]
        headings = MOTION_GROUPS[HEADING].channels
        turns = any(one.group == HEADING and headings[one.channel].to == "yaw" for one in self.curves)
        known = bearing.values.shape[-1] - bearing.next >= length or not turns
        there = not self._knows_places or spot.known.shape[-2] - spot.next >= length
        step, out = length if known and there else 1, []
        for begin in range(0, length, step):
            here = slice(begin, begin + step)
            course, _ = reckon(moved[..., here, 2], bearing)
            given = spot.known[..., spot.next : spot.next + step, :]
            poses = given if given.shape[-2] else spot.pose[..., None, :]
            now = asked._replace(
                forward=asked.forward[..., here], yaw=asked.yaw[..., here], heading=course, place=poses[..., :2]
            )
            out.append(moved[..., here, :] + self._added(now, memory.baseline, of_pose=True))
            _, bearing = reckon(out[-1][..., 2], bearing)
            last = pose_after(poses[..., -1, :], out[-1][..., -1, :] / memory.rate_hz)
            spot = spot._replace(next=spot.next + step, pose=last)
        return np.concatenate(out, axis=-2), bearing, spot

    @property
    def _bands(self) -> Knots:
        """The time constants of changes: both groups over them have the same."""
        return self._constants("transients") or self._constants("changes")

    def recall(
        self, context: FilterContext, whole: FilterContext, signal: Signal, row: Signal, sample: Signal
    ) -> LearntState:
        """The memory of windows (W, …) that begin at a sample (W,) of a row (W,) of longer signals (rows, time, 3)."""
        asked, _ = self._asked(signal, self.begin(whole))

        def before(values: Signal) -> Signal:
            return np.where((sample > 0).reshape(-1, *[1] * (values.ndim - 2)), values[row, sample - 1], 0.0)

        pairs = zip(asked.wheels, asked.bands, strict=True)
        slow = [wheel[..., None] - np.cumsum(band, axis=-1) for wheel, band in pairs]
        return self.begin(context)._replace(
            seconds=sample / context.rate_hz,
            use=before(asked.use),
            slow=np.stack([before(one) for one in slow]),
            load=before(asked.loads),
            rolled=np.stack([before(one) for one in asked.rolled]),
            started=np.stack([before(one) for one in asked.started]),
            last=np.stack([before(one) for one in asked.wheels]),
            ring=np.stack([before(one) for one in asked.rings]),
            dragged=np.stack([before(one) for one in asked.played]),
        )

    def features(self, signal: Signal, memory: LearntState) -> Iterator[tuple[Signal, Signal]]:
        """Features that weights scale, curve by curve: the features (…, time, knots) and the twist of one unit (3,).

        They are made as they are asked for: of long drives all together are large. The heading is taken from what is
        known beforehand and from the twist that is asked for.
        """
        asked, _ = self._asked(signal, memory)
        course, _ = reckon(signal[..., 2], memory.bearing)
        asked = asked._replace(heading=course, place=self._places(signal, course, memory.spot))
        for curve in self._of_motion:
            channel = MOTION_GROUPS[curve.group].channels[curve.channel]
            yield channel.basis(asked, curve.knots), _direction(channel.to, memory.baseline)

    def _places(self, signal: Signal, course: Signal, spot: PoseReckoning) -> Signal:
        """Places at the start of each sample (…, time, 2): known ones, and beyond them where the motion leads."""
        given = spot.known[..., spot.next : spot.next + signal.shape[-2], :]
        first = given if given.shape[-2] else spot.pose[..., None, :]
        beyond = slice(first.shape[-2] - 1, signal.shape[-2] - 1)
        ahead = course[..., beyond]
        origin = np.stack((np.zeros_like(ahead), np.zeros_like(ahead), ahead), axis=-1)
        way = pose_after(origin, signal[..., beyond, :] / spot.rate_hz)[..., :2]
        return np.concatenate((first[..., :2], first[..., -1:, :2] + way.cumsum(axis=-2)), axis=-2)

    def _added(self, asked: AskedMotion, baseline: float, *, of_pose: bool) -> Signal:
        added = np.zeros((*asked.forward.shape, 3))
        for curve in self._of_motion:
            if (curve.group in (HEADING, *OF_PLACE)) == of_pose:
                channel = MOTION_GROUPS[curve.group].channels[curve.channel]
                amount = channel.basis(asked, curve.knots) @ np.asarray(curve.weights)
                added += amount[..., None] * _direction(channel.to, baseline)
        return added

    @property
    def _knows_places(self) -> bool:
        return any(curve.group in OF_PLACE for curve in self.curves)

    def _constants(self, group: str) -> Knots:
        """The knots of a group, none where the effect has no such group."""
        return next((curve.knots for curve in self.curves if curve.group == group), ())

    def _asked(self, signal: Signal, past: LearntState) -> tuple[AskedMotion, LearntState]:
        """Motion asked for with its past, and the past of the next chunk; no heading yet."""
        forward, yaw = np.clip(signal[..., 0], *self.seen.forward), np.clip(signal[..., 2], *self.seen.yaw)
        turn = yaw * (past.baseline / 2.0)
        wheels = np.stack((forward - turn, forward + turn))
        effort = np.abs(wheels).mean(axis=0) / past.full_speed
        seconds = past.seconds[..., None] + np.arange(1, forward.shape[-1] + 1) / past.rate_hz
        use = past.use[..., None] + np.cumsum(effort, axis=-1) / (60.0 * past.rate_hz)
        slow = low_passes(wheels, past.slow, self._bands, past.rate_hz)
        load = low_passes(effort, past.load, self._constants("load"), past.rate_hz)
        bands = -np.diff(slow, axis=-1, prepend=wheels[..., None])
        rolled = rolled_since(np.stack((*wheels, forward)), past.rolled, past.rate_hz)
        started = moved_since(wheels, past.started, REST_SPEED, past.rate_hz)
        change = np.diff(wheels, axis=-1, prepend=past.last[..., None])
        ringing = rings(change, past.ring, self._constants("ringing"), past.rate_hz)
        played = play(wheels, past.dragged, self._constants("play"))
        after = past._replace(seconds=seconds[..., -1], use=use[..., -1], slow=slow[..., -1, :], load=load[..., -1, :])
        nowhere = (np.zeros_like(yaw), np.zeros((*yaw.shape, 2)))
        of_wheels = (bands, load, rolled, started, ringing, played)
        asked = AskedMotion(forward, yaw, wheels, seconds, use, *nowhere, *of_wheels)
        after = after._replace(rolled=rolled[..., -1], started=started[..., -1], last=wheels[..., -1])
        return asked, after._replace(ring=ringing[..., -1, :], dragged=played[..., -1, :])


def _direction(to: str, baseline: float) -> Signal:
    """The twist that a unit of forward, sideways, yaw, or of a wheel's speed makes (3,)."""
    wheel = {"left": (0.5, 0.0, -1.0 / baseline), "right": (0.5, 0.0, 1.0 / baseline)}
    body = {"forward": (1.0, 0.0, 0.0), "sideways": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
    return np.array({**wheel, **body}[to])


RANGE = "range"
"""The table of what the fit saw, beside those of the groups."""
LARGEST = 100.0
"""No weight is larger: a curve that adds 100 m/s is a slip of the pen."""
LABEL = "learnt from drives: not physics, and of no use beyond what they visited"


def is_learnt(name: str) -> bool:
    """Tell whether a name of θ belongs to the learnt effect."""
    return name.startswith(f"{Learnt.name}.")


def learnt_theta(effect: Learnt) -> dict[str, float]:
    """The values of a learnt effect by their names in θ: `learnt.GROUP.CHANNEL@KNOT`."""
    theta = {}
    for channel, bounds in zip(FittedRange._fields, effect.seen, strict=True):
        for end, value in zip(("low", "high"), bounds, strict=True):
            theta[f"{Learnt.name}.{RANGE}.{channel}@{end}"] = float(value)
    for curve in effect.curves:
        for knot, weight in zip(curve.knots, curve.weights, strict=True):
            at = ",".join(repr(float(part)) for part in (knot if isinstance(knot, tuple) else (knot,)))
            theta[f"{Learnt.name}.{curve.group}.{curve.channel}@{at}"] = float(weight)
    return theta


def learnt_effect(theta: Theta) -> Learnt | None:
    """The learnt effect that θ names, or None; a SettingsError if names or values do not make one."""
    named = {name: float(value) for name, value in theta.items() if is_learnt(name)}
    if not named:
        return None
    bounds: dict[str, float] = {}
    found: dict[tuple[str, str], dict[Knot, float]] = {}
    for name, value in named.items():
        group, channel, knot = _parts(name)
        if group == RANGE:
            bounds[f"{channel}@{knot}"] = value
        else:
            found.setdefault((group, channel), {})[_knot(name, knot)] = value
    ends = [bounds.get(f"{channel}@{end}", math.nan) for channel in FittedRange._fields for end in ("low", "high")]
    curves = [
        LearntCurve(group, channel, tuple(sorted(values)), tuple(values[knot] for knot in sorted(values)))
        for (group, channel), values in found.items()
    ]

    def problem(where: str, what: str) -> SettingsError:
        return SettingsError(f"{Learnt.name}.{where}: {what}")

    return _checked(FittedRange((ends[0], ends[1]), (ends[2], ends[3])), curves, problem)


def read_learnt(section: Section) -> dict[str, float]:
    """The values of the `[effects.learnt]` tables by their names in θ."""
    section.only((RANGE, *GROUPS))
    if not section.values:
        return {}
    ranges = section.section(RANGE)
    ranges.only(FittedRange._fields)
    seen = FittedRange(ranges.bounds("forward"), ranges.bounds("yaw"))
    curves = [curve for group in section.values if group != RANGE for curve in _read_group(section, group)]
    return learnt_theta(_checked(seen, curves, section.error))


def _read_group(section: Section, name: str) -> list[LearntCurve]:
    table = section.section(name)
    table.only(("knots", *GROUPS[name].channels))
    knots = tuple(_read_knot(table, value) for value in _list(table, "knots"))
    curves = []
    for channel in table.values:
        if channel != "knots":
            weights = [_number(table, channel, value) for value in _list(table, channel)]
            if len(weights) != len(knots):
                raise table.error(channel, f"must have one weight for each of {len(knots)} knots, got {len(weights)}")
            curves.append(LearntCurve(name, channel, knots, tuple(weights)))
    if not curves:
        raise table.error("knots", f"is alone; add weights for {' or '.join(GROUPS[name].channels)}")
    return curves


def _list(table: Section, key: str) -> list[object]:
    value = table.values.get(key)
    if not isinstance(value, list) or not value:
        raise table.error(key, f"must be a list of numbers, got {value!r}")
    return value


def _number(table: Section, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise table.error(key, f"must be a list of numbers, got {value!r} in it")
    return float(value)


def _read_knot(table: Section, value: object) -> Knot:
    if isinstance(value, list) and len(value) == 2:
        return _number(table, "knots", value[0]), _number(table, "knots", value[1])
    return _number(table, "knots", value)


def _checked(seen: FittedRange, curves: list[LearntCurve], problem: Callable[[str, str], SettingsError]) -> Learnt:
    """The effect, if its values make one."""
    for channel, (low, high) in zip(FittedRange._fields, seen, strict=True):
        if not (math.isfinite(low) and math.isfinite(high) and low <= 0.0 <= high):
            told = f"must be finite with 0 in it, got [{low:g}, {high:g}]; state what was seen"
            raise problem(f"{RANGE}.{channel}", told)
    for curve in curves:
        where, group = f"{curve.group}.{curve.channel}", GROUPS[curve.group]
        _check_knots(curve, f"{curve.group}.knots", group, problem)
        for weight in curve.weights:
            if not abs(weight) <= LARGEST:
                raise problem(where, f"weights must be between {-LARGEST:g} and {LARGEST:g}, got {weight:g}")
        other = next(one for one in curves if one.group == curve.group)
        if other.knots != curve.knots:
            raise problem(where, f"must have the same knots as {other.group}.{other.channel}: one weight for each")
    bands = {curve.knots for curve in curves if curve.group in ("transients", "changes")}
    if len(bands) > 1:
        raise problem("changes.knots", "must be those of transients")
    places = [(group, channel) for group, one in GROUPS.items() for channel in one.channels]
    return Learnt(seen, tuple(sorted(curves, key=lambda curve: places.index((curve.group, curve.channel)))))


def _check_knots(curve: LearntCurve, where: str, group: Group, problem: Callable[[str, str], SettingsError]) -> None:
    pairs = group.unit.count(",") == 1
    for knot in curve.knots:
        values = knot if isinstance(knot, tuple) else (knot,)
        if (len(values) == 2) != pairs:
            raise problem(where, f"must be {'pairs' if pairs else 'numbers'} [{group.unit}], got {list(values)}")
        if not all(map(math.isfinite, values)):
            raise problem(where, "must be finite")
        if not any(values):
            raise problem(where, "0 is no knot: nothing is added there; take it out")
        if group.low is not None and min(values) < group.low:
            raise problem(where, f"must be at least {group.low:g} {group.unit}, got {min(values):g}")
    if list(curve.knots) != sorted(set(curve.knots)):
        raise problem(where, "must be in ascending order, each once")


def learnt_text(theta: Theta) -> str:
    """The `[effects.learnt.GROUP]` tables that read back as the learnt effect of this θ, empty where it has none."""
    effect = learnt_effect(theta)
    if effect is None:
        return ""
    lines = [f"\n# {LABEL}", f"[effects.{Learnt.name}.{RANGE}]"]
    ranges = zip(FittedRange._fields, effect.seen, strict=True)
    lines += [f"{channel} = [{low!r}, {high!r}]" for channel, (low, high) in ranges]
    for group in dict.fromkeys(curve.group for curve in effect.curves):
        curves = [curve for curve in effect.curves if curve.group == group]
        lines += [
            f"\n[effects.{Learnt.name}.{group}]  # {GROUPS[group].title}",
            _row("knots", curves[0].knots, GROUPS[group].unit),
        ]
        lines += [_row(curve.channel, curve.weights, GROUPS[group].channels[curve.channel].unit) for curve in curves]
    return "\n".join(lines) + "\n"


def _row(key: str, values: Knots, unit: str) -> str:
    return f"{key} = [{', '.join(repr(list(v) if isinstance(v, tuple) else v) for v in values)}]  # {unit}"


def _parts(name: str) -> tuple[str, str, str]:
    """Group, channel and knot of a name in θ."""
    head, _, knot = name.partition("@")
    words = head.split(".")
    channels: Mapping[str, object] = {}
    if len(words) == 3 and (words[1] in GROUPS or words[1] == RANGE):
        channels = GROUPS[words[1]].channels if words[1] in GROUPS else {**dict.fromkeys(FittedRange._fields)}
    if len(words) != 3 or words[2] not in channels or not knot:
        known = [f"{Learnt.name}.{group}.{channel}@KNOT" for group, one in GROUPS.items() for channel in one.channels]
        raise SettingsError(f"{name}: no group of the learnt effect has this name; {nearest(name, known)}")
    return words[1], words[2], knot


def _knot(name: str, text: str) -> Knot:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise SettingsError(f"{name}: '{text}' is no knot; write a number, or two with a comma") from None
    return (values[0], values[1]) if len(values) == 2 else values[0]
