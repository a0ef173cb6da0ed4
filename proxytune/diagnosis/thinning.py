"""Long drives made short enough to fit in seconds: increments are joined, and blocks are shortened."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.drives import Drives, Whole, number_of

MOST = 6000
"""No more increments are fitted: beyond, they hardly sharpen what is found, and cost in proportion."""

JOINED_S = 0.1
"""Increments are joined up to this length; motors are slower."""


def thinned(drives: Drives) -> Drives:
    """Drives with at most about MOST increments in the same blocks: joined, then a stretch of each block."""
    count = len(drives.episode)
    if count <= MOST:
        return drives
    usual = float(np.median(drives.last - drives.first)) / drives.tick_hz
    shorter = joined(drives, min(-(-count // MOST), max(1, round(JOINED_S / usual))))
    return shorter.only(_stretches(shorter.block, MOST / len(shorter.episode)))


def joined(drives: Drives, times: int) -> Drives:
    """Every so many increments in a row as one, within unbroken runs of poses and blocks."""
    if times == 1:
        return drives
    run = np.cumsum(~drives.linked | np.concatenate(([True], drives.block[1:] != drives.block[:-1])))
    place = np.arange(len(run)) - np.searchsorted(run, run)
    begins = np.flatnonzero(place % times == 0)
    ends = np.concatenate((begins[1:], [len(run)])) - 1
    whole = drives.only(np.isin(np.arange(len(run)), begins))
    poses = np.stack((drives.poses[begins, 0], drives.poses[ends, 1]), axis=1)
    travel = np.add.reduceat(drives.travel, begins)
    return replace(whole, last=drives.last[ends], poses=poses, travel=travel, linked=drives.linked[begins])


def _stretches(block: Whole, share: float) -> NDArray[np.bool_]:
    """This share of each block in one piece, somewhere within it: not always at its beginning (N,)."""
    number = number_of(block)
    size = np.bincount(number)
    kept = np.ceil(np.minimum(1.0, share) * size).astype(int)
    begin = ((np.arange(len(size)) * 0.6180339887 % 1.0) * (size - kept)).astype(int)
    place = np.arange(len(block)) - np.searchsorted(number, number)
    return np.asarray((place >= begin[number]) & (place < (begin + kept)[number]))
