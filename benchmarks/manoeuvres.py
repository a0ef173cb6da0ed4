"""Duties that excite everything a model of motion may lack: seeded, different in every episode, some driven twice."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

RATE_HZ = 20
"""Control steps per second; a duty holds for one."""

Duties = NDArray[np.float64]
"""Left and right duty (rows, 2) in [−1, 1]."""

Random = np.random.Generator


class Drives(NamedTuple):
    """Duties (episodes, rows, 2) and starting poses (episodes, 3): x [m], y [m], heading [rad]."""

    duties: NDArray[np.float64]
    starts: NDArray[np.float64]


def make_drives(seed: int, episodes: int, rows: int) -> Drives:
    """Every episode mixes two or three manoeuvres; the last sixth repeats the first episodes from the same starts.

    The manoeuvres take turns, so that a log of six episodes has them all.
    """
    random = np.random.default_rng([seed, 1])
    kinds = _turns(random)
    duties = np.stack([_mixture(random, rows, kinds) for _ in range(episodes)])
    starts = random.uniform((-0.5, -0.5, -np.pi), (0.5, 0.5, np.pi), (episodes, 3))
    again = episodes // 6
    if again:
        duties[-again:], starts[-again:] = duties[:again], starts[:again]
    return Drives(duties, starts)


def _turns(random: Random) -> Iterator[Callable[[Random, int], Duties]]:
    while True:
        yield from (MANOEUVRES[i] for i in random.permutation(len(MANOEUVRES)))


def _mixture(random: Random, rows: int, kinds: Iterator[Callable[[Random, int], Duties]]) -> Duties:
    parts = random.integers(2, 4)
    lengths = np.diff(np.linspace(0, rows, parts + 1).astype(int))
    pieces = [next(kinds)(random, int(length)) for length in lengths]
    return np.clip(np.concatenate(pieces), -1.0, 1.0)


def _wheels(base: NDArray[np.float64], difference: NDArray[np.float64]) -> Duties:
    return np.stack((base - difference, base + difference), axis=-1)


def _steps(random: Random, rows: int, shortest_s: float, longest_s: float) -> tuple[NDArray[np.int64], int]:
    """The number of the step that each row belongs to, steps lasting a random time, and how many there are."""
    count = int(rows / (shortest_s * RATE_HZ)) + 2
    ends = np.cumsum(random.uniform(shortest_s, longest_s, count) * RATE_HZ)
    return np.searchsorted(ends, np.arange(rows), side="right"), count


def figure_eights(random: Random, rows: int) -> Duties:
    """One loop to the left, one to the right, at a constant duty."""
    phase = np.arange(rows) / RATE_HZ / random.uniform(5.0, 9.0) * 2.0 * np.pi
    swing = random.uniform(0.1, 0.25) * random.choice((-1.0, 1.0))
    return _wheels(np.full(rows, random.uniform(0.3, 0.75)), swing * np.sin(phase))


def arcs(random: Random, rows: int) -> Duties:
    """Circles at several speeds, up to full duty."""
    step, count = _steps(random, rows, 1.5, 3.5)
    base = random.uniform(0.2, 1.0, count) * random.choice((1.0, 1.0, 1.0, -1.0), count)
    return _wheels(base[step], (base * random.uniform(-0.35, 0.35, count))[step])


def stop_and_go(random: Random, rows: int) -> Duties:
    """Straight ahead and rest, in turns."""
    step, count = _steps(random, rows, 0.7, 1.8)
    base = np.where(np.arange(count) % 2 == 0, random.uniform(0.25, 1.0, count), 0.0)
    return _wheels(base[step], np.zeros(rows))


def spins(random: Random, rows: int) -> Duties:
    """In place, either way, with pauses."""
    step, count = _steps(random, rows, 0.8, 2.0)
    turn = random.uniform(0.08, 0.5, count) * random.choice((-1.0, 0.0, 1.0), count)
    return _wheels(np.zeros(rows), turn[step])


def creeping(random: Random, rows: int) -> Duties:
    """Small duties that ramp through zero, each wheel for itself."""
    time = np.arange(rows)[:, None] / RATE_HZ
    period, phase = random.uniform(5.0, 11.0, 2), random.uniform(0.0, 1.0, 2)
    ramp = 2.0 * np.abs(2.0 * ((time / period + phase) % 1.0) - 1.0) - 1.0
    return random.uniform(0.12, 0.3, 2) * ramp


def reversals(random: Random, rows: int) -> Duties:
    """Forward and back, nearly straight."""
    step, count = _steps(random, rows, 0.6, 1.8)
    base = random.uniform(0.2, 0.8, count) * np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    return _wheels(base[step], random.uniform(-0.08, 0.08, count)[step])


def random_steps(random: Random, rows: int) -> Duties:
    """Each wheel jumps for itself."""
    duties = np.empty((rows, 2))
    for wheel in range(2):
        step, count = _steps(random, rows, 0.3, 1.4)
        duties[:, wheel] = random.uniform(-0.5, 1.0, count)[step]
    return duties


def weaving(random: Random, rows: int) -> Duties:
    """What following a lane slowly looks like: long curves and small corrections."""
    step, count = _steps(random, rows, 2.0, 5.0)
    curve = random.choice((-0.06, 0.0, 0.08), count)[step]
    wobble = 0.05 * np.sin(np.arange(rows) / RATE_HZ * random.uniform(2.0, 5.0))
    jitter = np.repeat(random.normal(0.0, 0.03, rows // 3 + 1), 3)[:rows]
    return _wheels(random.uniform(0.25, 0.45, count)[step], curve + wobble + jitter)


MANOEUVRES: tuple[Callable[[Random, int], Duties], ...] = (
    figure_eights,
    arcs,
    stop_and_go,
    spins,
    creeping,
    reversals,
    random_steps,
    weaving,
)
