"""The two ends of the scale of PRPV, and success rates, whose ties shift it.

    noise floor    PRPV of a domain against itself: what a perfect proxy scores
    chance         PRPV of a proxy that ranks at random; p = (1 + permutations as low) / (1 + permutations), or of up to
                   seven agents the share of all K! orders that score as low, which is exact

Of metrics of zeros and ones each agent's rate has Wilson's interval, repeats of a start counting as far as they differ,
and the pairs of agents that tie are counted.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from proxytune.arrays import Flags
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import resampling
from proxytune.usefulness.comparison import (
    Comparison,
    by_start,
    compare,
    independence,
)
from proxytune.usefulness.pairs import prpv_of_means, stand

FloorKind = Literal["same starts", "halves", "none"]
MEANINGS: dict[FloorKind, str] = {
    "same starts": "target against itself from the same starts: what a perfect proxy scores",
    "halves": "two halves of the target against each other: an upper bound of the noise floor where few agents tie",
    "none": "target against itself",
}


@dataclass(frozen=True)
class NoiseFloor:
    """PRPV of one domain against itself."""

    # "same starts": from the same starts under other placement noise, what a perfect proxy would score.
    # "halves": halves of the starts, which are other ones: an upper bound of that where few agents tie. "none": neither
    kind: FloorKind
    value: float | None = None  # the mean over draws or splits; None if there is no noise floor
    low: float | None = None  # lower end of the central 95 % of draws or splits; None if there is no noise floor
    high: float | None = None  # upper end of the same; None if there is no noise floor
    reason: str = ""  # why there is no noise floor, empty if there is one

    @property
    def title(self) -> str:
        """Its name in a table or a figure."""
        return "halves" if self.kind == "halves" else "noise floor"

    @property
    def meaning(self) -> str:
        """Its meaning in one phrase."""
        return MEANINGS[self.kind]


def floor_of_halves(*, target: ScoreTable, metrics: Sequence[Metric], splits: int = 200, seed: int = 0) -> NoiseFloor:
    """Compare two halves of the target's starts, drawn at random many times; of one start, of its repeats.

    Where all agents drove the same starts, all are split alike.
    """
    if reason := resampling.too_few(target, "on the target"):
        return NoiseFloor("none", reason=reason)
    starts, rng, means = by_start(target), np.random.default_rng(seed), []
    chosen = starts if starts.counts.min() > 1 else target
    for rows, driven in resampling.agent_blocks(chosen, splits):
        sets = split_halves(driven, rng, splits)
        means.append([resampling.counted_means(chosen.values[rows], own) for own in sets])
    first, second = (np.concatenate(parts, axis=1) for parts in zip(*means, strict=True))
    values = resampling.prpv_in_blocks(first, second, metrics)
    return NoiseFloor("halves", float(values.mean()), *resampling.interval(values))


def floor_of_repeats(
    *, domain: ScoreTable, again: ScoreTable, metrics: Sequence[Metric], resamples: int = 1000, seed: int = 0
) -> NoiseFloor:
    """Compare a domain with itself, measured again from the same starts under other placement noise.

    Each agent is compared over the starts that it drove both times, each start by the mean over its repeats. The
    interval is a bootstrap over starts, which both measurements share, and all agents too where none is missing. It
    covers the mean PRPV of many such pairs, so like every bootstrap of PRPV it lies on the high side. Episodes are
    labelled START or START/REPEAT.
    """
    inputs = compare(proxy=again, target=domain, metrics=metrics)
    one, other = by_start(inputs.target), by_start(inputs.proxy)
    shared = [start for start in one.episodes if start in other.episodes]
    one, other = (table.arrange(agents=inputs.agents, episodes=shared) for table in (one, other))
    both = (one.driven & other.driven)[..., None]
    one, other = (replace(table, values=np.where(both, table.values, np.nan)) for table in (one, other))
    absent = [
        f"agent '{agent}' drove no start both times" for agent, n in zip(one.agents, one.counts, strict=True) if not n
    ]
    if reason := next(iter(absent), "") or resampling.too_few(one, "from starts driven both times"):
        return NoiseFloor("none", reason=reason)
    value = float(prpv_of_means(one.means, other.means, metrics))
    counts = resampling.draw_counts(one, np.random.default_rng(seed), resamples)
    means = resampling.counted_means(one.values, counts), resampling.counted_means(other.values, counts)
    low, high = resampling.interval(resampling.prpv_in_blocks(*means, metrics))
    return NoiseFloor("same starts", value, min(low, value), max(high, value))


def split_halves(driven: Flags, rng: np.random.Generator, splits: int) -> tuple[Flags, Flags]:
    """Halves of the episodes (agents, splits, episodes), the first and the second; agents are split by themselves."""
    order = np.where(driven[:, None, :], rng.random((len(driven), splits, driven.shape[1])), np.inf)
    half = (driven.sum(axis=1) // 2)[:, None, None]
    first = order < np.take_along_axis(np.sort(order, axis=-1), half, axis=-1)
    return first, driven[:, None, :] & ~first


@dataclass(frozen=True)
class Rate:
    """The share of an agent's episodes that succeeded, with Wilson's 95 % interval over those that are independent."""

    value: float
    low: float
    high: float
    episodes: int

    def __str__(self) -> str:
        return f"{self.value:.2f} ({self.low:.2f} to {self.high:.2f})"


@dataclass(frozen=True)
class SuccessRates:
    """One metric of zeros and ones: rates of each agent, and how many pairs tie, in the proxy and on the target."""

    metric: str
    proxy: Mapping[str, Rate]
    target: Mapping[str, Rate]
    ties: tuple[int, int]
    pairs: int

    @property
    def note(self) -> str:
        """The number of pairs that tie, and what a tie does; empty where none ties."""
        if not any(self.ties):
            return ""
        count = f"{self.ties[0]} of {self.pairs} pairs of agents tie in the proxy, {self.ties[1]} on the target"
        return f"{self.metric} is a success rate: {count}; a tie counts half: on one side alone it adds 1 to PRPV"


def success_rates(inputs: Comparison) -> tuple[SuccessRates, ...]:
    """The metrics that are nothing but zeros and ones, and not all alike, in their order."""
    found, pairs = [], len(inputs.agents) * (len(inputs.agents) - 1) // 2
    for column, metric in enumerate(inputs.metrics):
        sides = inputs.proxy, inputs.target
        known = [np.unique(side.values[side.driven][:, column]) for side in sides]
        if np.array_equal(np.union1d(*known), (0.0, 1.0)):
            proxy, target = (_rates(side, column) for side in sides)
            merits = [metric.merits(side.means[:, column]) for side in sides]
            ordered = [int(stand(own, float(tie[0])).below.sum()) for own, tie in merits]
            found.append(SuccessRates(metric.name, proxy, target, (pairs - ordered[0], pairs - ordered[1]), pairs))
    return tuple(found)


def _rates(table: ScoreTable, column: int) -> dict[str, Rate]:
    from scipy.special import ndtri

    values, counts = table.means[:, column], table.counts * independence(table, column)
    square = float(ndtri(0.5 + resampling.CONFIDENCE / 2.0)) ** 2
    middle = (counts * values + square / 2.0) / (counts + square)
    half = np.sqrt(square * (counts * values * (1.0 - values) + square / 4.0)) / (counts + square)
    low = np.where(values <= 0.0, 0.0, middle - half)
    high = np.where(values >= 1.0, 1.0, middle + half)
    rows = zip(table.agents, values, low, high, table.counts, strict=True)
    return {agent: Rate(float(value), float(one), float(other), int(n)) for agent, value, one, other, n in rows}


MOST_ENUMERATED = 7
"""Agents of which all orders are looked at: 5040."""
LEVEL = 0.05
"""Chance explains a PRPV as low as is found by chance at least so often."""


@dataclass(frozen=True)
class Chance:
    """PRPV when the proxy's scores are handed out to the agents at random."""

    mean: float  # mean over permutations
    deviation: float  # standard deviation over permutations
    p_value: float  # how probable a PRPV as low as the proxy's is by chance, the proxy's own order counted as one
    permutations: int  # how many were drawn, or all
    exact: bool = False  # whether all orders were looked at
    lowest: bool = False  # whether none of these scores lower than the proxy's own

    @property
    def explains(self) -> bool:
        """True if a random ranking does as well too often to be ruled out."""
        return self.p_value >= LEVEL

    @property
    def too_few(self) -> bool:
        """True if no order of these agents could rule it out: the proxy's own is as good as any."""
        return self.explains and self.lowest and self.deviation > 0.0


def chance(inputs: Comparison, *, permutations: int = 1000, seed: int = 0) -> Chance:
    """Permute which agent got which of the proxy's scores, all orders of few; one agent's metrics stay together."""
    in_proxy, on_target = inputs.means
    exact = len(in_proxy) <= MOST_ENUMERATED
    if exact:
        orders = np.array(list(itertools.permutations(range(len(in_proxy)))))
    else:
        rng = np.random.default_rng(seed)
        orders = np.stack([rng.permutation(len(in_proxy)) for _ in range(permutations)])
    shuffled = in_proxy[orders]
    values = resampling.in_blocks(lambda proxy, _: prpv_of_means(proxy, on_target, inputs.metrics), shuffled, shuffled)
    own = prpv_of_means(in_proxy, on_target, inputs.metrics)
    as_low = (values <= own).sum()
    # The proxy's own order is one of all, and is counted with those that are drawn.
    p_value = float(as_low / len(orders) if exact else (1 + as_low) / (1 + len(orders)))
    lowest = exact and bool(own <= values.min())
    return Chance(float(values.mean()), float(values.std(ddof=not exact)), p_value, len(orders), exact, lowest)
