"""Drives whose poses have times of their own: jittered, with gaps, at whatever rate.

A replay goes on in regular steps. Each pose is therefore moved to the nearest free step along the motion measured round
it: by a step at most, some milliseconds, over which that motion is as good as straight. The poses as they were
measured, and their times, are kept beside it.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from proxytune.errors import LogError
from proxytune.logs.grid import SPARSEST
from proxytune.logs.gridded import Issued
from proxytune.logs.headings import unwrapped
from proxytune.logs.log import POSE, WHEELS, Floats, LogEpisode, Measured, Whole
from proxytune.logs.rows import Rows

STEPS_HZ = 60.0
"""The grid has about so many steps a second at least."""

MISSED = 10
"""The rate is counted over intervals in which no more poses than this are missing."""

REACH_S = 0.1
"""The motion round a pose is taken from so long before it to so long after."""


class _Drive(NamedTuple):
    """The rows of one drive: times (N,), poses (N, 3), wheel speeds (N, 2) or None."""

    times: Floats
    poses: Floats
    wheels: Floats | None


def usual_rate(samples: Rows) -> float:
    """Measured poses a second, drop-outs and gaps apart.

    Raises:
        LogError: If no drive has two poses.
    """
    known = np.isfinite(samples.values["x"])
    times, episode = samples.values["time"][known], samples.episode[known]
    between = np.diff(times)[np.diff(episode) == 0]
    if not len(between):
        raise LogError(f"{samples.path}: no drive has two measured poses; nothing can be learnt from it")
    periods = np.rint(between / np.median(between))
    near = (periods >= 1.0) & (periods <= MISSED)
    return float(periods[near].sum() / between[near].sum())


def episodes_at_own_times(
    samples: Rows, commands: Floats, issued: Mapping[str, Issued]
) -> tuple[tuple[LogEpisode, ...], float]:
    """Every drive on a grid of steps, with its poses as they were measured, and the grid's steps a second.

    Args:
        samples: The rows of samples.csv.
        commands: The command of each row (rows, 2), issued at the row's time; unused where there are commands apart.
        issued: Every episode's commands, where they lie apart.

    Raises:
        LogError: If there are too few poses for their times.
    """
    usual = usual_rate(samples)
    _check_density(samples, usual)
    rate_hz = usual * math.ceil(STEPS_HZ / usual - 0.05)
    placed = np.column_stack((samples.columns(POSE[:2]), unwrapped(samples)))
    wheels = samples.columns(WHEELS) if WHEELS[0] in samples.values else None
    firsts = (*samples.firsts, len(samples.lines))
    episodes = []
    for index, name in enumerate(samples.names):
        own = slice(firsts[index], firsts[index + 1])
        times = samples.values["time"][own]
        drive = _Drive(times, placed[own], None if wheels is None else wheels[own])
        when, given = issued.get(name, (times, commands[own]))
        episodes.append(_episode(name, drive, given, when, rate_hz))
    return tuple(episodes), rate_hz


def _check_density(samples: Rows, usual: float) -> None:
    """Refuse poses so few for the time that they cover that their times cannot be seconds."""
    times = samples.values["time"]
    gaps = np.append(np.diff(times) * samples.follows, 0.0)
    if gaps.sum() * usual > SPARSEST * len(times):
        longest = int(np.argmax(gaps))
        problem = (
            f"the rows cover {gaps.sum():.0f} s with {len(times)} rows, usually {1.0 / usual:.3g} s apart, with a gap "
            f"of {gaps[longest]:g} s before this one; write seconds, or split the episode at its gaps"
        )
        raise samples.error(longest + 1, "time", problem)


def _episode(name: str, drive: _Drive, commands: Floats, issued: Floats, rate_hz: float) -> LogEpisode:
    steps = (drive.times - drive.times[0]) * rate_hz
    known, rows = _free_steps(steps, np.flatnonzero(np.isfinite(drive.poses[:, 0])))
    length = int(max(np.rint(steps[-1]), rows.max(initial=0))) + 1
    grid = drive.times[0] + np.arange(length) / rate_hz
    measured = Measured(drive.times[known], drive.poses[known], rows)
    poses = np.full((length, 3), np.nan)
    poses[rows] = moved(measured, grid[rows])
    return LogEpisode(name, grid, commands, poses, _held(drive, np.rint(steps), length), issued, measured)


def _free_steps(steps: Floats, known: Whole) -> tuple[Whole, Whole]:
    """The nearest step to each known pose that none before it has, and which poses are not a step off by that."""
    order = np.arange(len(known))
    nearest = np.rint(steps[known]).astype(np.int64)
    rows = np.maximum.accumulate(nearest - order) + order if len(known) else nearest
    near = np.abs(rows - steps[known]) <= 1.0
    return known[near], rows[near]


def moved(measured: Measured, times: Floats) -> Floats:
    """Poses (N, 3) as they were at other times (N,) nearby, by the motion measured round each.

    A pose that repeats the one before exactly is an older one shown again, and stays a repeat.
    """
    count = len(measured.times)
    here = np.arange(count)
    before = np.searchsorted(measured.times, measured.times - REACH_S)
    after = np.searchsorted(measured.times, measured.times + REACH_S, side="right") - 1
    before, after = np.maximum(np.minimum(before, here - 1), 0), np.minimum(np.maximum(after, here + 1), count - 1)
    seconds = measured.times[after] - measured.times[before]
    rates = (measured.poses[after] - measured.poses[before]) / np.where(seconds > 0.0, seconds, 1.0)[:, None]
    out = measured.poses + rates * (times - measured.times)[:, None]
    repeats = np.append(False, (np.diff(measured.poses, axis=0) == 0.0).all(axis=1))
    return np.asarray(out[np.maximum.accumulate(np.where(repeats, 0, here))])


def _held(drive: _Drive, steps: Floats, length: int) -> Floats | None:
    """Measured wheel speeds at every step, the last measured one held."""
    if drive.wheels is None:
        return None
    known = np.flatnonzero(np.isfinite(drive.wheels).all(axis=1))
    if not len(known):
        return np.full((length, 2), np.nan)
    newest = np.searchsorted(steps[known], np.arange(length), side="right") - 1
    return np.asarray(drive.wheels[known[np.maximum(newest, 0)]])
