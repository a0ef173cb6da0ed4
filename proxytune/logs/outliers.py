"""Poses that lie off the way of the robot for a sample or two: a tracker took something else for it.

A pose is compared with the median of the five samples round it. It is left out where it is further off than ten times
the usual, than twice the way of a fast robot between two samples, and than LEAST.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from proxytune.arrays import Flags, Floats
from proxytune.logs.log import Log, LogEpisode

ROUND = 2
"""Samples on either side that tell where a pose should be."""
LEAST = (0.05, 0.3)
"""What is no further off is noise: place [m], heading [rad]."""
USUAL, STEPS, LOOSE = 10.0, 2.0, 1.5
"""So many usual deviations, and steps of a fast robot, are off the way; samples further apart have a gap between."""


def outliers(episode: LogEpisode) -> Flags:
    """Tell which samples of a drive have a pose that lies off its way (rows,)."""
    known = np.flatnonzero(np.isfinite(episode.poses).all(axis=1))
    found = np.zeros(len(episode.poses), dtype=bool)
    if len(known) <= 2 * ROUND:
        return found
    poses = episode.poses[known]
    # Beside a gap the samples round a pose tell less of it.
    reach = np.pad(known, ROUND, "reflect", reflect_type="odd")
    unbroken = reach[2 * ROUND :] - reach[: -2 * ROUND] <= 2 * ROUND * LOOSE * float(np.median(np.diff(known)))
    # Headings by cosine and sine: along a wrong one they may have been unwrapped to another turn.
    signals = np.column_stack((poses[:, :2], np.cos(poses[:, 2]), np.sin(poses[:, 2])))
    padded = np.pad(signals, ((ROUND, ROUND), (0, 0)), "reflect")
    x, y, cosine, sine = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * ROUND + 1, axis=0), axis=-1).T
    places = np.hypot(poses[:, 0] - x, poses[:, 1] - y), np.hypot(*np.diff(poses[:, :2], axis=0).T)
    headings = _turns(poses[:, 2] - np.arctan2(sine, cosine)), _turns(np.diff(poses[:, 2]))
    for (off, step), least in zip((places, headings), LEAST, strict=True):
        usual = USUAL * 1.4826 * float(np.median(off))
        found[known] |= unbroken & (off > max(least, usual, STEPS * float(np.quantile(step, 0.9))))
    return found


def _turns(angles: Floats) -> Floats:
    """Sizes of angles to either side, at most half a turn."""
    return np.asarray(np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi))


def without_outliers(episode: LogEpisode) -> LogEpisode:
    """The drive without such poses, its headings unwrapped anew; itself where there are none."""
    wrong = outliers(episode)
    if not wrong.any():
        return episode
    poses = np.where(wrong[:, None], np.nan, episode.poses)
    known = np.isfinite(poses[:, 2])
    poses[known, 2] = np.unwrap(poses[known, 2])
    measured = episode.measured
    if measured is not None:
        kept = ~wrong[measured.rows]
        own = measured.poses[kept]
        own[:, 2] = np.unwrap(own[:, 2])
        measured = measured._replace(times=measured.times[kept], poses=own, rows=measured.rows[kept])
    return replace(episode, poses=poses, measured=measured)


def outliers_note(log: Log) -> Iterator[str]:
    """Tell of poses that lie off the way, a sentence at most."""
    wrong = {episode.name: int(outliers(episode).sum()) for episode in log.episodes}
    if count := sum(wrong.values()):
        most = max(wrong, key=lambda name: wrong[name])
        lies = "pose lies" if count == 1 else "poses lie"
        off = f"{count} {lies} off the way for a sample or two (most in drive '{most}', {wrong[most]})"
        yield f"{off}: the tracker took something else for the robot; left out"
