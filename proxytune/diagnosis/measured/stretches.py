"""Stretches of drives with one clock: where a clock jumps within a drive, and which drives have another one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.measured.drives import Floats, Whole
from proxytune.diagnosis.measured.latency import Latency, likeliest_latency
from proxytune.logs import Log

BLOCK_S = 2.0
"""Squares are summed over such blocks, whose scatter says how sure a latency is."""

LEAST_S = 0.04
"""Clocks less far apart are one."""

SIDE = 4
"""A stretch between two jumps has at least so many blocks, and a drive of its own clock twice as many."""

SURE, SURE_OF_A_JUMP = 5.0, 8.0
"""Standard deviations; a jump is looked for at every time, so more of them."""

SURE_BESIDE_OTHERS, SHARE_BESIDE_OTHERS = 5.5, 0.15
"""The same where one side of the jump answers as the other drives do; NEAR_S apart, or two deviations, is the same."""

NEAR_S = 0.02

SHARE, SHARE_IF_FAR = 0.08, 0.7
FAR_S = 1.0
"""The least share of what is left over that another clock takes away, and that one further off than FAR_S does. Drives
in which a robot sticks or has play answer later than others, but another latency explains little of that."""

MOST_JUMPS = 4


class Jump(NamedTuple):
    """A clock that jumps within a drive.

    Attributes:
        drive: The drive's name.
        time_s: When, to within BLOCK_S [s, as in the log].
        by_s: How much later poses are stamped from then on [s].
    """

    drive: str
    time_s: float
    by_s: float


class Blocks(NamedTuple):
    """Squares left over at each latency, by blocks of time: episode (B,), number in it (B,), squares (B, L)."""

    episode: Whole
    number: Whole
    squares: Floats


def blocks_within(blocks: Blocks, episode: int, kept: tuple[float, float]) -> Whole:
    """The blocks of an episode that lie in a stretch [s]."""
    begin, end = blocks.number * BLOCK_S, (blocks.number + 1) * BLOCK_S
    return np.flatnonzero((blocks.episode == episode) & (begin >= kept[0]) & (end <= kept[1]))


def stretches(log: Log, blocks: Blocks, latencies: Floats) -> tuple[list[tuple[float, float]], tuple[Jump, ...]]:
    """The longest stretch of each drive without a jump of its clock [s after its beginning], and all jumps."""
    kept: list[tuple[float, float]] = []
    jumps: list[Jump] = []
    usual = _usual([blocks.squares[blocks.episode == e] for e in range(len(log.episodes))], latencies)
    for e, episode in enumerate(log.episodes):
        own = np.flatnonzero(blocks.episode == e)
        found = _all_jumps(blocks.squares[own], latencies, usual)
        edges = [0.0, *(float(blocks.number[own[at]] * BLOCK_S) for at, _ in found), np.inf]
        margin = [0.0, *([BLOCK_S] * len(found)), 0.0]
        end = float(episode.times[-1] - episode.times[0])
        spans = [
            (low + before, high - after)
            for low, high, before, after in zip(edges, edges[1:], margin, margin[1:], strict=False)
        ]
        kept.append(max(spans, key=lambda span: min(span[1], end) - span[0]))
        jumps += [Jump(episode.name, float(episode.times[0]) + edges[1 + k], by) for k, (_, by) in enumerate(found)]
    return kept, tuple(jumps)


def _all_jumps(squares: Floats, latencies: Floats, usual: float | None) -> list[tuple[int, float]]:
    """The jumps of a drive; small ones alone where none is found among all.

    What a robot does in its last seconds may look like something that it did long before.
    """
    found = _jumps(squares, latencies, MOST_JUMPS, usual)
    if found or not len(squares):
        return found
    near = np.abs(latencies - latencies[int(squares.sum(axis=0).argmin())]) < FAR_S
    return _jumps(squares[:, near], latencies[near], MOST_JUMPS, usual)


def _jumps(squares: Floats, latencies: Floats, most: int, usual: float | None) -> list[tuple[int, float]]:
    """Blocks at which the latency jumps, and by how much [s]: the clearest first, then in what lies on either side.

    Args:
        squares: Of one drive, by block and latency (B, L).
        latencies: At which they are given (L,) [s].
        most: How often it is looked for another.
        usual: The latency of most drives [s]; None where there are no others.
    """
    if most == 0 or len(squares) < 2 * SIDE:
        return []
    before = np.cumsum(squares, axis=0)[SIDE - 1 : len(squares) - SIDE]
    total = squares.sum(axis=0)
    at = int((before.min(axis=1) + (total - before).min(axis=1)).argmin()) + SIDE
    one, other = (likeliest_latency(part, latencies) for part in (squares[:at], squares[at:]))
    by = other.value - one.value
    share = min(_share(part, latencies, away.value) for part, away in ((squares[:at], other), (squares[at:], one)))
    if not _is_jump(one, other, share, usual):
        return []
    earlier, later = (_jumps(part, latencies, most - 1, usual) for part in (squares[:at], squares[at:]))
    return [*earlier, (at, by), *((at + more, step) for more, step in later)]


def _is_jump(one: Latency, other: Latency, share: float, usual: float | None) -> bool:
    """Whether the two sides of a block have clearly different latencies.

    Args:
        one: The latency before.
        other: The latency after.
        share: What each side's own latency takes away of what is left over at the other's, the lesser of the two.
        usual: The latency of most drives [s], if there are others.
    """
    by = abs(other.value - one.value)
    sure = by / float(np.hypot(one.deviation, other.deviation))
    if by <= LEAST_S or share < (SHARE if by < FAR_S else SHARE_IF_FAR):
        return False
    if sure > SURE_OF_A_JUMP:
        return True
    if usual is None or sure <= SURE_BESIDE_OTHERS or share < SHARE_BESIDE_OTHERS:
        return False
    near, far = sorted((one, other), key=lambda side: abs(side.value - usual))
    as_others = abs(near.value - usual) < max(NEAR_S, 2.0 * near.deviation)
    return as_others and abs(far.value - usual) > max(LEAST_S, SURE_BESIDE_OTHERS * far.deviation)


def _share(squares: Floats, latencies: Floats, elsewhere: float) -> float:
    """The share of what is left over at another latency that the best one takes away."""
    total = squares.sum(axis=0)
    return 1.0 - float(total.min() / total[int(np.abs(latencies - elsewhere).argmin())])


def deviants(own: Sequence[Floats], latencies: Floats) -> tuple[float, dict[int, Latency]]:
    """The latency that most drives have, and the drives that clearly have another."""
    judged = _judged(own, latencies)
    if len(judged) < 2:
        return 0.0, {}
    common = _median(list(judged.values()))
    found = {}
    for e, one in judged.items():
        away = abs(one.value - common)
        enough = _share(own[e], latencies, common) > (SHARE if away < FAR_S else SHARE_IF_FAR)
        if enough and away > max(LEAST_S, SURE * one.deviation):
            found[e] = one
    return common, found


def _judged(own: Sequence[Floats], latencies: Floats) -> dict[int, Latency]:
    """The latency of every drive that is long enough to have one."""
    judged = {e: likeliest_latency(squares, latencies) for e, squares in enumerate(own) if len(squares) >= 2 * SIDE}
    return {e: one for e, one in judged.items() if np.isfinite(one.deviation)}


def _usual(own: Sequence[Floats], latencies: Floats) -> float | None:
    """The latency that most drives have [s], if there are two at least."""
    judged = list(_judged(own, latencies).values())
    return _median(judged) if len(judged) > 1 else None


def _median(latencies: Sequence[Latency]) -> float:
    """The middle latency, sure ones counting more."""
    ordered = sorted(latencies)
    weight = np.cumsum([1.0 / (one.deviation**2 + (LEAST_S / 4.0) ** 2) for one in ordered])
    return ordered[int(np.searchsorted(weight, weight[-1] / 2.0))].value
