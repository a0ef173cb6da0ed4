"""The planar plant: kinematics over whole arrays of time, exact for twists that hold over a tick."""

from collections.abc import Sequence
from types import TracebackType
from typing import Self

import numpy as np

from proxytune.effects import Signal


def integrate(start: Signal, twists: Signal, tick_s: float) -> Signal:
    """The poses after each tick.

    Args:
        start: Starting poses (…, 3): x [m], y [m], heading [rad].
        twists: Twists (…, time, 3), each held for a tick.
        tick_s: Length of a tick [s].

    Returns:
        Poses (…, time, 3), headings unwrapped.
    """
    turns = twists[..., 2] * tick_s
    headings = start[..., None, 2] + turns.cumsum(axis=-1)
    middles = headings - turns / 2.0
    half = np.pi * (turns / (2.0 * np.pi))
    half[half == 0.0] = np.finfo(float).eps
    chord = tick_s * (np.sin(half) / half)
    forward, sideways = twists[..., 0] * chord, twists[..., 1] * chord
    cosine, sine = np.cos(middles), np.sin(middles)
    x = start[..., None, 0] + (forward * cosine - sideways * sine).cumsum(axis=-1)
    y = start[..., None, 1] + (forward * sine + sideways * cosine).cumsum(axis=-1)
    poses = np.empty((*headings.shape, 3))
    poses[..., 0], poses[..., 1], poses[..., 2] = x, y, headings
    return poses


class PlanarPlant:
    """One robot that moves exactly as its wheels ask; it never hits anything."""

    def __init__(self, start: Signal, tick_s: float) -> None:
        self._pose = np.asarray(start, dtype=float)
        self._tick_s = tick_s

    def move(self, twists: Signal) -> tuple[Signal, bool]:
        """Follow twists, each for one tick."""
        poses = integrate(self._pose, twists, self._tick_s)
        self._pose = poses[-1]
        return poses, False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None


class PlanarFleet:
    """Robots side by side, each as a PlanarPlant."""

    def __init__(self, starts: Signal, tick_s: float) -> None:
        self._poses = np.array(starts, dtype=float)
        self._tick_s = tick_s

    def move(self, twists: Signal, robots: Sequence[int]) -> tuple[Signal, Sequence[bool]]:
        """Follow twists, each for one tick."""
        poses = integrate(self._poses[robots], twists[robots], self._tick_s)
        self._poses[robots] = poses[:, -1]
        return poses, [False] * len(robots)
