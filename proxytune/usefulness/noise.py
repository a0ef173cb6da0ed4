"""The noise floor: the PRPV that the target gets against itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness.comparison import compare
from proxytune.usefulness.prpv import prpv_of_means
from proxytune.usefulness.resampling import counted_means, in_blocks, interval, too_few


@dataclass(frozen=True)
class NoiseFloor:
    """PRPV between two halves of the target's own episodes.

    A half has half the episodes, so this is on the high side: a perfect proxy with as many episodes as the target
    would do somewhat better.

    Attributes:
        value: Mean over splits; None if there is no noise floor.
        low: Lower end of the central 95 % of the splits; None if there is no noise floor.
        high: Upper end of the same; None if there is no noise floor.
        splits: How many random splits were made.
        target: The scores that were split.
        metrics: How agents were compared.
        reason: Why there is no noise floor, empty if there is one.
    """

    value: float | None
    low: float | None
    high: float | None
    splits: int
    target: ScoreTable
    metrics: tuple[Metric, ...]
    reason: str = ""


def noise_floor(*, target: ScoreTable, metrics: Sequence[Metric], splits: int = 200, seed: int = 0) -> NoiseFloor:
    """Compare random halves of the target's episodes: no proxy can be told to do better.

    Where all agents drove the same episodes, all are split alike.

    Raises:
        ScoresError: If there are fewer than two agents or a metric is unknown.
    """
    chosen = compare(proxy=target, target=target, metrics=metrics).target
    reason = too_few(chosen, "on the target")
    if reason:
        return NoiseFloor(None, None, None, 0, chosen, tuple(metrics), reason)
    first = split_halves(chosen, np.random.default_rng(seed), splits)
    second = chosen.driven[:, None, :] - first
    means = counted_means(chosen, first), counted_means(chosen, second)
    values = in_blocks(lambda one, other: prpv_of_means(one, other, metrics), *means)
    return NoiseFloor(float(values.mean()), *interval(values), splits, chosen, tuple(metrics))


def split_halves(table: ScoreTable, rng: np.random.Generator, splits: int) -> NDArray[np.int64]:
    """Which episodes fall into the first half: ones and zeros, shape (agents, splits, episodes)."""
    rows = 1 if table.complete else len(table.agents)
    order = rng.random((rows, splits, len(table.episodes)))
    order = np.where(table.driven[:, None, :], order, np.inf)
    rank = order.argsort(axis=-1).argsort(axis=-1)
    return np.asarray(rank < (table.counts // 2)[:, None, None], dtype=np.int64)
