"""Measured drives as arrays: commands on a fine grid of ticks, and motion between measured poses.

`robot_of` finds the robot that drove a log, `gather` makes one batch of `Drives` of its episodes: every command is a
fraction of full speed, held from its own time until the next (zero-order hold) and averaged over ticks; two measured
poses in a row make an increment of N in all, in the body frame of the first. A pose may have been measured between two
samples: paths are then read at that instant. Drives carry the rules that a diagnosis of them goes by.
"""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.signal import lfilter

from proxytune.diagnosis.answer import RULES, Rules
from proxytune.driving import Robot, is_robot, read_robot, robot_from_geometry, robot_names
from proxytune.effects import SHIPPED, Catalogue, track_of
from proxytune.errors import LogError
from proxytune.logs import Log, LogEpisode, check_kind, rows_of_poses, without_outliers
from proxytune.settings import GEOMETRY, nearest


def cosine_and_sine(angle: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The cosine and the sine of angles (…,) [rad]."""
    # Of the tangent numpy has a fast form on many processors, of cosine and sine none.
    tangent = np.tan(0.5 * angle)
    square = tangent * tangent
    share = 1.0 / (1.0 + square)
    return (1.0 - square) * share, 2.0 * tangent * share


Result = TypeVar("Result")

MOST = 6
"""So many results are kept: those of long drives are large, and what is asked for again is asked for soon."""


class Recent(Generic[Result]):
    """The latest few results: what is asked for again is not worked out again."""

    def __init__(self, most: int = MOST) -> None:
        self._known: dict[Hashable, Result] = {}
        self._most = most

    def get(self, key: Hashable, make: Callable[[], Result]) -> Result:
        """The result of a key, made if it is not kept; the one asked for longest ago is forgotten."""
        result = self._known.pop(key) if key in self._known else make()
        self._known[key] = result
        if len(self._known) > self._most:
            del self._known[next(iter(self._known))]
        return result


SEVERAL = 40
"""So many are kept of what is small: windows without each fold, of each length, with each effect and without."""

Floats = NDArray[Any]


def duties_of(log: Log, robot: Robot, commands: Floats) -> Floats:
    """A log's commands (…, 2) as fractions of full wheel speed, left and right; of a car as throttle and steering.

    Refused if it has none, they are not of such a robot, or they ask for more than it can.
    """
    figures = robot.figures
    if log.command == "none":
        raise LogError(f"{log.name}: has no commands; a log needs duties, twists or wheel speeds to learn from")
    check_kind(log.command, robot.name, robot.drive, log.name)
    if log.command in ("duty", "ackermann"):
        return commands
    if robot.drive == "ackermann":
        return _steered(log, robot, commands)
    if log.command == "twist":
        turn = commands[..., 1] * figures["effective_baseline"] / 2.0
        speeds = np.stack((commands[..., 0] - turn, commands[..., 0] + turn), axis=-1)
    else:
        speeds = commands * figures["wheel_radius"]
    duties = speeds / figures["full_speed"]
    fastest, full = float(np.abs(duties).max()), figures["full_speed"]
    if fastest > 1.0 + 1e-9:
        problem = f"asks a wheel for {fastest * full:.2f} m/s, more than the robot's full speed {full:g} m/s"
        remedy = "state a higher full_speed in its robot.toml, or full_speed_m_s in log.toml where it has none"
        raise LogError(f"{log.name}: {problem}; {remedy}")
    return np.asarray(duties)


def _steered(log: Log, robot: Robot, commands: Floats) -> Floats:
    """Speeds with wheel angles, or twists (…, 2), as a car's throttle and steering; refused beyond full speed."""
    figures, speeds, angles = robot.figures, commands[..., 0], commands[..., 1]
    if log.command == "twist":
        with np.errstate(divide="ignore", invalid="ignore"):
            angles = np.arctan(np.where(commands[..., 1] == 0.0, 0.0, figures["wheelbase"] * commands[..., 1] / speeds))
    fastest, full, widest = float(np.abs(speeds).max()), figures["full_speed"], math.radians(figures["wheel_angle"])
    if fastest > full * (1.0 + 1e-9):
        problem = f"asks for {fastest:.2f} m/s, more than the full speed {full:g} m/s of robot '{robot.name}'"
        raise LogError(f"{log.name}: {problem}; state a higher full_speed in its robot.toml")
    return np.stack((speeds / full, np.clip(angles / widest, -1.0, 1.0)), axis=-1)


def commands_as(kind: str, robot: Robot, duties: Floats) -> Floats:
    """Fractions of full wheel speed (…, 2), of a car throttle and steering, as a log's kind of commands (…, 2)."""
    if kind in ("duty", "ackermann"):
        return duties
    figures, speeds = robot.figures, duties * robot.figures["full_speed"]
    if robot.drive == "ackermann":
        speed, angle = speeds[..., 0], duties[..., 1] * math.radians(figures["wheel_angle"])
        if kind == "twist":
            return np.stack((speed, speed * np.tan(angle) / figures["wheelbase"]), axis=-1)
        return np.stack((speed, angle), axis=-1)
    if kind == "wheel_speed":
        return np.asarray(speeds / figures["wheel_radius"])
    return np.stack((speeds.mean(axis=-1), np.diff(speeds)[..., 0] / figures["effective_baseline"]), axis=-1)


class Commands(NamedTuple):
    """An episode's commands (M, 2), as fractions of full speed."""

    times: Floats  # from the first tick on [s]
    duties: Floats
    rest: Floats  # what was in force before the first tick
    ticks_each: int  # how long each lasts where commands go with the samples, else 0

    def over_ticks(self, length: int, tick_hz: float) -> Floats:
        """The mean of the command in force over each tick (length, 2); each is held from its own time."""
        if self.ticks_each:
            lead = round(self.times[0] * tick_hz)
            return np.concatenate((np.tile(self.rest, (lead, 1)), _hold(self.duties, self.ticks_each, length - lead)))
        ends = np.array((min(0.0, self.times[0]) - 1.0, *self.times, max(length / tick_hz, self.times[-1]) + 1.0))
        held = np.concatenate((self.rest[None], self.duties))
        total = np.concatenate((np.zeros((1, 2)), np.cumsum(held * np.diff(ends)[:, None], axis=0)))
        edges = np.arange(length + 1) / tick_hz
        gone = np.stack([np.interp(edges, ends, channel) for channel in total.T], axis=1)
        return np.asarray(np.diff(gone, axis=0) * tick_hz)

    def ticks(self, length: int, tick_hz: float) -> NDArray[np.bool_]:
        """The ticks within which one is issued (length,)."""
        at = np.floor(self.times * tick_hz + 1e-6).astype(int)
        found = np.zeros(length, dtype=bool)
        found[at[(at >= 0) & (at < length)]] = True
        return found


LEAD_S = 1.0
"""Commands are followed from so long before the first pose; what was in force then is taken to have been for ever."""


def _lead(episode: LogEpisode, rate_hz: float) -> int:
    """Samples before the first pose over which commands are followed that were sent then."""
    if episode.issued is None:
        return 0
    ahead = episode.times[0] - episode.issued
    return math.ceil(float(np.max(ahead, where=ahead <= LEAD_S, initial=0.0)) * rate_hz - 1e-6)


def commands_of(log: Log, robot: Robot, episode: LogEpisode, ticks: int, lead_s: float) -> Commands:
    """An episode's commands; `ticks` are a sample's, and the first is so long before the first sample.

    Refused if it has none, or they ask for more than full speed.
    """
    duties, rest = duties_of(log, robot, episode.commands), np.zeros(2)
    if episode.wheels is not None and robot.drive == "differential" and np.isfinite(episode.wheels[0]).all():
        rest = np.asarray(episode.wheels[0] * robot.figures["wheel_radius"] / robot.figures["full_speed"])
    if episode.issued is None:
        return Commands(np.arange(len(duties)) / log.rate_hz + lead_s, duties, rest, ticks)
    times = episode.issued - episode.times[0] + lead_s
    before = np.flatnonzero(times < -1e-9)
    return Commands(times, duties, duties[before[-1]] if len(before) and episode.wheels is None else rest, 0)


Whole = NDArray[Any]


def rows_at(signals: Floats, row: Whole, sample: Whole) -> Floats:
    """Samples (…, channels) of signals (P, T, channels); a fifth of the time that indices side by side take."""
    return np.asarray(signals.reshape(-1, signals.shape[-1]).take(row * signals.shape[1] + sample, axis=0))


def path_between(walked: Floats, path: Whole, tick: Floats) -> Floats:
    """Paths (P, T + 1, 3) at ticks that need not be whole (M,), straight between them."""
    low = np.clip(np.floor(tick).astype(int), 0, walked.shape[1] - 2)
    share = (tick - low)[..., None]
    return np.asarray((1.0 - share) * rows_at(walked, path, low) + share * rows_at(walked, path, low + 1))


def as_measured(episode: LogEpisode) -> tuple[Floats, Floats]:
    """The poses of an episode's samples as they were measured (rows, 3), and how long after them (rows,) [s]."""
    poses, after = episode.poses, np.zeros(len(episode.times))
    if episode.measured is not None:
        times, own, rows = episode.measured
        poses = np.full_like(episode.poses, np.nan)
        poses[rows], after[rows] = own, times - episode.times[rows]
    return poses, after


def ends_of(episodes: Sequence[LogEpisode], samples: Sequence[Whole]) -> tuple[Floats, Floats]:
    """Poses as measured between which increments lie (N, 2, 3), and how long after their samples [s]; by each drive."""
    measured = [as_measured(episode) for episode in episodes]
    poses, after = (
        np.concatenate([np.stack((e[part][s[:-1]], e[part][s[1:]]), 1) for e, s in zip(measured, samples, strict=True)])
        for part in (0, 1)
    )
    return poses, after


TICK_HZ = 60.0
"""Effects are simulated at least this often."""
SLACK = 0.05
"""A car's measured rate may fall short of that by this share."""
GAP_S = 1.0
"""Over longer gaps in the measured poses no motion is compared."""


@dataclass(frozen=True)
class Drives:
    """A batch of E episodes with N measured increments of the pose."""

    robot: Robot  # whose drives they are
    tick_hz: float  # ticks per second
    rate_hz: float  # commands per second
    duties: Floats  # commands as fractions of full speed (E, T, 2), each the mean over its tick
    issued: NDArray[np.bool_]  # whether a command is issued within each tick (E, T)
    rest: Floats  # duties before the first row (E, 2): what was sent, or wheel speeds of a drive that begins in motion
    headings: Floats  # measured heading at the start of each tick, interpolated (E, T)
    episode: Whole  # episode of each increment (N,)
    first: Whole  # tick at which it begins (N,)
    last: Whole  # tick at which it ends (N,)
    poses: Floats  # measured poses at its beginning and end (N, 2, 3)
    linked: NDArray[np.bool_]  # whether it begins with the sample that ended the one before (N,)
    block: Whole  # which of the blocks, the units that are left out in turn, it belongs to (N,)
    travel: Floats  # how far the robot moved meanwhile, noise averaged out (N, 2): [m], [rad]
    wheels: Floats | None  # measured wheel speeds at each tick as fractions of full speed (E, T, 2), or None
    # how long after the ticks `first` and `last` its poses were measured, or before (N, 2) [ticks]; None where
    # poses lie on ticks
    after: Floats | None = None
    lead: int = 0  # tick at which the first sample was measured: commands before it act on it
    rules: Rules = RULES  # of a diagnosis of them
    # where values of effects are looked for, by name in θ, if not in their usual ranges
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, Any]:
        """All but what is only remembered, so that drives in wider ranges can be kept as a stage."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @cached_property
    def measured(self) -> Floats:
        """Each increment in the body frame of its first pose (N, 3): forward, left [m], turn [rad]."""
        return relative(self.poses[:, 0], self.poses[:, 1])

    @cached_property
    def _recent(self) -> dict[str, Recent[Any]]:
        return {}

    def remember(self, kind: str, key: Hashable, make: Callable[[], Result], most: int = MOST) -> Result:
        """What models made of these drives lately: the one of this kind and key, made if it is not kept."""
        found: Result = self._recent.setdefault(kind, Recent(most)).get(key, make)
        return found

    @cached_property
    def places(self) -> Floats:
        """Measured place at the start of each tick (E, T, 2) [m], interpolated."""
        return self._interpolated(self.poses[:, 0, :2])

    @cached_property
    def angles(self) -> Floats:
        """Angles by which each wheel has turned in its episode (E, T, 2) [rad], measured or by the measured motion."""
        if self.wheels is not None:
            steps = self.wheels * self.robot.figures["full_speed"] / self.robot.figures["wheel_radius"] / self.tick_hz
            return np.asarray(np.cumsum(steps, axis=1) - steps)
        turn = self.measured[:, 2] * track_of(self.robot.figures) / 2.0
        forward = self.measured[:, 0]
        wheels = np.stack((forward - turn, forward + turn), axis=1) / self.robot.figures["wheel_radius"]
        before = np.cumsum(wheels, axis=0) - wheels
        return self._interpolated(before - before[np.searchsorted(self.episode, self.episode)])

    def _interpolated(self, values: Floats) -> Floats:
        """Values at the beginnings of the increments (N, channels) at every tick (E, T, channels)."""
        out = np.zeros((*self.duties.shape[:2], values.shape[1]))
        for episode in np.unique(self.episode):
            own = self.episode == episode
            for channel, column in enumerate(values[own].T):
                out[episode, :, channel] = np.interp(np.arange(out.shape[1]), self.first[own], column)
        return out

    @property
    def seconds(self) -> float:
        """Seconds that the increments last together."""
        return float((self.last - self.first).sum() / self.tick_hz)

    def along(self, walked: Floats, path: Whole, increment: Whole, begin: Whole | int = 0, *, end: bool) -> Floats:
        """Read paths (P, T + 1, 3) when the poses at beginnings or ends of increments (M,) were measured: (M, 3).

        `path` is that of each increment (M,), which begins at this tick (M,).
        """
        tick = (self.last if end else self.first)[increment] - begin
        if self.after is None:
            return rows_at(walked, path, tick)
        return path_between(walked, path, tick + self.after[increment, int(end)])

    def only(self, chosen: NDArray[np.bool_]) -> "Drives":
        """Keep some of their increments."""
        kept = np.flatnonzero(chosen)
        follows = np.concatenate(([False], np.diff(kept) == 1))
        _, block = np.unique(self.block[kept], return_inverse=True)
        parts = {name: getattr(self, name)[kept] for name in ("episode", "first", "last", "poses", "travel")}
        after = None if self.after is None else self.after[kept]
        return replace(self, **parts, linked=self.linked[kept] & follows, block=block, after=after)

    def some(self, episodes: Whole) -> "Drives":
        """Keep some of their episodes (K,), in ascending order, numbered anew."""
        rest = self.only(np.isin(self.episode, episodes))
        parts = {name: getattr(self, name)[episodes] for name in ("duties", "issued", "rest", "headings")}
        wheels = None if self.wheels is None else self.wheels[episodes]
        return replace(rest, **parts, wheels=wheels, episode=np.searchsorted(episodes, rest.episode))


def lagged(signal: Floats, ticks: float) -> Floats:
    """Signals (episodes, ticks, …) after a first-order lag of so many ticks, steady before they begin."""
    kept = float(np.exp(-1.0 / ticks)) if ticks > 0.0 else 0.0
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], signal, axis=1, zi=kept * signal[:, :1])[0])


def relative(origin: Floats, pose: Floats) -> Floats:
    """Poses (…, 3) seen from the frame of others."""
    difference = pose - origin
    cosine, sine = cosine_and_sine(origin[..., 2])
    forward = cosine * difference[..., 0] + sine * difference[..., 1]
    left = cosine * difference[..., 1] - sine * difference[..., 0]
    return np.stack((forward, left, difference[..., 2]), axis=-1)


def gather(log: Log, robot: Robot, episodes: Sequence[LogEpisode], *, compared: bool = True) -> Drives:
    """A batch of a log's episodes without poses that lie off the way for a sample or two; `compared` ones must move."""
    episodes = [without_outliers(episode) for episode in episodes]
    # A measured rate of 59.9998 Hz is 60 Hz: twice the ticks would tell nothing more. Published results of robots on
    # two wheels were got without slack, and stay what they are.
    slack = SLACK if robot.drive == "ackermann" else 0.0
    ticks = math.ceil(TICK_HZ / log.rate_hz - slack)
    tick_hz = log.rate_hz * ticks
    measured = any(episode.wheels is not None for episode in episodes)  # which tell how fast wheels turn at first
    early = 0 if measured else max(_lead(episode, log.rate_hz) for episode in episodes)
    lead, length = early * ticks, (early + max(len(episode.times) for episode in episodes)) * ticks
    samples = rows_of_poses(log, episodes)
    lead_s = early / log.rate_hz
    given = [commands_of(log, robot, episode, ticks, lead_s) for episode in episodes]
    rests = [_at_start(one, lead_s, e, s, robot) for one, e, s in zip(given, episodes, samples, strict=True)]
    given = [one._replace(rest=rest) for one, rest in zip(given, rests, strict=True)]
    rows = np.concatenate([np.stack((s[:-1], s[1:]), axis=1) for s in samples])
    number = np.repeat(np.arange(len(episodes)), [max(0, len(s) - 1) for s in samples])
    if compared and len(rows) == 0:
        raise LogError(f"{log.name}: no two measured poses in a row; nothing can be learnt from it")
    poses, after = ends_of(episodes, samples)
    # Commands come with the samples, or at times of their own.
    between = [np.diff(e.issued) for e in episodes if e.issued is not None and len(e.issued) > 1]
    linked = np.concatenate(([False], (number[1:] == number[:-1]) & (rows[1:, 0] == rows[:-1, 1])))[: len(rows)]
    drives = Drives(
        robot=robot,
        tick_hz=tick_hz,
        rate_hz=1.0 / float(np.median(np.concatenate(between))) if between else log.rate_hz,
        duties=np.stack([one.over_ticks(length, tick_hz) for one in given]),
        issued=np.stack([one.ticks(length, tick_hz) for one in given]),
        rest=np.stack([one.rest for one in given]),
        headings=np.stack([_ticks_of_heading(e, ticks, lead, length) for e in episodes]),
        episode=number,
        first=rows[:, 0] * ticks + lead,
        last=rows[:, 1] * ticks + lead,
        poses=poses,
        linked=linked,
        block=number,
        travel=_travel(number, poses, rows, log.rate_hz),
        wheels=_wheels(robot, episodes, ticks, length),
        after=after * tick_hz if after.any() else None,
        lead=lead,
    )
    return drives.only(rows[:, 1] - rows[:, 0] <= GAP_S * log.rate_hz)


