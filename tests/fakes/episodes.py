"""Recorded episodes by hand: ways as functions of time."""

import numpy as np

from proxytune.domain import make_episode
from proxytune.study import RecordedEpisode, SideBySide

EPISODE = make_episode({}, agent="steady", start=0, seed=1)


def recorded(x, seconds=2.0, pictures=None):
    """An episode whose robot is at x(t), 0, ten times a second, and whose one channel says the time."""
    time = np.linspace(0.0, seconds, round(10 * seconds) + 1)
    poses = {"time": time, "x": x(time), "y": np.zeros_like(time)}
    return RecordedEpisode({"distance": float(x(seconds))}, poses, {"time": time[:-1], "push": time[:-1]}, pictures)


def paired(proxy, target=None, road=None):
    """An episode in both."""
    return SideBySide(EPISODE, {"distance": "m"}, "" if road is None else "duty", road, proxy, target)
