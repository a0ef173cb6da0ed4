"""Poses that repeat to the last digit: of a robot that moves an older one shown again, of one that stands its pose.

A tracker of 10 Hz in rows of 20 Hz shows each pose twice. Such a pose was measured where it first comes. A run of
repeats is told from a stand by the way out of it: after a stand a robot has had the last interval alone to get away,
after a pose that was shown again all of the time since that was measured.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from proxytune.arrays import Flags, Floats, Whole
from proxytune.logs.log import Log, LogEpisode

HELD_S = 0.2
"""A pose that repeats for up to so long tells of no stand, whatever comes after it."""
LEVER_M = 0.2
"""A turn counts as the way of a point so far from the axle's middle."""
MOVES, STILL_M_S = 0.2, 0.02
"""A robot moves from this share of its fast speeds on, and from this speed on."""
AS_FAST = 0.6
"""The way out of a run of repeats belongs to all of its time if it is as fast by this as the one after it; a robot that
stood for one row can reach half."""
USUAL = 0.05
"""From this share of repeated poses on a log is one that repeats them, and says so."""


class Runs(NamedTuple):
    """The poses of a drive without their repeats, N of them."""

    known: Whole  # the rows that have a pose (K,)
    fresh: Flags  # whether that pose is another than the one before (K,)
    counts: Whole  # how many rows show each pose (N,)
    speeds: Floats  # from each pose to the next, turns counted as ways (N − 1,) [m/s]


def runs_of(episode: LogEpisode) -> Runs:
    """The poses of a drive without their repeats."""
    known = np.flatnonzero(np.isfinite(episode.poses).all(axis=1))
    poses = episode.poses[known]
    fresh = np.append(len(known) > 0, (np.diff(poses, axis=0) != 0.0).any(axis=1))[: len(known)]
    at = np.flatnonzero(fresh)
    speeds = ways(np.diff(poses[at], axis=0)) / np.diff(episode.times[known[at]])
    return Runs(known, fresh, np.diff(np.append(at, len(known))), speeds)


def ways(steps: Floats) -> Floats:
    """Lengths of steps of poses (N, 3), turns counted as ways (N,) [m]."""
    return np.asarray(np.hypot(steps[:, 0], steps[:, 1]) + LEVER_M * np.abs(steps[:, 2]))


def _shown_again(runs: Runs, least_m_s: float, *, usual: bool) -> Flags:
    """Tell which poses were shown again while the robot moved (N,); the last is, where that is `usual`, if it moved."""
    speeds = runs.speeds
    if not len(speeds):
        return np.zeros(len(runs.counts), dtype=bool)
    # The last way out has none after it, and is held against the one before.
    beside = np.append(speeds[1:], speeds[-2] if len(speeds) > 1 else np.inf)
    moving = (speeds >= least_m_s) & (speeds >= AS_FAST * beside)
    return np.asarray((runs.counts > 1) & np.append(moving, usual and speeds[-1] >= least_m_s))


def _least_speed(every: Sequence[Runs]) -> float:
    """The speed from which on the robot of a log moves [m/s]."""
    speeds = np.concatenate([np.empty(0), *(runs.speeds for runs in every)])
    return max(STILL_M_S, MOVES * float(np.quantile(speeds, 0.9)) if len(speeds) else 0.0)


def _share(every: Sequence[Runs], least_m_s: float) -> float:
    """The share of poses that are older ones shown again."""
    again = sum(int((runs.counts - 1) @ _shown_again(runs, least_m_s, usual=False)) for runs in every)
    return again / max(1, sum(len(runs.known) for runs in every))


def rows_of_poses(log: Log, episodes: Sequence[LogEpisode]) -> list[Whole]:
    """Rows of these drives of a log, or pieces of them, that have a measured pose of their own.

    Repeats have none while the robot moves; while it stands one each HELD_S has.
    """
    every = [runs_of(episode) for episode in log.episodes]
    least = _least_speed(every)
    usual = _share(every, least) >= USUAL
    hold = max(1, round(HELD_S * log.rate_hz))
    found = []
    for runs in map(runs_of, episodes):
        known, fresh = runs.known, runs.fresh
        newest = np.maximum.accumulate(np.where(fresh, np.arange(len(known)), 0)) if len(known) else known
        stands = ~np.repeat(_shown_again(runs, least, usual=usual), runs.counts)
        found.append(np.asarray(known[fresh | (stands & ((known - known[newest]) % hold == 0))]))
    return found


def repeats_note(log: Log) -> Iterator[str]:
    """Tell of poses that repeat while the robot moves, a sentence at most."""
    every = [runs_of(episode) for episode in log.episodes]
    if (share := _share(every, _least_speed(every))) >= USUAL:
        fresh = sum(len(runs.counts) for runs in every) / sum(len(runs.known) for runs in every)
        repeat = f"{100.0 * share:.0f} % of the poses repeat the one before to the last digit while the robot moves"
        measured = f"about {fresh * log.poses_hz:.2g} a second are measured"
        yield f"{repeat} ({measured}): each is used once, where it first comes"