BEGINNING_S = 0.15
"""The first instants of a drive: long enough to see its speed, too short for a robot at rest to reach it."""
IN_MOTION, STEADY = 0.15, 0.75
"""A drive begins in motion if its wheels go faster than this share of full speed, and than this share of later on."""


def _at_start(given: Commands, lead_s: float, episode: LogEpisode, samples: Whole, robot: Robot) -> Floats:
    """Duties before the first tick (2,): known ones, or of a drive that begins in motion its speeds as such."""
    times = episode.times[samples] - episode.times[0]
    at = np.searchsorted(times, np.arange(4) * BEGINNING_S - 1e-9)
    if given.rest.any() or episode.wheels is not None or at[-1] >= len(samples) or samples[0] != 0:
        return given.rest
    if np.diff(times[at]).min() <= 0.0:
        return given.rest
    poses, figures = episode.poses[samples[at]], robot.figures
    moved = relative(poses[::2], poses[1::2]) / np.diff(times[at])[::2, None]
    if robot.drive == "ackermann":  # its speed alone does not tell its wheels' angle: they are where they are sent
        sent = np.flatnonzero(given.times <= lead_s + 1e-9)
        first, later = np.abs(moved[:, 0]) / figures["full_speed"]
        if not len(sent) or first <= max(IN_MOTION, STEADY * later):
            return given.rest
        return np.array((np.clip(moved[0, 0] / figures["full_speed"], -1.0, 1.0), given.duties[sent[-1], 1]))
    turn = moved[:, 2] * figures["effective_baseline"] / 2.0
    first, later = np.stack((moved[:, 0] - turn, moved[:, 0] + turn), axis=1) / figures["full_speed"]
    in_motion = float(np.abs(first).max()) > max(IN_MOTION, STEADY * float(np.abs(later).max()))
    return np.clip(first, -1.0, 1.0) if in_motion else given.rest


