"""The grid of times that samples lie on."""

import math

import numpy as np

from proxytune.logs.log import Floats, Whole
from proxytune.logs.rows import Rows

OFF_GRID = 0.25 + 1e-6
"""A row may be this far from its place on the grid of times, in samples."""

SPARSEST = 10
"""A log with more missing rows than this for each row that it has states its times or its rate wrongly."""


def places_on_grid(samples: Rows, rate_hz: float) -> tuple[Whole, Whole]:
    """Where each row lies on all grids laid end to end (N,), and where each episode's grid ends (E,).

    Raises:
        LogError: If rows lie off the grid.
    """
    lasts = np.append(samples.firsts[1:], len(samples.lines)) - 1
    if not rate_hz:
        return np.arange(len(samples.lines)), lasts + 1
    time, episode = samples.values["time"], samples.episode
    elapsed = (time - time[samples.firsts][episode]) * rate_hz
    _check_grid(samples, elapsed, rate_hz)
    steps = np.rint(elapsed).astype(np.int64)
    ends = np.cumsum(steps[lasts] + 1)
    return steps + np.append(0, ends[:-1])[episode], ends


def _check_grid(samples: Rows, elapsed: Floats, rate_hz: float) -> None:
    """Refuse rows off the grid, two rows at one place of it, and a grid that is nearly empty."""
    off = np.abs(elapsed - np.rint(elapsed)) > OFF_GRID
    off[1:] |= samples.follows & (np.diff(np.rint(elapsed)) < 1)
    sparse = np.append(np.diff(elapsed) * samples.follows, 0.0)
    longest = int(np.argmax(sparse))
    if sparse.sum() > SPARSEST * len(elapsed):
        problem = (
            f"the rows cover {sparse.sum():.0f} samples of {rate_hz:g} Hz with {len(elapsed)} rows, with a gap of "
            f"{sparse[longest] / rate_hz:g} s before this one; write seconds, correct rate_hz or split the episode"
        )
        raise samples.error(longest + 1, "time", problem)
    if off.any():
        row = int(np.argmax(off))
        problem = (
            f"{samples.values['time'][row]:.12g} s lies off the grid of {rate_hz:g} Hz from the episode's first row; "
            "correct rate_hz, or leave it out of log.toml: poses then keep times of their own"
        )
        raise samples.error(row, "time", problem)


def spread(values: Floats, places: Whole, length: int) -> Floats:
    """Rows of values (N, columns) at their places on the grid (length, columns), NaN between them."""
    laid = np.full((length, values.shape[1]), math.nan)
    laid[places] = values
    return laid
