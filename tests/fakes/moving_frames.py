"""Bags in which frames move in one another."""

import bags
import numpy as np

from proxytune.importing import Wanted
from proxytune.importing.topics import read_bag

TIMES = 1.7e9 + np.arange(50) * 0.1
PLAIN = Wanted(commands="none")


def moving(parent, child, rows, times=TIMES, topic="/tf"):
    return bags.transform_messages(parent, child, rows, times, topic)


def circle(times=TIMES):
    """A robot on a circle of 2 m about (1, 0), heading along it."""
    angles = 0.3 * (times - TIMES[0])
    return np.stack([1 + 2 * np.cos(angles), 2 * np.sin(angles), angles + np.pi / 2], axis=1)


def read(tmp_path, *messages, wanted=PLAIN, storage="mcap"):
    ordered = sorted((each for some in messages for each in some), key=lambda message: message[2])
    return read_bag(bags.write_messages(tmp_path / "run", storage, ordered), wanted)
