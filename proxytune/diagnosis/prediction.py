"""What a fitted model says of any log: poses predicted window by window."""

from dataclasses import replace

import numpy as np
import pandas as pd

from proxytune.diagnosis.drives import Drives, Floats, Whole, gather
from proxytune.diagnosis.replay import window_paths
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
    parts = [_of_episode(log, robot, theta, episode, horizon_s) for episode in log.episodes]
    rows = [part for part in parts if len(part)]
    if not rows:
        raise LogError(f"{log.name}: no measured pose to start a window from")
    return pd.concat(rows, ignore_index=True)


def _of_episode(log: Log, robot: Robot, theta: Theta, episode: LogEpisode, horizon_s: float) -> pd.DataFrame:
    known = np.flatnonzero(np.isfinite(episode.poses).all(axis=1))
    reach = int(np.floor(horizon_s * log.rate_hz + 1e-9))
    starts = _starts(known, reach, len(episode.times))
    if len(starts) == 0:
        return pd.DataFrame()
    drives = _standing(log, robot, episode, starts)
    ticks = round(drives.tick_hz / log.rate_hz)
    walked = window_paths(drives, theta, np.arange(len(starts)), reach * ticks)[:, ::ticks]
    covered = starts[:, None] + np.arange(reach + 1)
    inside = covered < len(episode.times)
    poses = _placed(episode.poses[starts], walked)
    start = np.broadcast_to(episode.times[starts, None], covered.shape)
    return pd.DataFrame(
        {
            "episode": episode.name,
            "start_time": start[inside],
            "time": episode.times[np.minimum(covered, len(episode.times) - 1)][inside],
            "x": poses[..., 0][inside],
            "y": poses[..., 1][inside],
            "heading": poses[..., 2][inside],
        }
    )


def _starts(known: Whole, reach: int, rows: int) -> Whole:
    """Rows at which windows begin: measured ones, at least `reach` apart, not the last row."""
    starts: list[int] = []
    at = 0
    while True:
        later = np.searchsorted(known, at)
        if later >= len(known) or known[later] >= rows - 1:
            return np.array(starts, dtype=int)
        starts.append(int(known[later]))
        at = starts[-1] + reach


def _standing(log: Log, robot: Robot, episode: LogEpisode, starts: Whole) -> Drives:
    """An episode's drives whose increments are the windows' beginnings alone."""
    whole = gather(log, robot, [episode])
    ticks = round(whole.tick_hz / log.rate_hz)
    poses = np.repeat(episode.poses[starts][:, None], 2, axis=1)
    first = starts * ticks
    nothing = np.zeros(len(starts), dtype=int)
    return replace(whole, episode=nothing, first=first, last=first, poses=poses, block=nothing)


def _placed(start: Floats, walked: Floats) -> Floats:
    """Paths (W, rows, 3) from the origin, put where they start (W, 3)."""
    turn = start[:, None, 2] - walked[:, :1, 2]
    cosine, sine = np.cos(turn), np.sin(turn)
    moved = walked[..., :2] - walked[:, :1, :2]
    x = start[:, None, 0] + cosine * moved[..., 0] - sine * moved[..., 1]
    y = start[:, None, 1] + sine * moved[..., 0] + cosine * moved[..., 1]
    return np.stack((x, y, walked[..., 2] + turn), axis=-1)


def agreement(table: pd.DataFrame, log: Log) -> tuple[float, float, int]:
    """How far predicted poses are from those measured after each window's start.

    Returns:
        RMSE of position [m] and heading [rad], 0 where nothing can be compared, and how many poses were.
    """
    measured = pd.concat(
        [
            pd.DataFrame(e.poses, columns=["x", "y", "heading"]).assign(episode=e.name, time=e.times)
            for e in log.episodes
        ]
    )
    both = table[table.time > table.start_time].merge(measured, on=["episode", "time"], suffixes=("", "_measured"))
    both = both.dropna()
    if both.empty:
        return 0.0, 0.0, 0
    place = (both.x - both.x_measured) ** 2 + (both.y - both.y_measured) ** 2
    turn = both.heading - both.heading_measured
    return float(np.sqrt(place.mean())), float(np.sqrt((turn**2).mean())), len(both)
