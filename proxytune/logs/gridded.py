"""Drives whose poses lie on a regular grid of times, as log.toml's `rate_hz` says."""

from collections.abc import Mapping

import numpy as np

from proxytune.logs.grid import places_on_grid, spread
from proxytune.logs.headings import unwrapped
from proxytune.logs.log import POSE, WHEELS, Floats, LogEpisode
from proxytune.logs.rows import Rows

Issued = tuple[Floats, Floats]
"""An episode's commands at times of their own: times (M,) [s], commands (M, 2)."""


def episodes_on_grid(
    samples: Rows, commands: Floats, issued: Mapping[str, Issued], rate_hz: float
) -> tuple[LogEpisode, ...]:
    """Lay rows on their grids; missing ones are filled: the last command held, no pose.

    Args:
        samples: The rows of samples.csv.
        commands: Their commands (rows, 2); unused where there are commands apart.
        issued: Every episode's commands, where they have times of their own.
        rate_hz: Rows per second; 0 for still frames.

    Raises:
        LogError: If rows lie off the grid.
    """
    places, ends = places_on_grid(samples, rate_hz)
    filled = np.zeros(int(ends[-1]), dtype=np.int64)
    filled[places] = np.arange(len(places))
    held = commands[np.maximum.accumulate(filled)]
    placed = np.column_stack((samples.columns(POSE[:2]), unwrapped(samples)))
    poses = spread(placed, places, len(filled))
    wheels = spread(samples.columns(WHEELS), places, len(filled)) if WHEELS[0] in samples.values else None
    times = samples.values["time"]
    firsts = (*samples.firsts, len(times))
    episodes = []
    for index, (begin, end) in enumerate(zip((0, *ends[:-1]), ends, strict=True)):
        own = times[firsts[index] : firsts[index + 1]]
        grid = own[0] + np.arange(end - begin) / rate_hz if rate_hz else own
        speeds = None if wheels is None else wheels[begin:end]
        name = samples.names[index]
        when, given = issued.get(name, (None, held[begin:end]))
        episodes.append(LogEpisode(name, grid, given, poses[begin:end], speeds, when))
    return tuple(episodes)
