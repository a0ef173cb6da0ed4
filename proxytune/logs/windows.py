"""Drives that were cut into windows, joined again: one that begins a sample after the last one ended, where it ended.

A window's robot is met in motion, and what came before it is lost: delays and lags act across the cut. Stamps and poses
that go on tell what belongs together; stamps that begin anew in every window, or poses in a frame of its own, do not.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from proxytune.arrays import Floats
from proxytune.logs.log import Log, LogEpisode
from proxytune.logs.repeats import HELD_S, runs_of, ways
from proxytune.logs.times import on_own_grid

APART = (0.5, 1.5)
"""Samples from the last stamp of a window to the first of the next: stamps jitter."""
FASTER = 2.0
"""Poses go on if the way across a cut is no longer than so many times what the fastest speed beside it makes of it."""
SURE = 0.9
"""Poses of fewer than this share of the cuts go on by chance: they are in a frame of each window."""


def join_windows(log: Log) -> Log:
    """Join drives that go on where the one before ended; the same log where none does."""
    groups = _groups(log)
    if len(groups) == len(log.episodes):
        return log
    return replace(log, episodes=tuple(_join(group, log.rate_hz) for group in groups))


def windows_note(log: Log) -> Iterator[str]:
    """Tell of windows that are joined, a sentence at most."""
    groups = _groups(log)
    if len(groups) < (count := len(log.episodes)):
        drives = "one drive" if len(groups) == 1 else f"{len(groups)} drives"
        joined = f"{count - len(groups)} of its {count} drives go on a sample after the one before"
        yield f"{joined}, where that ended: they are windows of {drives}, and are diagnosed as such"


def _groups(log: Log) -> list[tuple[LogEpisode, ...]]:
    """The drives of a log, those together that go on from each other."""
    if log.command == "none" or not log.rate_hz:
        return [(episode,) for episode in log.episodes]
    pairs = list(itertools.pairwise(log.episodes))
    in_time = [_goes_on_in_time(*pair, log.poses_hz) for pair in pairs]
    goes_on = [late and _goes_on_in_place(*pair) for late, pair in zip(in_time, pairs, strict=True)]
    if sum(goes_on) < max(1.0, SURE * sum(in_time)):
        return [(episode,) for episode in log.episodes]
    ends = [0, *(number for number, on in enumerate(goes_on, start=1) if not on), len(log.episodes)]
    return [log.episodes[begin:end] for begin, end in itertools.pairwise(ends)]


def _goes_on_in_time(one: LogEpisode, other: LogEpisode, poses_hz: float) -> bool:
    if (one.measured is None) != (other.measured is None) or (one.wheels is None) != (other.wheels is None):
        return False
    last, first = (episode.times if episode.measured is None else episode.measured.times for episode in (one, other))
    return len(last) > 0 and len(first) > 0 and APART[0] <= (first[0] - last[-1]) * poses_hz <= APART[1]


def _goes_on_in_place(one: LogEpisode, other: LogEpisode) -> bool:
    known = [np.flatnonzero(np.isfinite(episode.poses).all(axis=1)) for episode in (one, other)]
    if not all(map(len, known)):
        return False
    ends = np.stack((one.poses[known[0][-1]], other.poses[known[1][0]]))
    way = float(ways(np.diff(_onwards(ends), axis=0))[0])
    fastest = max(float(runs_of(episode).speeds.max(initial=0.0)) for episode in (one, other))
    # A pose that is shown again may be as old as that.
    seconds = float(other.times[known[1][0]] - one.times[known[0][-1]]) + HELD_S
    return way <= FASTER * fastest * seconds


def _onwards(poses: Floats) -> Floats:
    """Poses (N, 3) with headings that do not jump by whole turns."""
    return np.column_stack((poses[:, :2], np.unwrap(poses[:, 2])))


def _join(group: Sequence[LogEpisode], rate_hz: float) -> LogEpisode:
    """One drive of windows."""
    if len(group) == 1:
        return group[0]
    poses = np.concatenate([episode.poses for episode in group])
    known = np.isfinite(poses).all(axis=1)
    poses[known] = _onwards(poses[known])
    wheels = None if group[0].wheels is None else np.concatenate([np.asarray(one.wheels) for one in group])
    issued, commands = _commands(group)
    times = group[0].times[0] + np.arange(len(poses)) / rate_hz
    name = f"{group[0].name} to {group[-1].name}"
    measured = [episode.measured for episode in group if episode.measured is not None]
    if not measured:
        return LogEpisode(name, times, commands, poses, wheels, issued)
    own = np.concatenate([one.times for one in measured])
    as_measured = _onwards(np.concatenate([one.poses for one in measured]))
    before = np.concatenate([episode.times for episode in group])
    times, poses, moved = on_own_grid(own, as_measured, rate_hz)
    if wheels is not None:
        wheels = wheels[np.maximum(np.searchsorted(before, times + 1e-9, side="right") - 1, 0)]
    return LogEpisode(name, times, commands, poses, wheels, issued, moved)


def _commands(group: Sequence[LogEpisode]) -> tuple[Floats | None, Floats]:
    """When commands of windows were issued, and what they were; one that two windows have counts once."""
    commands = np.concatenate([episode.commands for episode in group])
    clocks = [episode.issued for episode in group]
    if all(clock is None for clock in clocks):
        return None, commands
    own = [episode.times if clock is None else clock for episode, clock in zip(group, clocks, strict=True)]
    issued = np.concatenate(own)
    newer = np.append(True, issued[1:] > np.maximum.accumulate(issued)[:-1])
    return issued[newer], commands[newer]
