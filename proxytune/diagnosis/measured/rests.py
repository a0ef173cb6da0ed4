"""Drives cut at long rests: an hour of standing says nothing of motion, and costs as much as an hour of driving."""

import operator
from dataclasses import replace

import numpy as np

from proxytune.diagnosis.measured.commands import Floats
from proxytune.logs import Log, LogEpisode, Measured

LONGEST_S = 20.0
"""Rests are cut out if they last longer."""

BEFORE_S, AFTER_S = 1.0, 3.0
"""So much of a rest is kept before the next command and after the last one: the robot comes to a stop in it."""

REST = 1e-3
"""A command below this share of the largest is none."""


def cut_out_long_rests(log: Log) -> Log:
    """Cut a log at its long rests into drives of their own; the same log where there are none."""
    if log.command == "none":
        return log
    pieces = tuple(piece for episode in log.episodes for piece in _pieces(episode, log.rate_hz))
    whole = len(pieces) == len(log.episodes) and all(map(operator.is_, pieces, log.episodes))
    return log if whole else replace(log, episodes=pieces)


def _pieces(episode: LogEpisode, rate_hz: float) -> tuple[LogEpisode, ...]:
    size = np.abs(episode.held).max(axis=1)
    moving = np.flatnonzero(size > REST * size.max())
    if not len(moving):
        return (episode,)
    most, rows = LONGEST_S * rate_hz, len(episode.times)
    ends = np.flatnonzero(np.diff(moving) > most)
    begins = [int(row - BEFORE_S * rate_hz) for row in moving[[0, *(ends + 1)]]]
    stops = [int(row + AFTER_S * rate_hz) + 1 for row in moving[[*ends, -1]]]
    begins[0] = begins[0] if moving[0] > most else 0
    stops[-1] = stops[-1] if rows - 1 - moving[-1] > most else rows
    if (begins, stops) == ([0], [rows]):
        return (episode,)
    return tuple(_piece(episode, begin, stop) for begin, stop in zip(begins, stops, strict=True))


def _piece(episode: LogEpisode, begin: int, stop: int) -> LogEpisode:
    """Rows of an episode, with the commands that are in force in them."""
    times = episode.times[begin:stop]
    issued, commands = episode.issued, episode.commands[begin:stop]
    if issued is not None:
        first = max(0, int(np.searchsorted(issued, times[0] + 1e-9, side="right")) - 1)
        chosen = slice(first, int(np.searchsorted(issued, times[-1], side="right")))
        issued, commands = issued[chosen], episode.commands[chosen]
    wheels: Floats | None = None if episode.wheels is None else episode.wheels[begin:stop]
    name = f"{episode.name} from {times[0]:.0f} s"
    poses, measured = episode.poses[begin:stop], _cut(episode.measured, begin, stop)
    return LogEpisode(name, times, commands, poses, wheels, issued, measured)


def _cut(measured: Measured | None, begin: int, stop: int) -> Measured | None:
    """The poses at times of their own whose nearest rows are kept."""
    if measured is None:
        return None
    own = (measured.rows >= begin) & (measured.rows < stop)
    return Measured(measured.times[own], measured.poses[own], measured.rows[own] - begin)
