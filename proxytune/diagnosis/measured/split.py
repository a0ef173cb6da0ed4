"""Which drives are fitted and which are kept to test on, and the blocks that are left out in turn."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.measured.clocks import Clocks, put_in_step
from proxytune.diagnosis.measured.drives import Drives, gather
from proxytune.diagnosis.measured.thinning import thin
from proxytune.driving.robot import Robot
from proxytune.errors import LogError
from proxytune.logs import Log

FEWEST_EPISODES = 6
"""With fewer, each episode is split by time: the first half is fitted, the second tested."""

LEAST_S = 20.0
"""Less measured motion than this is not enough to fit, and as much again to test."""

MOST_S = 900.0
"""No more seconds are fitted where there are drives to choose from: every replay takes all of them."""

MOST_TESTED_S = 1800.0
"""No more seconds are tested on in the same way: the bullet plant drives them all, twice."""

BLOCKS = 16
"""Each part has at least about so many blocks, if they last BLOCK_S."""

BLOCK_S = 4.0
"""Blocks are no shorter, unless episodes are."""


class Parts(NamedTuple):
    """The drives to fit and the drives to test on."""

    fitted: Drives
    tested: Drives


def split(log: Log, robot: Robot, test: Log | None, clocks: Sequence[Clocks] = ()) -> Parts:
    """Keep every third episode to test on, or the second half of each where there are few, or another log.

    Args:
        log: What to fit, and to test on.
        robot: What drove.
        test: Another log to test on.
        clocks: Those of `log` and of `test`, to put their drives on one; none where they are.

    Raises:
        LogError: If there is too little to fit or to test on.
    """
    every = range(len(log.episodes))
    if test is not None:
        parts = Parts(
            _gather_on_one_clock(log, robot, every, clocks[:1]),
            _gather_on_one_clock(test, robot, range(len(test.episodes)), clocks[1:]),
        )
    elif len(log.episodes) >= FEWEST_EPISODES:
        fitted = _choose_some(log, [i for i in every if i % 3 != 2], MOST_S)
        tested = _choose_some(log, every[2::3], MOST_TESTED_S)
        parts = Parts(
            _gather_on_one_clock(log, robot, fitted, clocks), _gather_on_one_clock(log, robot, tested, clocks)
        )
    else:
        parts = _halve(_gather_on_one_clock(log, robot, every, clocks))
    for name, drives in zip(("fit", "test on"), parts, strict=True):
        if drives.seconds < LEAST_S:
            raise LogError(
                f"{log.name}: only {drives.seconds:.1f} s of measured motion to {name}, at least {LEAST_S:.0f} s are "
                "needed for each; record more episodes"
            )
    return Parts(thin(cut_into_blocks(parts.fitted)), cut_into_blocks(parts.tested))


def _choose_some(log: Log, chosen: Sequence[int], most_s: float) -> list[int]:
    """Choose some of these drives, spread evenly, of about so many seconds; the rest is not needed."""
    seconds = sum(float(log.episodes[i].times[-1] - log.episodes[i].times[0]) for i in chosen)
    wanted = max(FEWEST_EPISODES, math.ceil(len(chosen) * min(1.0, most_s / max(seconds, 1.0))))
    count = min(len(chosen), wanted)
    return [chosen[number * len(chosen) // count] for number in range(count)]


def all_drives(log: Log, robot: Robot, clocks: Clocks) -> Drives:
    """All of a log's drives, on one clock, each as one block."""
    return _gather_on_one_clock(log, robot, range(len(log.episodes)), (clocks,))


def _gather_on_one_clock(log: Log, robot: Robot, chosen: Sequence[int], clocks: Sequence[Clocks]) -> Drives:
    """Gather some of a log's drives, on one clock."""
    drives = gather(log, robot, [log.episodes[i] for i in chosen])
    return put_in_step(drives, clocks[0], chosen) if clocks else drives


def _halve(drives: Drives) -> Parts:
    early = np.zeros(len(drives.episode), dtype=bool)
    for episode in np.unique(drives.episode):
        own = drives.episode == episode
        gone = np.cumsum((drives.last - drives.first) * own)
        early |= own & (gone <= gone[-1] / 2.0)
    return Parts(drives.only(early), drives.only(~early))


def cut_into_blocks(drives: Drives) -> Drives:
    """Cut the episodes of drives into blocks until there are enough of them."""
    wanted = max(BLOCK_S, drives.seconds / BLOCKS)
    block = np.zeros(len(drives.episode), dtype=int)
    total = 0
    for episode in np.unique(drives.episode):
        own = np.flatnonzero(drives.episode == episode)
        lasts = drives.last[own] - drives.first[own]
        pieces = max(1, math.floor(lasts.sum() / drives.tick_hz / wanted))
        block[own] = total + (np.cumsum(lasts) - lasts) * pieces // lasts.sum()
        total += pieces
    _, block = np.unique(block, return_inverse=True)
    return replace(drives, block=block, linked=drives.linked & np.concatenate(([False], block[1:] == block[:-1])))
