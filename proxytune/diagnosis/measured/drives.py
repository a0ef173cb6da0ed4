"""Measured drives as arrays: commands on a fine grid of ticks, motion between measured poses."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from proxytune.diagnosis.measured.angles import cosine_and_sine
from proxytune.diagnosis.measured.commands import commands_a_second, commands_of
from proxytune.diagnosis.measured.instants import ends_of, path_between
from proxytune.diagnosis.measured.recent import Recent
from proxytune.driving.robot import Robot
from proxytune.errors import LogError
from proxytune.logs import Log, LogEpisode

TICK_HZ = 60.0
"""Effects are simulated at least this often."""

HELD_S = 0.2
"""A pose that repeats exactly for up to so long is an older one shown again."""

GAP_S = 1.0
"""Over longer gaps in the measured poses no motion is compared."""

Floats = NDArray[Any]
Whole = NDArray[Any]


@dataclass(frozen=True)
class Drives:
    """A batch of E episodes with N measured increments of the pose.

    Attributes:
        robot: Whose drives they are.
        tick_hz: Ticks per second.
        rate_hz: Commands per second.
        duties: Commands as fractions of full speed (E, T, 2), each the mean over its tick.
        issued: Whether a command is issued within each tick (E, T).
        rest: Duties before the first row (E, 2).
        headings: Measured heading at the start of each tick, interpolated (E, T).
        episode: Episode of each increment (N,).
        first: Tick at which it begins (N,).
        last: Tick at which it ends (N,).
        poses: Measured poses at its beginning and end (N, 2, 3).
        linked: Whether it begins with the sample that ended the one before (N,).
        block: Which of the blocks, the units that are left out in turn, it belongs to (N,).
        travel: How far the robot moved meanwhile, noise averaged out (N, 2): [m], [rad].
        wheels: Measured wheel speeds at each tick as fractions of full speed (E, T, 2), or None.
        after: How long after the ticks `first` and `last` its poses were measured, or before (N, 2) [ticks]; None
            where poses lie on ticks.
    """

    robot: Robot
    tick_hz: float
    rate_hz: float
    duties: Floats
    issued: NDArray[np.bool_]
    rest: Floats
    headings: Floats
    episode: Whole
    first: Whole
    last: Whole
    poses: Floats
    linked: NDArray[np.bool_]
    block: Whole
    travel: Floats
    wheels: Floats | None
    after: Floats | None = None

    @cached_property
    def measured(self) -> Floats:
        """Each increment in the body frame of its first pose (N, 3): forward, left [m], turn [rad]."""
        return relative(self.poses[:, 0], self.poses[:, 1])

    @cached_property
    def replays(self) -> Recent[Floats]:
        """The increments (N, 3) that models made of these drives lately."""
        return Recent()

    @cached_property
    def places(self) -> Floats:
        """Measured place at the start of each tick (E, T, 2) [m], interpolated."""
        return self._interpolated(self.poses[:, 0, :2])

    @cached_property
    def angles(self) -> Floats:
        """How far each wheel has turned in its episode by the measured motion (E, T, 2) [rad], interpolated."""
        figures = self.robot.figures
        turn = self.measured[:, 2] * figures["effective_baseline"] / 2.0
        wheels = np.stack((self.measured[:, 0] - turn, self.measured[:, 0] + turn), axis=1) / figures["wheel_radius"]
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
        """How long the increments last together [s]."""
        return float((self.last - self.first).sum() / self.tick_hz)

    def along(self, walked: Floats, path: Whole, increment: Whole, begin: Whole | int = 0, *, end: bool) -> Floats:
        """Where paths (P, T + 1, 3) are when the poses of increments were measured (M, 3).

        Args:
            walked: Paths by their ticks.
            path: Which path each increment belongs to (M,).
            increment: The increments (M,).
            begin: The tick at which its path begins (M,).
            end: Whether it is the pose at the increment's end.
        """
        tick = (self.last if end else self.first)[increment] - begin
        if self.after is None:
            return np.asarray(walked[path, tick])
        return path_between(walked, path, tick + self.after[increment, int(end)])

    def only(self, chosen: NDArray[np.bool_]) -> "Drives":
        """The same drives with some of their increments."""
        kept = np.flatnonzero(chosen)
        follows = np.concatenate(([False], np.diff(kept) == 1))
        _, block = np.unique(self.block[kept], return_inverse=True)
        parts = {name: getattr(self, name)[kept] for name in ("episode", "first", "last", "poses", "travel")}
        after = None if self.after is None else self.after[kept]
        return replace(self, **parts, linked=self.linked[kept] & follows, block=block, after=after)

    def some(self, episodes: Whole) -> "Drives":
        """The same drives with some of their episodes (K,), in ascending order, numbered anew."""
        rest = self.only(np.isin(self.episode, episodes))
        parts = {name: getattr(self, name)[episodes] for name in ("duties", "issued", "rest", "headings")}
        wheels = None if self.wheels is None else self.wheels[episodes]
        return replace(rest, **parts, wheels=wheels, episode=np.searchsorted(episodes, rest.episode))


def relative(origin: Floats, pose: Floats) -> Floats:
    """Poses (…, 3) seen from the frame of others."""
    difference = pose - origin
    cosine, sine = cosine_and_sine(origin[..., 2])
    forward = cosine * difference[..., 0] + sine * difference[..., 1]
    left = cosine * difference[..., 1] - sine * difference[..., 0]
    return np.stack((forward, left, difference[..., 2]), axis=-1)


def gather(log: Log, robot: Robot, episodes: Sequence[LogEpisode]) -> Drives:
    """A batch of a log's episodes, each command held from its own time.

    Raises:
        LogError: If there is nothing to compare in them.
    """
    ticks = math.ceil(TICK_HZ / log.rate_hz)
    length = max(len(episode.times) for episode in episodes) * ticks
    tick_hz = log.rate_hz * ticks
    given = [commands_of(log, robot, episode, ticks) for episode in episodes]
    samples = [_samples(episode, log.rate_hz) for episode in episodes]
    rows = np.concatenate([np.stack((s[:-1], s[1:]), axis=1) for s in samples])
    number = np.repeat(np.arange(len(episodes)), [max(0, len(s) - 1) for s in samples])
    if len(rows) == 0:
        raise LogError(f"{log.name}: no two measured poses in a row; nothing can be learnt from it")
    poses, after = ends_of(episodes, samples)
    linked = np.concatenate(([False], (number[1:] == number[:-1]) & (rows[1:, 0] == rows[:-1, 1])))
    drives = Drives(
        robot=robot,
        tick_hz=tick_hz,
        rate_hz=commands_a_second(log, episodes),
        duties=np.stack([one.over_ticks(length, tick_hz) for one in given]),
        issued=np.stack([one.ticks(length, tick_hz) for one in given]),
        rest=np.stack([one.rest for one in given]),
        headings=np.stack([_ticks_of_heading(e, ticks, length) for e in episodes]),
        episode=number,
        first=rows[:, 0] * ticks,
        last=rows[:, 1] * ticks,
        poses=poses,
        linked=linked,
        block=number,
        travel=_travel(number, poses, rows, log.rate_hz),
        wheels=_wheels(robot, episodes, ticks, length),
        after=after * tick_hz if after.any() else None,
    )
    return drives.only(rows[:, 1] - rows[:, 0] <= GAP_S * log.rate_hz)


def _ticks(rows: Floats, ticks: int, length: int) -> Floats:
    """Rows held for some ticks each, the last one until the end."""
    held = np.repeat(rows, ticks, axis=0)
    return np.concatenate((held, np.repeat(held[-1:], length - len(held), axis=0)))


def _wheels(robot: Robot, episodes: Sequence[LogEpisode], ticks: int, length: int) -> Floats | None:
    unit = robot.figures["wheel_radius"] / robot.figures["full_speed"]
    measured = [_ticks(e.wheels * unit, ticks, length) for e in episodes if e.wheels is not None]
    whole = len(measured) == len(episodes) and all(np.isfinite(wheels).all() for wheels in measured)
    return np.stack(measured) if whole else None


def _ticks_of_heading(episode: LogEpisode, ticks: int, length: int) -> Floats:
    known = np.flatnonzero(np.isfinite(episode.poses[:, 2]))
    if len(known) == 0:
        return np.zeros(length)
    return np.asarray(np.interp(np.arange(length), known * ticks, episode.poses[known, 2]))


def _samples(episode: LogEpisode, rate_hz: float) -> Whole:
    """Rows with a measured pose of their own: repeats of the last one within HELD_S are not."""
    known = np.flatnonzero(np.isfinite(episode.poses).all(axis=1))
    if len(known) == 0:
        return known
    moved = np.any(np.diff(episode.poses[known], axis=0) != 0.0, axis=1)
    fresh = np.concatenate(([True], moved))
    last_fresh = np.maximum.accumulate(np.where(fresh, np.arange(len(known)), 0))
    age = known - known[last_fresh]
    hold = max(1, round(HELD_S * rate_hz))
    return np.asarray(known[fresh | (age % hold == 0)])


def _travel(number: Whole, poses: Floats, rows: Whole, rate_hz: float) -> Floats:
    """How far each increment goes, from the chord over half a second round it."""
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
    rows = sparse.csr_array((share, (labels[own], np.flatnonzero(own))), shape=(count, len(labels)))
    flat = values.reshape(len(values), -1)
    return np.asarray(rows @ flat).reshape(count, *values.shape[1:])


def number_of(labels: Whole) -> Whole:
    """Labels that come in runs, as the number of their run."""
    return np.concatenate(([0], np.cumsum(labels[1:] != labels[:-1])))
