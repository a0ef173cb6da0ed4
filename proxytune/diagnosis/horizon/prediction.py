"""What a fitted model says of any log: poses predicted window by window."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from proxytune.diagnosis.horizon.windows import SHORTEST
from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, gather
from proxytune.diagnosis.measured.instants import as_measured, path_between
from proxytune.diagnosis.model.replay import window_paths
from proxytune.driving.robot import Robot
from proxytune.errors import LogError
from proxytune.logs import Log, LogEpisode
from proxytune.space import Theta


def predict(log: Log, robot: Robot, theta: Theta, horizon_s: float) -> pd.DataFrame:
    """Predicted poses, one row for every row of the log that a window covers.

    In each window the model starts from the measured pose, and the measured wheel speeds where the log has them, and is
    driven by the recorded commands, those before the window included. Windows follow one another; each begins at the
    first measured pose after the one before it.

    Returns:
        Columns `episode, start_time, time, x, y, heading` [s], [s], [s], [m], [m], [rad].

    Raises:
        LogError: If the log has no commands, no poses, or no room for a window.
    """
    if not horizon_s * log.rate_hz >= 1.0:
        raise LogError(f"{log.name}: a horizon of {horizon_s:g} s is shorter than a sample of {1.0 / log.rate_hz:g} s")
    whole = gather(log, robot, log.episodes)
    longest = max(len(episode.times) for episode in log.episodes)
    reach = int(np.floor(min(horizon_s * log.rate_hz, longest) + 1e-9))
    starts = [_starts(episode, reach) for episode in log.episodes]
    if not any(len(rows) for rows in starts):
        raise LogError(f"{log.name}: no measured pose to start a window from")
    ticks = round(whole.tick_hz / log.rate_hz)
    windows = _windows(whole, log.episodes, starts, ticks)
    walked = window_paths(windows, theta, np.arange(len(windows.first)), reach * ticks)
    poses = _place_at(windows.poses[:, 0], *_at_samples(walked, log.episodes, starts, ticks))
    cuts = np.cumsum([len(rows) for rows in starts])[:-1]
    parts = zip(log.episodes, starts, np.split(poses, cuts), strict=True)
    return pd.concat([_rows(*part) for part in parts if len(part[1])], ignore_index=True)


def _rows(episode: LogEpisode, starts: Whole, poses: Floats) -> pd.DataFrame:
    """The predicted poses (W, rows, 3) of an episode's windows, as far as the episode goes, at its poses' own times."""
    covered = starts[:, None] + np.arange(poses.shape[1])
    inside = covered < len(episode.times)
    known = np.minimum(covered, len(episode.times) - 1)
    after = as_measured(episode)[1]
    stamps = episode.times + after
    if episode.measured is not None:
        inside &= np.isin(known, episode.measured.rows)
        stamps[episode.measured.rows] = episode.measured.times
    start = np.broadcast_to(stamps[starts, None], covered.shape)
    times = stamps[known]
    columns = {"start_time": start, "time": times, "x": poses[..., 0], "y": poses[..., 1], "heading": poses[..., 2]}
    return pd.DataFrame({"episode": episode.name} | {name: values[inside] for name, values in columns.items()})


def _at_samples(
    walked: Floats, episodes: Sequence[LogEpisode], starts: Sequence[Whole], ticks: int
) -> tuple[Floats, Floats]:
    """Windows' paths at their samples (W, rows, 3), and at their beginnings (W, 3), when those were measured."""
    rows = np.arange((walked.shape[1] - 1) // ticks + 1)
    after = [as_measured(e)[1] * ticks / float(np.diff(e.times[:2])[0]) for e in episodes]
    late = np.concatenate(
        [one[np.minimum(s[:, None] + rows, len(one) - 1)] for one, s in zip(after, starts, strict=True)]
    )
    window = np.arange(len(walked))
    return path_between(walked, window[:, None], rows * ticks + late), path_between(walked, window, late[:, 0])


def _starts(episode: LogEpisode, reach: int) -> Whole:
    """Rows at which windows begin: measured ones, at least `reach` apart, not the last row."""
    known = np.flatnonzero(np.isfinite(episode.poses[:-1]).all(axis=1))
    starts: list[int] = []
    at = 0
    while (later := int(np.searchsorted(known, at))) < len(known):
        starts.append(int(known[later]))
        at = starts[-1] + reach
    return np.array(starts, dtype=int)


def _windows(whole: Drives, episodes: Sequence[LogEpisode], starts: Sequence[Whole], ticks: int) -> Drives:
    """Drives whose increments are the windows' beginnings alone."""
    poses = np.concatenate([as_measured(one)[0][rows] for one, rows in zip(episodes, starts, strict=True)])
    first = np.concatenate(starts) * ticks
    number = np.repeat(np.arange(len(episodes)), [len(rows) for rows in starts])
    both = np.repeat(poses[:, None], 2, axis=1)
    return replace(whole, episode=number, first=first, last=first, poses=both, block=np.zeros_like(first))


def _place_at(start: Floats, walked: Floats, origin: Floats) -> Floats:
    """Paths (W, rows, 3) put where they start (W, 3); their own beginnings are the origins (W, 3)."""
    turn = start[:, None, 2] - origin[:, None, 2]
    cosine, sine = np.cos(turn), np.sin(turn)
    moved = walked[..., :2] - origin[:, None, :2]
    x = start[:, None, 0] + cosine * moved[..., 0] - sine * moved[..., 1]
    y = start[:, None, 1] + sine * moved[..., 0] + cosine * moved[..., 1]
    return np.stack((x, y, walked[..., 2] + turn), axis=-1)


class Agreement(NamedTuple):
    """How far predicted poses are from those measured, over windows of the horizon.

    Attributes:
        place: RMSE of position [m], 0 where nothing can be compared.
        turn: RMSE of heading [rad], 0 where nothing can be compared.
        poses: How many poses were compared.
        windows: In how many windows.
    """

    place: float
    turn: float
    poses: int
    windows: int


def agreement(table: pd.DataFrame, log: Log, horizon_s: float) -> Agreement:
    """How far predicted poses are from those measured after each window's start.

    Windows in which measured poses reach no further than a stub of the horizon are left out.

    Args:
        table: What `predict` says of the log.
        log: The log.
        horizon_s: Length of the windows [s].
    """
    measured = pd.concat(
        [
            pd.DataFrame(poses, columns=["x", "y", "heading"]).assign(episode=e.name, time=times)
            for e in log.episodes
            for times, poses in [(e.times, e.poses) if e.measured is None else e.measured[:2]]
        ]
    )
    both = table[table.time > table.start_time].merge(measured, on=["episode", "time"], suffixes=("", "_measured"))
    both = both.dropna()
    window = both.groupby(["episode", "start_time"])
    both = both[window.time.transform("max") - both.start_time >= SHORTEST * horizon_s - 1e-9]
    if both.empty:
        return Agreement(0.0, 0.0, 0, 0)
    place = (both.x - both.x_measured) ** 2 + (both.y - both.y_measured) ** 2
    turn = both.heading - both.heading_measured
    count = len(both[["episode", "start_time"]].drop_duplicates())
    return Agreement(float(np.sqrt(place.mean())), float(np.sqrt((turn**2).mean())), len(both), count)
