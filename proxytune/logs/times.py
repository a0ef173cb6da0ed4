"""Rows made drives on a regular grid of times, headings in radians without jumps by whole turns.

Where log.toml states `rate_hz`, rows lie on that grid. Else poses have times of their own: jittered, with gaps, at
whatever rate. A replay goes on in regular steps; each pose is therefore moved to the nearest free step along the motion
measured round it: by a step at most, some milliseconds, over which that motion is as good as straight. The poses as
they were measured, and their times, are kept beside it.
"""

import math
from collections.abc import Mapping

import numpy as np

from proxytune.arrays import Floats, Whole
from proxytune.errors import LogError
from proxytune.logs.log import POSE, WHEELS, LogEpisode, Measured
from proxytune.logs.rows import Rows

OFF_GRID = 0.25 + 1e-6
"""A row may be this far from its place on the grid of times, in samples."""
SPARSEST = 10
"""A log with more missing rows than this for each row that it has states its times or its rate wrongly."""
SHORTEST_S, LONGEST_S = 1e-5, 10.0
"""Poses whose usual distance in time is beyond these are not timed in seconds."""


def places_on_grid(samples: Rows, rate_hz: float) -> tuple[Whole, Whole]:
    """Place of each row on all grids laid end to end (N,), and where each episode's grid ends (E,)."""
    if not rate_hz:
        return np.arange(len(samples.lines)), samples.ends
    time, episode = samples.values["time"], samples.episode
    elapsed = (time - time[samples.firsts][episode]) * rate_hz
    _check_grid(samples, elapsed, rate_hz)
    steps = np.rint(elapsed).astype(np.int64)
    ends = np.cumsum(steps[samples.ends - 1] + 1)
    return steps + np.append(0, ends[:-1])[episode], ends


def _check_grid(samples: Rows, elapsed: Floats, rate_hz: float) -> None:
    """Refuse rows off the grid, two rows at one place of it, and a grid that is nearly empty."""
    off = np.abs(elapsed - np.rint(elapsed)) > OFF_GRID
    off[1:] |= samples.follows & (np.diff(np.rint(elapsed)) < 1)
    sparse = np.append(np.diff(elapsed) * samples.follows, 0.0)
    longest = int(np.argmax(sparse))
    if sparse.sum() > SPARSEST * len(elapsed):
        cover = f"the rows cover {sparse.sum():.0f} samples of {rate_hz:g} Hz with {len(elapsed)} rows"
        gap = f"with a gap of {sparse[longest] / rate_hz:g} s before this one"
        remedy = "write seconds, correct rate_hz or split the episode"
        raise samples.error(longest + 1, "time", f"{cover}, {gap}; {remedy}")
    if off.any():
        row = int(np.argmax(off))
        lies = f"{samples.values['time'][row]:.12g} s lies off the grid of {rate_hz:g} Hz from the episode's first row"
        remedy = "correct rate_hz, or leave it out of log.toml: poses then keep times of their own"
        raise samples.error(row, "time", f"{lies}; {remedy}")


def spread(values: Floats, places: Whole, length: int) -> Floats:
    """Rows of values (N, columns) at their places on the grid (length, columns), NaN between them."""
    laid = np.full((length, values.shape[1]), math.nan)
    laid[places] = values
    return laid


LONGEST_WAY = 4.0
"""Of the way of half a second in the median: no way weighs more."""


def check_headings(samples: Rows, command: str, rate_hz: float) -> None:
    """Refuse headings in degrees: they jump by 360, or fit the course over ground far better than as radians."""
    heading = samples.values["heading"]
    if command == "none" or np.isnan(heading).all():
        return
    largest = int(np.nanargmax(np.abs(heading)))
    beyond = abs(heading[largest]) > 7.0
    jumps = samples.follows & (np.abs(np.abs(np.diff(heading)) - 360.0) < 30.0)
    if (beyond and jumps.any()) or _fits_as_degrees(samples, rate_hz, beyond=bool(beyond)):
        problem = f"{heading[largest]:g} and the others look like degrees; write headings in radians"
        raise samples.error(largest, "heading", problem)


