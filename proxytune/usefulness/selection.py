"""Proxy selection: which of several proxies ranks the agents most like the target, and beyond noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from proxytune.errors import ScoresError
from proxytune.scores import Array, Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, compare
from proxytune.usefulness.prpv import prpv_of_means
from proxytune.usefulness.resampling import CONFIDENCE, bootstrap_means, in_blocks, why_not_repeated


@dataclass(frozen=True)
class Difference:
    """How much worse one proxy is than another.

    Attributes:
        better: The proxy with the lower PRPV.
        worse: The other.
        value: PRPV of the worse less PRPV of the better.
        low: Lower end of its interval; None if episodes are too few.
        high: Upper end of its interval; None if episodes are too few.
    """

    better: str
    worse: str
    value: int
    low: float | None
    high: float | None

    @property
    def beyond_noise(self) -> bool | None:
        """Whether the interval leaves out zero; None if there is none."""
        return None if self.low is None else self.low > 0


@dataclass(frozen=True)
class Selection:
    """Proxies ranked by PRPV.

    Attributes:
        ranking: Names and PRPV, best first.
        differences: Every two proxies, the better one first; the intervals hold for all of them at once.
        reason: Why there are no intervals, empty if there are.
        confidence: How often such intervals all hold at once.
    """

    ranking: tuple[tuple[str, int], ...]
    differences: tuple[Difference, ...]
    reason: str = ""
    confidence: float = CONFIDENCE


def select_proxy(
    *,
    proxies: Mapping[str, ScoreTable],
    target: ScoreTable,
    metrics: Sequence[Metric],
    resamples: int = 1000,
    seed: int = 0,
) -> Selection:
    """Rank proxies by PRPV, and tell by a paired bootstrap which differences are beyond noise.

    All proxies meet the same resampled target. The intervals are simultaneous: their width is set by the largest
    studentised deviation among all differences, so that looking at many pairs makes no false find more likely.

    Raises:
        ScoresError: If there is no proxy, or as in prpv.
    """
    if not proxies:
        raise ScoresError("no proxy is given; name at least one")
    inputs = {name: compare(proxy=proxy, target=target, metrics=metrics) for name, proxy in proxies.items()}
    values = {name: round(float(prpv_of_means(*side.means, side.metrics))) for name, side in inputs.items()}
    ranking = tuple(sorted(values.items(), key=lambda item: item[1]))
    pairs = list(combinations([name for name, _ in ranking], 2))
    observed = np.array([values[worse] - values[better] for better, worse in pairs])
    reason = next(filter(None, map(why_not_repeated, inputs.values())), "")
    if reason or not pairs:
        bare = (Difference(*pair, int(value), None, None) for pair, value in zip(pairs, observed, strict=True))
        return Selection(ranking, tuple(bare), reason)
    resampled = {name: _resampled(side, resamples, seed) for name, side in inputs.items()}
    half = _simultaneous(np.array([resampled[worse] - resampled[better] for better, worse in pairs]))
    rows = zip(pairs, observed, half, strict=True)
    return Selection(ranking, tuple(Difference(*pair, int(v), float(v - h), float(v + h)) for pair, v, h in rows))


def _resampled(inputs: Comparison, resamples: int, seed: int) -> Array:
    """PRPV of resampled episodes; the same seed resamples the target alike for every proxy."""
    means = bootstrap_means(inputs, resamples=resamples, seed=seed)
    return in_blocks(lambda proxy, target: prpv_of_means(proxy, target, inputs.metrics), *means)


def _simultaneous(differences: Array) -> Array:
    """Half widths that hold for all rows at once: shape (pairs, resamples) to (pairs,)."""
    deviation = differences.std(axis=1)
    centred = np.abs(differences - differences.mean(axis=1, keepdims=True))
    studentised = centred / np.where(deviation > 0, deviation, np.inf)[:, None]
    return np.asarray(np.quantile(studentised.max(axis=0), CONFIDENCE) * deviation, dtype=np.float64)
