"""Which drives are fitted and which are kept to test on, and the blocks that are left out in turn."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.drives import Drives, gather
from proxytune.driving.robot import Robot
from proxytune.errors import LogError
from proxytune.logs import Log

FEWEST_EPISODES = 6
"""With fewer, each episode is split by time: the first half is fitted, the second tested."""

LEAST_S = 20.0
"""Less measured motion than this is not enough to fit, and as much again to test."""

BLOCKS = 16
"""Each part has at least about so many blocks, if they last BLOCK_S."""

BLOCK_S = 4.0
"""Blocks are no shorter, unless episodes are."""


class Parts(NamedTuple):
    """The drives to fit and the drives to test on."""

    fitted: Drives
    tested: Drives


def split(log: Log, robot: Robot, test: Log | None) -> Parts:
    """Every third episode, or the second half of few, is kept to test on; or another log is.

    Raises:
        LogError: If there is too little to fit or to test on.
    """
    if test is not None:
        parts = Parts(gather(log, robot, log.episodes), gather(test, robot, test.episodes))
    elif len(log.episodes) >= FEWEST_EPISODES:
        chosen = [log.episodes[i] for i in range(len(log.episodes)) if i % 3 != 2]
        parts = Parts(gather(log, robot, chosen), gather(log, robot, log.episodes[2::3]))
    else:
        parts = _halves(gather(log, robot, log.episodes))
    for name, drives in zip(("fit", "test on"), parts, strict=True):
        if drives.seconds < LEAST_S:
            raise LogError(
                f"{log.name}: only {drives.seconds:.0f} s of measured motion to {name}, at least {LEAST_S:.0f} s are "
                "needed for each; record more episodes"
            )
    return Parts(in_blocks(parts.fitted), in_blocks(parts.tested))


def _halves(drives: Drives) -> Parts:
    early = np.zeros(len(drives.episode), dtype=bool)
    for episode in np.unique(drives.episode):
        own = drives.episode == episode
        middle = (drives.first[own].min() + drives.last[own].max()) / 2.0
        early |= own & (drives.last <= middle)
    return Parts(drives.only(early), drives.only(~early))


def in_blocks(drives: Drives) -> Drives:
    """Drives whose episodes are cut into blocks until there are enough of them."""
    wanted = max(BLOCK_S, drives.seconds / BLOCKS)
    block = np.zeros(len(drives.episode), dtype=int)
    total = 0
    for episode in np.unique(drives.episode):
        own = np.flatnonzero(drives.episode == episode)
        begin, end = drives.first[own[0]], drives.last[own[-1]] + 1
        pieces = max(1, math.floor((end - begin) / drives.tick_hz / wanted))
        block[own] = total + (drives.first[own] - begin) * pieces // (end - begin)
        total += pieces
    _, block = np.unique(block, return_inverse=True)
    return replace(drives, block=block, linked=drives.linked & np.concatenate(([False], block[1:] == block[:-1])))