def _hold(rows: Floats, ticks: int, length: int) -> Floats:
    """Hold rows for some ticks each, the last one until the end."""
    held = np.repeat(rows, ticks, axis=0)
    return np.concatenate((held, np.repeat(held[-1:], length - len(held), axis=0)))


def _wheels(robot: Robot, episodes: Sequence[LogEpisode], ticks: int, length: int) -> Floats | None:
    unit = robot.figures["wheel_radius"] / robot.figures["full_speed"]
    known = (e.wheels for e in episodes if robot.drive == "differential")
    measured = [_hold(wheels * unit, ticks, length) for wheels in known if wheels is not None]
    whole = len(measured) == len(episodes) and all(np.isfinite(wheels).all() for wheels in measured)
    return np.stack(measured) if whole else None


def _ticks_of_heading(episode: LogEpisode, ticks: int, lead: int, length: int) -> Floats:
    known = np.flatnonzero(np.isfinite(episode.poses[:, 2]))
    if len(known) == 0:
        return np.zeros(length)
    return np.asarray(np.interp(np.arange(length), known * ticks + lead, episode.poses[known, 2]))


def _travel(number: Whole, poses: Floats, rows: Whole, rate_hz: float) -> Floats:
    """The way of each increment, from the chord over half a second round it."""
    if len(rows) == 0:
        return np.zeros((0, 2))
    reach = max(1, round(0.25 * rate_hz / max(1.0, float(np.median(rows[:, 1] - rows[:, 0])))))
    index = np.arange(len(rows))
    ends = np.concatenate((np.flatnonzero(np.diff(number)), [len(rows) - 1]))
    begins = np.concatenate(([0], ends[:-1] + 1))
    low = np.maximum(index - reach, begins[number_of(number)])
    high = np.minimum(index + reach, ends[number_of(number)])
    chord = poses[high, 1] - poses[low, 0]
    share = (rows[:, 1] - rows[:, 0]) / np.maximum(1, rows[high, 1] - rows[low, 0])
    return np.stack((np.hypot(chord[:, 0], chord[:, 1]) * share, np.abs(chord[:, 2]) * share), axis=1)


