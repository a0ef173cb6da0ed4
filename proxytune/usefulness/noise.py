"""The noise floor: the PRPV that a domain gets against itself from the same starts, or what stands in for it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from proxytune.scores import Array, Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, compare
from proxytune.usefulness.prpv import prpv_of_means
from proxytune.usefulness.repeats import Choice, by_start, is_repeated, split_repeats, start_places
from proxytune.usefulness.resampling import agent_blocks, counted_means, draw_counts, in_blocks, interval, too_few

FloorKind = Literal["same starts", "halves", "none"]
MEANINGS: dict[FloorKind, str] = {
    "same starts": "target against itself from the same starts: what a perfect proxy scores",
    "halves": "two halves of the target's episodes against each other: an upper bound of the noise floor",
    "none": "target against itself",
}


@dataclass(frozen=True)
class NoiseFloor:
    """PRPV of one domain against itself.

    Attributes:
        kind: "same starts": two sets of episodes from the same starts under other placement noise, what a perfect
            proxy would score. "halves": halves of the episodes, which hold other starts; no more than an upper bound
            of that. "none": there is neither.
        value: Of the means, or the mean over splits; None if there is no noise floor.
        low: Lower end of the central 95 % of resamples or splits; None if there is no noise floor.
        high: Upper end of the same; None if there is no noise floor.
        splits: How many resamples or random splits were made.
        target: The scores of the domain.
        metrics: How agents were compared.
        again: The domain's scores when it was measured again; None where its episodes were split.
        reason: Why there is no noise floor, empty if there is one.
    """

    kind: FloorKind
    value: float | None
    low: float | None
    high: float | None
    splits: int
    target: ScoreTable
    metrics: tuple[Metric, ...]
    again: ScoreTable | None = None
    reason: str = ""

    @property
    def title(self) -> str:
        """Its name in a table or a figure."""
        return "halves" if self.kind == "halves" else "noise floor"

    @property
    def meaning(self) -> str:
        """What it means, in one phrase."""
        return MEANINGS[self.kind]


def noise_floor(*, target: ScoreTable, metrics: Sequence[Metric], splits: int = 200, seed: int = 0) -> NoiseFloor:
    """Compare the target with itself, by two sets of its own episodes that are drawn at random many times.

    Where every start has repeats (episodes labelled START/REPEAT), both sets hold the same starts, each with half of
    its repeats; so the floor is on the high side by what half as many repeats are noisier. Otherwise the sets are
    halves of the episodes, and with them of the starts. Where all agents drove the same episodes, all are split alike.

    Raises:
        ScoresError: If there are fewer than two agents or a metric is unknown.
    """
    chosen = compare(proxy=target, target=target, metrics=metrics).target
    reason = too_few(chosen, "on the target")
    if reason:
        return NoiseFloor("none", None, None, None, 0, chosen, tuple(metrics), reason=reason)
    same_starts = is_repeated(chosen)
    values = _prpv(*_split_means(chosen, np.random.default_rng(seed), splits, same_starts), metrics)
    kind: FloorKind = "same starts" if same_starts else "halves"
    return NoiseFloor(kind, float(values.mean()), *interval(values), splits, chosen, tuple(metrics))


def floor_of_repeats(
    *, domain: ScoreTable, again: ScoreTable, metrics: Sequence[Metric], resamples: int = 1000, seed: int = 0
) -> NoiseFloor:
    """Compare a domain with itself, measured again from the same starts under other placement noise.

    Each agent is compared over the starts that it drove both times, each start by the mean over its repeats. The
    interval is a bootstrap over starts, which both measurements share, and all agents too where none is missing. It
    covers the mean PRPV of many such pairs, so like every bootstrap of PRPV it lies on the high side.

    Args:
        domain: Scores of the domain.
        again: Its scores under other placement noise: the same agents, episodes labelled START or START/REPEAT.
        metrics: How agents are compared.
        resamples: How many to draw.
        seed: Seed of the resampling.

    Raises:
        ScoresError: As in prpv.
    """
    inputs = compare(proxy=again, target=domain, metrics=metrics)
    one, other = _shared_starts(inputs)
    absent = [agent for agent, count in zip(one.agents, one.counts, strict=True) if not count]
    reason = (
        f"agent '{absent[0]}' drove no start both times" if absent else too_few(one, "from starts driven both times")
    )
    if reason:
        return NoiseFloor("none", None, None, None, 0, inputs.target, inputs.metrics, inputs.proxy, reason)
    value = float(prpv_of_means(one.means, other.means, metrics))
    counts = draw_counts(one, np.random.default_rng(seed), resamples)
    low, high = interval(_prpv(counted_means(one.values, counts), counted_means(other.values, counts), metrics))
    ends = min(low, value), max(high, value)
    return NoiseFloor("same starts", value, *ends, resamples, inputs.target, inputs.metrics, inputs.proxy)


def _split_means(table: ScoreTable, rng: np.random.Generator, splits: int, same_starts: bool) -> tuple[Array, Array]:
    """Mean scores of two sets of each agent's episodes, each of shape (splits, agents, metrics)."""
    places, keys = start_places(table), rng.random((splits, len(table.episodes))) if same_starts else None
    means = []
    for rows, driven in agent_blocks(table, splits):
        sets = split_halves(driven, rng, splits) if keys is None else split_repeats(driven, places, keys)
        means.append([counted_means(table.values[rows], chosen) for chosen in sets])
    first, second = (np.concatenate(parts, axis=1) for parts in zip(*means, strict=True))
    return first, second


def split_halves(driven: Choice, rng: np.random.Generator, splits: int) -> tuple[Choice, Choice]:
    """Which episodes fall into the first half and which into the second, each of shape (agents, splits, episodes).

    Args:
        driven: Which agent drove which episode, shape (agents, episodes).
        rng: Every agent is split at random by itself.
        splits: How many times.
    """
    order = np.where(driven[:, None, :], rng.random((len(driven), splits, driven.shape[1])), np.inf)
    half = (driven.sum(axis=1) // 2)[:, None, None]
    first = order < np.take_along_axis(np.sort(order, axis=-1), half, axis=-1)
    return first, driven[:, None, :] & ~first


def _shared_starts(inputs: Comparison) -> tuple[ScoreTable, ScoreTable]:
    """Both tables by start, each agent with those starts only that it drove on both sides."""
    one, other = by_start(inputs.target), by_start(inputs.proxy)
    shared = [start for start in one.episodes if start in other.episodes]
    one, other = (table.arrange(agents=inputs.agents, episodes=shared) for table in (one, other))
    both = (one.driven & other.driven)[..., None]
    first, second = (
        ScoreTable(inputs.agents, tuple(shared), table.metrics, np.where(both, table.values, np.nan))
        for table in (one, other)
    )
    return first, second


def _prpv(one: Array, other: Array, metrics: Sequence[Metric]) -> Array:
    return in_blocks(lambda p, t: prpv_of_means(p, t, metrics), one, other)