def _fits_as_degrees(samples: Rows, rate_hz: float, *, beyond: bool) -> bool:
    """True if course over ground and heading keep together with the heading in degrees only.

    Angles are doubled, so that a robot may go backwards, and longer ways weigh more, up to a limit: one may lead to a
    place that is a slip. Where headings go beyond a turn of radians, a course that hardly varies is told by its
    direction too.
    """
    span = max(2, 2 * round(rate_hz / 4.0))
    x, y, heading = samples.columns(POSE).T
    if len(x) <= span:
        return False
    way = (x[span:] - x[:-span]) + 1j * (y[span:] - y[:-span])
    middle = heading[span // 2 : -span // 2]
    moving = (samples.episode[span:] == samples.episode[:-span]) & (np.abs(way) > 0.02) & np.isfinite(middle)
    if moving.sum() < 20:
        return False
    way, middle = way[moving], middle[moving]
    length = np.abs(way)
    weights = np.minimum(length, LONGEST_WAY * np.median(length))
    doubled = (way / length) ** 2 * weights / weights.sum()
    degrees, radians = (complex(np.sum(doubled * np.exp(-2j * h))) for h in (np.radians(middle), middle))
    scattered = abs(degrees) > 0.6 and abs(degrees) > abs(radians) + 0.3
    return scattered or (beyond and degrees.real > 0.8 and degrees.real > radians.real + 0.3)


def unwrapped(samples: Rows) -> Floats:
    """Headings without jumps by whole turns within an episode, gaps passed over."""
    heading = samples.values["heading"].copy()
    measured = np.flatnonzero(np.isfinite(heading))
    if not len(measured):
        return heading
    turns = np.append(0.0, np.rint(np.diff(heading[measured]) / math.tau)).cumsum()
    begins = np.append(True, np.diff(samples.episode[measured]) > 0)
    start = turns[np.maximum.accumulate(np.where(begins, np.arange(len(measured)), 0))]
    heading[measured] -= (turns - start) * math.tau
    return heading


Issued = tuple[Floats, Floats]
"""An episode's commands at times of their own: times (M,) [s], commands (M, 2)."""


def episodes_on_grid(
    samples: Rows, commands: Floats, issued: Mapping[str, Issued], rate_hz: float
) -> tuple[LogEpisode, ...]:
    """Lay rows on their grids; missing ones are filled: the last command held, no pose.

    Commands (rows, 2) go with the rows, unless an episode's are `issued` at times of their own. Still frames have 0 Hz.
    """
    places, ends = places_on_grid(samples, rate_hz)
    filled = np.zeros(int(ends[-1]), dtype=np.int64)
    filled[places] = np.arange(len(places))
    held = commands[np.maximum.accumulate(filled)]
    poses = spread(np.column_stack((samples.columns(POSE[:2]), unwrapped(samples))), places, len(filled))
    wheels = spread(samples.columns(WHEELS), places, len(filled)) if WHEELS[0] in samples.values else None
    each = zip(samples.names, np.split(samples.values["time"], samples.firsts[1:]), (0, *ends[:-1]), ends, strict=True)
    episodes = []
    for name, own, begin, end in each:
        grid = own[0] + np.arange(end - begin) / rate_hz if rate_hz else own
        speeds = None if wheels is None else wheels[begin:end]
        when, given = issued.get(name, (None, held[begin:end]))
        episodes.append(LogEpisode(name, grid, given, poses[begin:end], speeds, when))
    return tuple(episodes)


STEPS_HZ = 60.0
"""The grid has about so many steps a second at least."""
MISSED = 10
"""The rate is counted over intervals in which no more poses than this are missing."""
REACH_S = 0.1
"""The motion round a pose is taken from so long before it to so long after."""


def usual_rate(samples: Rows) -> float:
    """Measured poses a second, drop-outs and gaps apart."""
    known = np.isfinite(samples.values["x"])
    between = np.diff(samples.values["time"][known])[np.diff(samples.episode[known]) == 0]
    if not len(between):
        raise LogError(f"{samples.path}: no drive has two measured poses; nothing can be learnt from it")
    periods = np.rint(between / np.median(between))
    near = (periods >= 1.0) & (periods <= MISSED)
    return float(periods[near].sum() / between[near].sum())


def episodes_at_own_times(
    samples: Rows, commands: Floats, issued: Mapping[str, Issued]
) -> tuple[tuple[LogEpisode, ...], float]:
    """Every drive on a grid of steps, with its poses as they were measured, and the grid's steps a second.

    Commands (rows, 2) are issued at the rows' times unless an episode's are `issued` apart.
    """
    usual = usual_rate(samples)
    _check_density(samples, usual)
    rate_hz = usual * max(1, math.ceil(STEPS_HZ / usual - 0.05))
    placed = np.column_stack((samples.columns(POSE[:2]), unwrapped(samples)))
    wheels = samples.columns(WHEELS) if WHEELS[0] in samples.values else None
    episodes = []
    for name, first, end in zip(samples.names, samples.firsts, samples.ends, strict=True):
        own = slice(first, end)
        times, posed = samples.values["time"][own], placed[own]
        grid, poses, measured = on_own_grid(times, posed, rate_hz)
        speeds = None if wheels is None else _held(wheels[own], np.rint((times - times[0]) * rate_hz), len(grid))
        when, given = issued.get(name, (times, commands[own]))
        episodes.append(LogEpisode(name, grid, given, poses, speeds, when, measured))
    return tuple(episodes), rate_hz


def on_own_grid(times: Floats, poses: Floats, rate_hz: float) -> tuple[Floats, Floats, Measured]:
    """Poses (N, 3) at times of their own (N,), NaN where none was measured, moved to a grid of steps.

    Returns:
        The grid's times (rows,) [s], poses on it (rows, 3), and those measured at times of their own.
    """
    steps = (times - times[0]) * rate_hz
    known = np.flatnonzero(np.isfinite(poses[:, 0]))
    # The nearest step to each pose that none before it has; poses that are a step off by that are left out.
    order, nearest = np.arange(len(known)), np.rint(steps[known]).astype(np.int64)
    rows = np.maximum.accumulate(nearest - order) + order if len(known) else nearest
    near = np.abs(rows - steps[known]) <= 1.0
    known, rows = known[near], rows[near]
    length = int(max(np.rint(steps[-1]), rows.max(initial=0))) + 1
    grid = times[0] + np.arange(length) / rate_hz
    measured = Measured(times[known], poses[known], rows)
    return grid, spread(moved(measured, grid[rows]), rows, length), measured


def _check_density(samples: Rows, usual: float) -> None:
    """Refuse poses so many or so few for the time that they cover that their times cannot be seconds."""
    if not SHORTEST_S < 1.0 / usual < LONGEST_S:
        raise samples.error(1, "time", f"poses are usually {1.0 / usual:.3g} s apart; write seconds")
    times = samples.values["time"]
    gaps = np.append(np.diff(times) * samples.follows, 0.0)
    if gaps.sum() * usual > SPARSEST * len(times):
        longest = int(np.argmax(gaps))
        cover = f"the rows cover {gaps.sum():.0f} s with {len(times)} rows, usually {1.0 / usual:.3g} s apart"
        gap = f"with a gap of {gaps[longest]:g} s before this one"
        raise samples.error(longest + 1, "time", f"{cover}, {gap}; write seconds, or split the episode at its gaps")


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


def _held(wheels: Floats, steps: Floats, length: int) -> Floats:
    """Measured wheel speeds at every step, the last measured one held."""
    known = np.flatnonzero(np.isfinite(wheels).all(axis=1))
    if not len(known):
        return np.full((length, 2), np.nan)
    newest = np.searchsorted(steps[known], np.arange(length), side="right") - 1
    return np.asarray(wheels[known[np.maximum(newest, 0)]])