def sum_by(labels: Whole, values: Floats, count: int, weights: Floats | None = None) -> Floats:
    """Sums of values (M, …), weighted (M,), over those with one label each (count, …); no label is below 0."""
    own = labels >= 0
    share = np.ones(own.sum()) if weights is None else weights[own]
    rows = sparse.csc_array((share, labels[own], np.append(0, np.cumsum(own))), shape=(count, len(labels)))
    return np.asarray(rows @ values.reshape(len(values), -1)).reshape(count, *values.shape[1:])


def number_of(labels: Whole) -> Whole:
    """Labels that come in runs, as the number of their run."""
    return np.concatenate(([0], np.cumsum(labels[1:] != labels[:-1])))


NEEDED = {figure: key for key, figure in GEOMETRY.items() if figure != "full_speed"}
"""Figures that a log must state of a robot without a folder, and their keys in log.toml."""


def robot_of(log: Log, name: str | None = None, catalogue: Catalogue = SHIPPED) -> Robot:
    """The robot of a log, or the named one in its stead, with the effects that it may have.

    A robot without a folder needs wheel radius and baseline in log.toml; its full speed is stated there too, or taken
    from the fastest command, or from how fast it drove.

    Raises:
        LogError: If the robot is unknown and the log does not state its geometry.
        SettingsError: If the named robot is unknown.
    """
    if is_robot(log.robot, catalogue.folder) or name not in (None, log.robot):
        robot = read_robot(name or log.robot, catalogue.folder)
        return replace(robot, catalogue=replace(catalogue, drive=robot.drive))
    if missing := [key for figure, key in NEEDED.items() if figure not in log.geometry]:
        unknown = f"{log.name}: robot '{log.robot}' is unknown ({nearest(log.robot, robot_names(catalogue.folder))})"
        lacks = f"log.toml does not state {' and '.join(missing)}"
        raise LogError(f"{unknown} and {lacks}; state them, or name a robot with --robot")
    geometry = {**log.geometry}
    geometry.setdefault("full_speed", _full_speed(log))
    return replace(robot_from_geometry(log.robot, geometry, log.rate_hz), catalogue=catalogue)


