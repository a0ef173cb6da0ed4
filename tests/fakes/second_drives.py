"""Commands of the second generator: ten ways to steer a robot, none of them from manoeuvres.py, some driven twice."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

ROWS_PER_S = 20
FULL_TURN_RATE = 0.6 / 0.16
"""Yaw rate of a difference of 1 between the wheels [rad/s]."""

Array = NDArray[np.float64]
Random = np.random.Generator
Segment = Callable[[Random, int], Array]
"""Duties (rows, 2) of a stretch of a drive: left and right, cut to [−1, 1] afterwards."""


class Course(NamedTuple):
    """Duties (episodes, rows, 2) and starting poses (episodes, 3): x [m], y [m], heading [rad]."""

    duties: Array
    starts: Array


def plan(seed: int, episodes: int, rows: int) -> Course:
    """Drives of three to five segments each; every sixth repeats one before, set down by hand where that began."""
    random = np.random.default_rng([seed, 22])
    duties = np.stack([_drive(random, rows, number) for number in range(episodes)])
    starts = random.uniform((-0.8, -0.8, -np.pi), (0.8, 0.8, np.pi), (episodes, 3))
    for copy in range(5, episodes, 6):
        first = copy - int(random.integers(2, 5))
        duties[copy], starts[copy] = duties[first], starts[first] + random.normal(0.0, (0.01, 0.01, 0.02))
    return Course(duties, starts)


def _drive(random: Random, rows: int, number: int) -> Array:
    count = int(random.integers(3, 6))
    lengths = np.diff(np.rint(np.cumsum([0.0, *random.dirichlet(np.full(count, 8.0))]) * rows).astype(int))
    kinds = [SEGMENTS[(3 * number + place) % len(SEGMENTS)] for place in range(count)]
    return np.clip(np.concatenate([kind(random, int(n)) for kind, n in zip(kinds, lengths, strict=True)]), -1.0, 1.0)


def _both(ahead: Array, turn: Array) -> Array:
    return np.stack((ahead - turn, ahead + turn), axis=1)


def _seconds(rows: int) -> Array:
    return np.arange(rows) / ROWS_PER_S


def _held(random: Random, rows: int, least: int, most: int, draw: Callable[[int], Array]) -> Array:
    """Drawn values, each held for `least` to `most` rows."""
    lengths = random.integers(least, most + 1, rows // least + 1)
    return np.repeat(draw(len(lengths)), lengths)[:rows]


def binary_sequences(random: Random, rows: int) -> Array:
    """Sum and difference each jump between two values, at random rows."""
    middle, swing, turn = random.uniform(0.2, 0.5), random.uniform(0.1, 0.35), random.uniform(0.04, 0.3)
    bits = [_held(random, rows, 4, 24, lambda n: random.choice((-1.0, 1.0), n)) for _ in range(2)]
    return _both(middle + swing * bits[0], turn * bits[1])


def chirps(random: Random, rows: int) -> Array:
    """The difference, or the sum, swings ever faster, from 0.1 to 1.5 Hz."""
    time, last = _seconds(rows), max(rows, 1) / ROWS_PER_S
    wave = np.sin(2.0 * np.pi * (0.1 * time + 0.7 * time**2 / last) + random.uniform(0.0, 6.0))
    if random.random() < 0.5:
        return _both(
            random.uniform(0.1, 0.5) + random.uniform(0.2, 0.5) * wave, np.full(rows, random.normal(0.0, 0.05))
        )
    return _both(np.full(rows, random.uniform(0.2, 0.6)), random.uniform(0.1, 0.3) * wave)


def circles_both_ways(random: Random, rows: int) -> Array:
    """Eights of a whole circle to the left and a whole one to the right."""
    turn = random.uniform(0.12, 0.3)
    circle_s = 2.0 * np.pi / (2.0 * turn * FULL_TURN_RATE)
    side = np.where(_seconds(rows) // circle_s % 2 == 0, 1.0, -1.0) * random.choice((-1.0, 1.0))
    return _both(np.full(rows, random.uniform(0.25, 0.7)), turn * side)


def traffic(random: Random, rows: int) -> Array:
    """Stop and go: gentle or sudden starts, sudden stops, rests, some steering."""
    ahead = _held(random, rows, 16, 50, lambda n: random.uniform(0.2, 1.0, n) * (np.arange(n) % 2))
    gentle = lfilter([0.15], [1.0, -0.85], ahead)
    steer = _held(random, rows, 10, 30, lambda n: random.normal(0.0, 0.04, n))
    return _both(np.where(ahead > 0.0, gentle if random.random() < 0.5 else ahead, 0.0), np.where(ahead > 0, steer, 0))


def joystick(random: Random, rows: int) -> Array:
    """A hand on a stick: smooth random walks around the middle, let go now and then."""
    kicks = random.standard_normal((rows + 200, 2))
    smooth = lfilter([0.05], [1.0, -0.95], lfilter([0.08], [1.0, -0.92], kicks, axis=0), axis=0)[200:]
    stick = smooth / 0.125 * random.uniform((0.25, 0.1), (0.45, 0.2)) + (0.25, 0.0)
    stick *= _held(random, rows, 30, 90, lambda n: random.choice((0.0, 1.0), n, p=(0.15, 0.85)))[:, None]
    return _both(stick[:, 0], stick[:, 1])


def spirals(random: Random, rows: int) -> Array:
    """Ever tighter or wider, forward or back."""
    grown = np.linspace(0.0, 1.0, max(rows, 1))[:rows][:: random.choice((-1, 1))]
    ahead = random.uniform(0.3, 0.7) * random.choice((1.0, 1.0, -1.0))
    return _both(np.full(rows, ahead), random.choice((-1.0, 1.0)) * (0.03 + random.uniform(0.15, 0.35) * grown))


def turns_on_the_spot(random: Random, rows: int) -> Array:
    """Short drives, pauses and turns on the spot, in turns."""
    place = np.arange(rows // 10 + 1)
    held = random.integers(10, 30, len(place))
    ahead = np.where(place % 4 == 0, random.uniform(0.3, 0.9, len(place)), 0.0)
    turn = np.where(place % 4 == 2, random.uniform(0.1, 0.5, len(place)) * random.choice((-1.0, 1.0), len(place)), 0.0)
    return np.repeat(_both(ahead, turn), held, axis=0)[:rows]


def three_point_turns(random: Random, rows: int) -> Array:
    """Forward to one side, back to the other, again and again."""
    lengths = random.integers(14, 40, rows // 14 + 1)
    way = np.repeat(np.where(np.arange(len(lengths)) % 2 == 0, 1.0, -1.0), lengths)[:rows]
    return _both(way * random.uniform(0.25, 0.7), way * random.uniform(-0.2, 0.2))


def staircases(random: Random, rows: int) -> Array:
    """Each wheel climbs stairs of its own, from full duty back to full duty forward."""
    stairs = [np.repeat(np.linspace(-0.5, 1.0, 13), n) for n in random.integers(8, 30, 2)]
    return np.stack([np.resize(np.concatenate((stair, stair[::-1])), rows) for stair in stairs], axis=1)


def crawling(random: Random, rows: int) -> Array:
    """Small duties, up and down through zero."""
    phase = 2.0 * np.pi * np.outer(_seconds(rows), random.uniform(0.1, 0.3, 2)) + random.uniform(0.0, 6.0, 2)
    return random.uniform(0.12, 0.32, 2) * np.sin(phase)


SEGMENTS: tuple[Segment, ...] = (
    binary_sequences,
    traffic,
    crawling,
    joystick,
    circles_both_ways,
    three_point_turns,
    chirps,
    turns_on_the_spot,
    staircases,
    spirals,
)
