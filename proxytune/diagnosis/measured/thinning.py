"""Long drives made short enough to fit in seconds: increments are joined, and blocks are shortened."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.measured.drives import Drives, Whole, number_of

MOST = 6000
"""No more increments are fitted: beyond, they hardly sharpen what is found, and cost in proportion."""

STRETCH_S = 6.0
"""Blocks are shortened no further than this, so that windows of prediction fit into them; else blocks are left out."""

FEWEST_BLOCKS = 16

JOINED_S = 0.1
"""Increments are joined up to this length; motors are slower."""


def thin(drives: Drives) -> Drives:
    """Thin drives to about MOST increments: join them, then keep a stretch of each block, then fewer blocks."""
    count = len(drives.episode)
    if count <= MOST:
        return drives
    usual = float(np.median(drives.last - drives.first)) / drives.tick_hz
    shorter = join_increments(drives, min(-(-count // MOST), max(1, round(JOINED_S / usual))))
    least = round(STRETCH_S * drives.tick_hz / float(np.median(shorter.last - shorter.first)))
    return shorter.only(_choose_stretches(shorter.block, MOST / len(shorter.episode), least))


def join_increments(drives: Drives, times: int) -> Drives:
    """Join every `times` increments in a row, within unbroken runs of poses and blocks."""
    if times == 1:
        return drives
    run = np.cumsum(~drives.linked | np.concatenate(([True], drives.block[1:] != drives.block[:-1])))
    place = np.arange(len(run)) - np.searchsorted(run, run)
    begins = np.flatnonzero(place % times == 0)
    ends = np.concatenate((begins[1:], [len(run)])) - 1
    whole = drives.only(np.isin(np.arange(len(run)), begins))
    poses = np.stack((drives.poses[begins, 0], drives.poses[ends, 1]), axis=1)
    travel = np.add.reduceat(drives.travel, begins)
    after = None if drives.after is None else np.stack((drives.after[begins, 0], drives.after[ends, 1]), axis=1)
    return replace(whole, last=drives.last[ends], poses=poses, travel=travel, linked=drives.linked[begins], after=after)


def _choose_stretches(block: Whole, share: float, least: int) -> NDArray[np.bool_]:
    """This share of each block in one piece, somewhere within it, of no fewer than `least` increments (N,)."""
    number = number_of(block)
    size = np.bincount(number)
    kept = np.minimum(size, np.maximum(np.ceil(min(1.0, share) * size).astype(int), least))
    # Multiples of the golden ratio spread stretches evenly, in step with nothing that drives repeat.
    spread = np.arange(len(size)) * 0.6180339887 % 1.0
    begin = (spread * (size - kept)).astype(int)
    chosen = spread < max(MOST / kept.sum(), FEWEST_BLOCKS / len(size))
    place = np.arange(len(block)) - np.searchsorted(number, number)
    return np.asarray(chosen[number] & (place >= begin[number]) & (place < (begin + kept)[number]))
