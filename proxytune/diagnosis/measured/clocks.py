"""Whether commands and poses share one clock, and drives put right where they do not.

Motion before its command is proof of two clocks; so is motion so late that no delay accounts for it, a drive that
answers at another time than the others, and a drive that changes its time to answer in the middle. A constant offset
that leaves a latency which a delay may have is no proof: delay and offset are one number.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.measured.drives import Drives, Floats, gather
from proxytune.diagnosis.measured.latency import (
    STEP_S,
    Latency,
    Reaction,
    Speeds,
    likeliest_latency,
    measured_speeds,
    reaction,
    reaction_at,
    squares_by_latency,
    sum_in_blocks,
)
from proxytune.diagnosis.measured.stretches import (
    BLOCK_S,
    LEAST_S,
    SURE,
    Blocks,
    Jump,
    blocks_within,
    deviants,
    stretches,
)
from proxytune.driving.robot import Robot
from proxytune.effects import PARAMETERS
from proxytune.logs import Log

FURTHEST_S = 10.0
"""Clocks are looked for up to so far apart."""

EARLIEST_S = 0.02
"""Motion must come so long before its command to be proof."""

ASSUMED_DELAY_S = 0.05
"""The delay that is left to a robot whose nominal delay nobody states, once an offset is taken out."""

RARE = 0.25
"""Clocks of no more than this share of the drives jump, or are others."""

PROOF_BLOCK_S = 5.0
"""Two latencies are compared over such blocks."""


class Offset(NamedTuple):
    """How much later poses are stamped than commands, with a 95 % interval [s]."""

    value: float
    interval: tuple[float, float]


NONE = Offset(0.0, (0.0, 0.0))


@dataclass(frozen=True)
class Clocks:
    """What a log says of the clocks of its commands and poses.

    Attributes:
        latency: From command to motion, beyond the motors' lag, drives of another clock apart [s].
        offset: How much later poses are stamped, if the latency is proof of two clocks: what the latency has besides
            the assumed delay; 0 where it is none.
        assumed_delay_s: The delay that the robot is left with where an offset is taken out [s].
        drives: Drives with another clock than the rest: how much later their poses are stamped than those [s].
        jumps: Clocks that jump within a drive, of which the longest stretch is kept.
        later_s: How much later the poses of each drive are put (E,) [s].
        kept_s: From when to when each drive is used (E, 2) [s after its beginning].
        declared_s: How much later poses are stamped, as log.toml declares; that was taken out beforehand [s], or None.
    """

    latency: Offset
    offset: Offset
    assumed_delay_s: float
    drives: dict[str, Offset]
    jumps: tuple[Jump, ...]
    later_s: Floats
    kept_s: Floats
    declared_s: float | None = None

    @property
    def left_s(self) -> float:
        """The latency that is left once the offset is taken out [s]."""
        return self.latency.value - self.offset.value

    @property
    def differ(self) -> bool:
        """Whether any clock differs from another."""
        return bool(self.offset.value or self.drives or self.jumps)


def read_clocks(log: Log, robot: Robot, like: Clocks | None = None) -> Clocks:
    """Measure the latency of every drive of a log.

    Args:
        log: The log.
        robot: What drove.
        like: Clocks of another log of the same robot: where the latency differs from what is left of that one, the
            clocks do too.

    Raises:
        LogError: If there is nothing to compare in the log.
    """
    drives = gather(log, robot, log.episodes)
    speeds = measured_speeds(drives)
    if not len(speeds.first):
        return replace(_one_clock(len(log.episodes)), declared_s=log.clock_offset_s)
    squares, latencies, apart = _squares(log, drives, speeds)
    kept, jumps = stretches(log, squares, latencies)
    varied = not _is_rare(len({jump.drive for jump in jumps}), len(log.episodes))
    if varied:
        kept, jumps = [(0.0, np.inf)] * len(log.episodes), ()
    own = [squares.squares[blocks_within(squares, e, kept[e])] for e in range(len(log.episodes))]
    common, others = deviants(own, latencies)
    others = {} if varied or not _is_rare(len(others), len(log.episodes)) else others
    latency = likeliest_latency(np.concatenate([part for e, part in enumerate(own) if e not in others]), latencies)
    assumed = like.left_s if like else max(robot.theta.get("delay", 0.0), ASSUMED_DELAY_S)
    unlike = like is not None and abs(latency.value - assumed) > max(LEAST_S, SURE * latency.deviation)
    taken = log.fit_clock_offset or unlike or (apart and _is_impossible(latency))
    later = np.full(len(own), assumed - latency.value if taken else 0.0)
    for e, one in others.items():
        later[e] -= one.value - common
    return Clocks(
        latency=_offset(latency, 0.0),
        offset=_offset(latency, assumed) if taken else NONE,
        assumed_delay_s=assumed,
        drives={log.episodes[e].name: _offset(one, common) for e, one in others.items()},
        jumps=jumps,
        later_s=later,
        kept_s=np.array(kept, dtype=float),
        declared_s=log.clock_offset_s,
    )


def _is_rare(count: int, drives: int) -> bool:
    """Whether so few drives are odd that it may be their clocks.

    A robot whose lag is another in every manoeuvre, as one that ramps its duties, has many.
    """
    return count <= max(1.0, RARE * drives)


def _one_clock(episodes: int) -> Clocks:
    """The clocks of drives too short to tell: taken as one."""
    kept = np.tile((0.0, np.inf), (episodes, 1))
    return Clocks(NONE, NONE, ASSUMED_DELAY_S, {}, (), np.zeros(episodes), kept)


def _squares(log: Log, drives: Drives, speeds: Speeds) -> tuple[Blocks, Floats, bool]:
    """What the best reaction leaves of blocks, the latencies that is given at, and whether its own is impossible."""
    best, apart = _reaction(drives, speeds)
    latencies = best.latency_s + _grid(_reach(drives))
    ends = np.array([len(e.times) for e in log.episodes]) * round(drives.tick_hz / log.rate_hz)
    squares = squares_by_latency(drives, speeds, best, latencies, ends)
    return Blocks(*sum_in_blocks(BLOCK_S, drives, speeds, squares)), latencies, apart


def _grid(reach_s: float) -> Floats:
    count = int(reach_s / STEP_S)
    return np.arange(-count, count + 1) * STEP_S


def _reach(drives: Drives) -> float:
    """How far apart clocks are looked for: no further than drives are long."""
    return float(np.clip(drives.last.max() / drives.tick_hz / 3.0, 0.5, FURTHEST_S))


def _offset(latency: Latency, besides: float) -> Offset:
    middle, half = latency.value - besides, min(1.96 * latency.deviation, FURTHEST_S)
    return Offset(middle, (middle - half, middle + half))


def _is_impossible(latency: Latency) -> bool:
    """Whether no delay accounts for this latency."""
    half = 1.96 * latency.deviation
    early = latency.value + half < 0.0 and latency.value < -EARLIEST_S
    return early or latency.value - half > PARAMETERS["delay"].high


def _reaction(drives: Drives, speeds: Speeds) -> tuple[Reaction, bool]:
    """The best reaction; with a latency that no delay has only if that is clearly better, and whether it is."""
    most = PARAMETERS["delay"].high
    free = reaction(drives, speeds, _reach(drives))
    if 0.0 <= free.latency_s <= most:
        return free, False
    usual = min((reaction_at(drives, speeds, end) for end in (0.0, most)), key=lambda one: one.squares.sum())
    _, _, better = sum_in_blocks(PROOF_BLOCK_S, drives, speeds, usual.squares - free.squares)
    sure = better.sum() > SURE * np.sqrt(len(better)) * better.std()
    return (free, True) if sure else (usual, False)


def put_in_step(drives: Drives, clocks: Clocks, episodes: Sequence[int]) -> Drives:
    """Put drives on one clock: poses later, jumping stretches left out.

    Poses move by whole ticks, and commands by the fraction of a tick that is left.

    Args:
        drives: The drives.
        clocks: Those of their log.
        episodes: Which of the log's episodes they are (E,).
    """
    later = clocks.later_s[list(episodes)] * drives.tick_hz
    ticks = np.ceil(later - 1e-9).astype(int)
    begin, end = (clocks.kept_s[list(episodes)] * drives.tick_hz).T
    own = drives.episode
    inside = (drives.first >= begin[own]) & (drives.last <= end[own]) & (drives.first + ticks[own] >= 0)
    if not later.any():
        return drives if inside.all() else drives.only(inside)
    longer = max(0, int(ticks.max()))
    fraction = (ticks - later)[:, None, None]
    duties = _lengthen(drives.duties, longer)
    before = np.concatenate((drives.rest[:, None], duties[:, :-1]), axis=1)
    at = np.arange(duties.shape[1])
    known = np.arange(drives.headings.shape[1])
    moved = replace(
        drives,
        duties=(1.0 - fraction) * duties + fraction * before,
        issued=np.pad(drives.issued, ((0, 0), (0, longer))),
        headings=np.stack([np.interp(at - k, known, row) for k, row in zip(ticks, drives.headings, strict=True)]),
        first=drives.first + ticks[own],
        last=drives.last + ticks[own],
        wheels=None if drives.wheels is None else _lengthen(drives.wheels, longer),
    )
    return moved.only(inside)


def _lengthen(signal: Floats, ticks: int) -> Floats:
    return np.concatenate((signal, np.repeat(signal[:, -1:], ticks, axis=1)), axis=1)
