"""Moments at which a robot falls behind its model again and again: described, and never predicted with.

`find_period` looks for a line and its harmonics in the spectrum of what a model leaves over along the way, each drive
at a phase of its own, against the spectrum round it. Nothing is told where the commands have that period themselves.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import gamma

from proxytune.diagnosis.motion.drives import Drives, Floats, sum_by
from proxytune.diagnosis.motion.innovations import increments
from proxytune.space import Theta

HARMONICS = 3
"""The line and its multiples are summed up to this one: what is short has many."""
LOWEST_HZ, HIGHEST_HZ = 0.05, 1.0
"""Lines are looked for between these, if a drive holds FEWEST of their periods."""
FEWEST = 4
ROUND = 61
"""Lines over which the spectrum's level is taken: it is coloured."""
CHANCE, OWN_CHANCE = 1e-4, 1e-2
"""Chance of such a line in noise below which one is told, and in the commands above which it is not theirs."""
BINS = 40


class Period(NamedTuple):
    """Something that slows the robot down every so often, as if it stood so long [s]; its chance over all lines."""

    period_s: float
    lost_s: float
    chance: float

    def __str__(self) -> str:
        return f"as if it stood for {self.lost_s:.2g} s every {self.period_s:.1f} s"


def find_period(drives: Drives, theta: Theta) -> Period | None:
    """Find the period of what a model leaves over along the way, None where there is none."""
    asked = increments(drives, theta)[:, 0]
    times = (drives.first + drives.last) / 2.0 / drives.tick_hz
    driven = np.bincount(drives.episode, drives.last - drives.first)
    seconds = float(np.median(driven[driven > 0])) / drives.tick_hz
    lines = np.arange(max(LOWEST_HZ, FEWEST / seconds), HARMONICS * HIGHEST_HZ, 0.25 / seconds)
    if len(lines) < 2 * ROUND:
        return None
    behind = (asked - drives.measured[:, 0]) * np.sign(asked)
    chances = _chances(drives, times, lines, behind)
    best = int(chances.argmin())
    if not chances[best] < CHANCE:
        return None
    near = np.abs(np.arange(len(chances)) - best) <= 2
    if _chances(drives, times, lines, np.abs(asked))[near].min() < OWN_CHANCE:
        return None
    period = 1.0 / float(lines[best])
    return Period(period, _lost(drives, times, np.abs(asked), behind, period), float(chances[best]))


def _chances(drives: Drives, times: Floats, lines: Floats, signal: Floats) -> Floats:
    """The chance of each line with its harmonics in noise of the spectrum's own colour, over all lines."""
    count = int(drives.episode.max()) + 1
    mean = sum_by(drives.episode, signal, count) / np.maximum(1, np.bincount(drives.episode, minlength=count))
    rest = signal - mean[drives.episode]
    turns = 2j * np.pi * times
    power = np.array([np.square(np.abs(_sums(drives, rest * np.exp(-line * turns), count))).sum() for line in lines])
    scaled = power / median_filter(power, ROUND) * gamma.median(count)
    combs = lines[lines <= HIGHEST_HZ]
    total = sum(np.interp(number * combs, lines, scaled) for number in range(1, HARMONICS + 1))
    return np.asarray(len(combs) * gamma.sf(total, HARMONICS * count))


def _sums(drives: Drives, values: Floats, count: int) -> Floats:
    return np.bincount(drives.episode, values.real, count) + 1j * np.bincount(drives.episode, values.imag, count)


def _lost(drives: Drives, times: Floats, way: Floats, behind: Floats, period: float) -> float:
    """How long the robot stood in each period by the way that it fell behind [s]: the mean over drives."""
    lost, weights = [], []
    for episode in np.unique(drives.episode):
        own = drives.episode == episode
        phase = (times[own] % period / period * BINS).astype(int)
        asked, missed = (np.bincount(phase, part[own], BINS) for part in (way, behind))
        share = missed / np.maximum(asked, 1e-9)
        share -= np.median(share)
        worst = int(np.convolve(np.tile(share, 3), np.ones(3), "same")[BINS : 2 * BINS].argmax())
        around = np.roll(share, BINS // 2 - worst)[BINS // 4 : -BINS // 4]
        lost.append(float(around.sum()) * period / BINS)
        weights.append(float(asked.sum()))
    return float(np.average(lost, weights=weights))