def _full_speed(log: Log) -> float:
    """The wheel speed [m/s] that a duty of 1 stands for, rounded up to two digits."""
    commands = np.concatenate([episode.commands for episode in log.episodes])
    if log.command == "twist":
        fastest = np.abs(commands[:, 0]) + np.abs(commands[:, 1]) * log.geometry["effective_baseline"] / 2.0
    elif log.command == "wheel_speed":
        fastest = np.abs(commands).max(axis=1) * log.geometry["wheel_radius"]
    else:
        fastest = _speed_per_duty(log)
    digit = 10.0 ** (np.floor(np.log10(max(float(fastest.max(initial=0.0)), 1e-3))) - 1)
    return float(np.ceil(float(fastest.max(initial=1e-3)) / digit - 1e-9) * digit)


def _speed_per_duty(log: Log) -> Floats:
    """Metres a second that the robot drove per unit of duty, over all drives together (1,)."""
    every = max(1, round(log.rate_hz / 2.0))
    way = duty = 0.0
    for episode in log.episodes:
        places = episode.poses[::every, :2]
        known = np.flatnonzero(np.isfinite(places).all(axis=1))
        if len(known) > 1:
            between = slice(known[0] * every, known[-1] * every)
            way += float(np.hypot(*np.diff(places[known], axis=0).T).sum())
            duty += float(np.abs(episode.held[between].mean(axis=1)).sum()) / log.rate_hz
    return np.array([way / duty if duty > 0.0 else 1e-3])
