"""Poses that were measured between samples, and paths at those instants."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.logs import LogEpisode

Floats = NDArray[Any]
Whole = NDArray[Any]


def path_between(walked: Floats, path: Whole, tick: Floats) -> Floats:
    """Paths (P, T + 1, 3) at ticks that need not be whole (M,), straight between them."""
    low = np.clip(np.floor(tick).astype(int), 0, walked.shape[1] - 2)
    share = (tick - low)[..., None]
    return np.asarray((1.0 - share) * walked[path, low] + share * walked[path, low + 1])


def as_measured(episode: LogEpisode) -> tuple[Floats, Floats]:
    """The poses of an episode's samples as they were measured (rows, 3), and how long after them (rows,) [s]."""
    poses, after = episode.poses, np.zeros(len(episode.times))
    if episode.measured is not None:
        times, own, rows = episode.measured
        poses = np.full_like(episode.poses, np.nan)
        poses[rows], after[rows] = own, times - episode.times[rows]
    return poses, after


def ends_of(episodes: Sequence[LogEpisode], samples: Sequence[Whole]) -> tuple[Floats, Floats]:
    """Poses between which increments lie (N, 2, 3), as measured, and how long after their samples (N, 2) [s].

    Args:
        episodes: The drives (E,).
        samples: The samples of each that have a pose of their own.
    """
    measured = [as_measured(episode) for episode in episodes]
    poses, after = (
        np.concatenate([np.stack((e[part][s[:-1]], e[part][s[1:]]), 1) for e, s in zip(measured, samples, strict=True)])
        for part in (0, 1)
    )
    return poses, after
