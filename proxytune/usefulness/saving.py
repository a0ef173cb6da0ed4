"""What simulation saves: the target's means rectified by the proxy, and how many real rollouts that is worth.

Paired starts (a control variate, prediction-powered inference): with n starts driven on both sides and N more in the
proxy alone, λ the slope of target on proxy and ρ their correlation within agents,

    rectified mean   ȳ − λ (x̄ of the n − x̄ of all n + N)
    its variance     σ²/n · (1 − ρ² N/(n + N)),   so it is worth n / (1 − ρ² N/(n + N)) real rollouts

It holds whatever λ is, hence however wrong the proxy is. Without pairs a model over agents says what a proxy's mean
foretells (Fay and Herriot, 1979): μ_i = a + b s_i + τ e_i, with a, b flat and τ integrated over a grid.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from proxytune.arrays import Flags, Floats
from proxytune.scores import ScoreTable
from proxytune.usefulness.comparison import Comparison, by_start, start_places, starts_of
from proxytune.usefulness.resampling import Ends

FEWEST_AGENTS = 4
FEWEST_PAIRS = 3
NORMAL = 1.959964
SORTED = "outcomes are sorted by value in every agent: episode numbers are no pairs and no order in time"


@dataclass(frozen=True)
class Saving:
    """What the proxy's rollouts are worth in rollouts on the target, of each agent on average.

    Attributes:
        kind: "paired": by starts that both sides have; "policies": by a model over agents; "none".
        real_rollouts_worth: Real rollouts that the proxy's stand for, beside those made; None if it cannot be told.
        interval: Its 95 % interval, by that of the correlation or of τ.
        correlation: Of paired rollouts within an agent, or of means over agents; None likewise.
        real: Rollouts on the target of an agent, on average.
        simulated: Rollouts in the proxy of an agent, on average.
        means: Each agent's rectified mean with its 95 % interval, on the metric it was asked for.
        alone: The same from the target alone.
        rectified: By metric, rectified means and what each is worth, (agents,) each, where pairs help beyond noise.
        reason: Why nothing is saved or known; "" if something is.
    """

    kind: Literal["paired", "policies", "none"]
    real_rollouts_worth: float | None
    interval: Ends | None
    correlation: float | None
    real: float
    simulated: float
    means: Mapping[str, tuple[float, Ends]] = field(default_factory=dict)
    alone: Mapping[str, tuple[float, Ends]] = field(default_factory=dict)
    rectified: Mapping[str, tuple[Floats, Floats]] = field(default_factory=dict)
    reason: str = ""

    @property
    def saved_share(self) -> float | None:
        """The share of real rollouts that is saved for one precision; None if it cannot be told."""
        worth = self.real_rollouts_worth
        return None if worth is None else worth / (self.real + worth)


def effective(counts: Floats, table: ScoreTable, starts: ScoreTable) -> Floats:
    """Starts that a number of episodes is worth: of repeats of a start, the start counts once."""
    few = starts.counts if starts.counts.min() > 1 else table.counts
    return np.asarray(counts * few / table.counts, dtype=np.float64)


def saving_of(inputs: Comparison, column: int = 0) -> Saving:
    """Say what the proxy's rollouts save on one metric: by paired starts, else by a model over agents."""
    real, simulated = float(inputs.target.counts.mean()), float(inputs.proxy.counts.mean())
    if inputs.target.counts.min() < 2:
        return Saving("none", None, None, None, real, simulated, reason="the target has one row an agent: no rollouts")
    rectified = {}
    for place, metric in enumerate(inputs.metrics):
        found = _pairs(inputs, place)
        if found is not None and found.beyond_noise:
            rectified[metric.name] = found.means, found.worth
    pairs, reason = _pairs(inputs, column), ""
    if pairs is not None:
        if not pairs.share:
            reason = "both sides have the same starts only: simulate more of them, which costs no real rollout"
        elif not pairs.beyond_noise:
            reason = "paired rollouts do not correlate beyond noise: the proxy is left out"
        if not reason:
            return _of_pairs(inputs, column, pairs, rectified)
        return Saving("paired", 0.0, pairs.worth_interval, pairs.correlation, real, simulated, rectified=rectified,
                      reason=reason)  # fmt: skip
    return _of_policies(inputs, column, real, simulated)


def is_sorted(table: ScoreTable, column: int) -> bool:
    """True if every agent's zeros and ones come one kind after the other, as no experiment's do."""
    mixed, places = 0, start_places(table)
    places = places if 1 < places.max() + 1 < len(places) else np.zeros_like(places)
    for row, start in itertools.product(table.values[..., column], range(places.max() + 1)):
        values = row[places == start]
        values = values[~np.isnan(values)]
        if not np.isin(values, (0.0, 1.0)).all() or np.count_nonzero(np.diff(values)) > 1:
            return False
        mixed += int(0 < values.sum() < len(values) and len(values) >= 4)
    return mixed >= 2


@dataclass(frozen=True)
class _Pairs:
    means: Floats
    worth: Floats
    counts: Floats
    correlation: float
    correlation_interval: Ends
    share: float
    """N/(n + N) on average."""

    @property
    def beyond_noise(self) -> bool:
        return self.share > 0.0 and (self.correlation_interval[0] > 0.0 or self.correlation_interval[1] < 0.0)

    @property
    def worth_interval(self) -> Ends:
        low, high = self.correlation_interval
        weak, strong = 0.0 if low <= 0.0 <= high else min(low**2, high**2), max(low**2, high**2)
        mean = float(self.counts.mean())
        ends = (mean / (1.0 - min(square * self.share, 0.99)) - mean for square in (weak, strong))
        return next(ends), next(ends)


def _pairs(inputs: Comparison, column: int) -> _Pairs | None:
    """Rectified means of a metric; None where starts are not paired."""
    sides = inputs.proxy, inputs.target
    if is_sorted(inputs.proxy, column) and is_sorted(inputs.target, column):
        return None
    if (inputs.target.driven.sum(axis=0) < 2).all() and len(set(starts_of(inputs.target.episodes))) > 1:
        return None  # no two agents share a label: these are numbers
    one, other = (by_start(side) for side in sides)
    known = set(one.episodes)
    shared = [label for label in other.episodes if label in known]
    met = set(shared)
    if len(shared) < FEWEST_PAIRS:
        return None
    extra = [label for label in one.episodes if label not in met]
    x, y = (side.arrange(agents=inputs.agents, episodes=shared).values[..., column] for side in (one, other))
    both: Flags = ~np.isnan(x) & ~np.isnan(y)
    if both.sum(axis=1).min() < FEWEST_PAIRS or (both.sum(axis=1) < other.counts).any():
        return None
    n = both.sum(axis=1).astype(np.float64)
    x, y = np.where(both, x, np.nan), np.where(both, y, np.nan)
    dx, dy = (side - np.nanmean(side, axis=1, keepdims=True) for side in (x, y))
    xx, yy, xy = (float(np.nansum(product)) for product in (dx * dx, dy * dy, dx * dy))
    if not (xx > 0.0 and yy > 0.0):
        return None
    freedom = float(n.sum() - len(n))
    rho = float(np.clip(xy / math.sqrt(xx * yy), -0.999999, 0.999999))
    middle, half = math.atanh(rho), NORMAL / math.sqrt(max(freedom - 2.0, 1.0))
    ends = math.tanh(middle - half), math.tanh(middle + half)
    rest = one.arrange(agents=inputs.agents, episodes=extra).values[..., column] if extra else np.empty((len(n), 0))
    more = (~np.isnan(rest)).sum(axis=1)
    share = more / (n + more)
    everything = (np.nansum(x, axis=1) + np.nansum(rest, axis=1)) / (n + more)
    means = np.nanmean(y, axis=1) - xy / xx * (np.nanmean(x, axis=1) - everything)
    # The squared correlation of few pairs is high by what chance adds to it.
    square = max(0.0, 1.0 - (1.0 - rho**2) * freedom / max(freedom - 1.0, 1.0))
    counts = inputs.target.counts.astype(np.float64)
    return _Pairs(means, counts / (1.0 - square * share), counts, rho, ends, float(share.mean()))


def _of_pairs(inputs: Comparison, column: int, pairs: _Pairs, rectified: Mapping[str, tuple[Floats, Floats]]) -> Saving:
    variances = _variances(inputs.target, column)
    counts = inputs.target.counts
    alone = _with_ends(inputs.agents, inputs.target.means[:, column], np.sqrt(variances / counts))
    means = _with_ends(inputs.agents, pairs.means, np.sqrt(variances / pairs.worth))
    return Saving(
        "paired", float((pairs.worth - pairs.counts).mean()), pairs.worth_interval, pairs.correlation,
        float(counts.mean()), float(inputs.proxy.counts.mean()), means, alone, rectified,
    )  # fmt: skip


def _variances(table: ScoreTable, column: int) -> Floats:
    """Variance of a rollout of each agent: of successes by their rate with one of each kind added, else pooled."""
    values = table.values[..., column]
    if np.isin(values[table.driven], (0.0, 1.0)).all():
        rates = (np.nansum(values, axis=1) + 1.0) / (table.counts + 2.0)
        return np.asarray(rates * (1.0 - rates), dtype=np.float64)
    squares = np.nansum((values - np.nanmean(values, axis=1, keepdims=True)) ** 2)
    return np.full(len(table.agents), squares / max(1, table.counts.sum() - len(table.agents)))


def _with_ends(agents: tuple[str, ...], means: Floats, errors: Floats) -> dict[str, tuple[float, Ends]]:
    rows = zip(agents, means, errors, strict=True)
    return {agent: (float(m), (float(m - NORMAL * s), float(m + NORMAL * s))) for agent, m, s in rows}


def _of_policies(inputs: Comparison, column: int, real: float, simulated: float) -> Saving:
    """By what a proxy's mean foretells of the target's, over agents."""
    agents, (proxy, target) = inputs.agents, (means[:, column] for means in inputs.means)
    if len(agents) < FEWEST_AGENTS or np.ptp(proxy) <= 0.0:
        what = (
            f"fewer than {FEWEST_AGENTS} agents"
            if len(agents) < FEWEST_AGENTS
            else "all agents score alike in the proxy"
        )
        return Saving("none", None, None, None, real, simulated, reason=f"starts are not paired, and there are {what}")
    counts = inputs.target.counts.astype(np.float64)
    variances = _variances(inputs.target, column) / counts
    if not (variances > 0.0).all():
        return Saving("none", None, None, None, real, simulated, reason="the target's rollouts do not differ")
    ones = np.ones(len(agents))
    means, spread, ends = _shrunken(target, variances, np.stack([ones, proxy - proxy.mean()], axis=1))
    _, without, _ = _shrunken(target, variances, ones[:, None])
    worth = float((counts * (variances / spread - variances / without)).mean())
    low, high = (float((counts * (variances / end - variances / without)).mean()) for end in ends)
    r = float(np.corrcoef(proxy, target)[0, 1]) if np.ptp(target) > 0.0 else None
    return Saving(
        "policies", max(worth, 0.0), (max(min(low, high), 0.0), max(low, high, 0.0)), r, real, simulated,
        _with_ends(agents, means, np.sqrt(spread)), _with_ends(agents, target, np.sqrt(variances)),
        reason="" if worth > 0.0 else "what the proxy foretells of an agent adds nothing to its own rollouts",
    )  # fmt: skip


def _shrunken(target: Floats, variances: Floats, design: Floats) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
    """Posterior means and variances of the agents' true means, and the variances at the ends of τ's 95 %."""
    scale = max(float(np.ptp(target)), float(np.sqrt(variances.max())))
    grid = np.linspace(0.0, 2.0 * scale, 201)[1:, None]
    weight = 1.0 / (variances + grid**2)  # (grid, agents)
    information = np.einsum("ta,ai,aj->tij", weight, design, design)
    cover = np.linalg.inv(information)
    foretold = np.einsum("ai,tij,bj,tb->ta", design, cover, design, weight * target, optimize=True)
    logs = 0.5 * (np.log(weight).sum(axis=1) - np.linalg.slogdet(information)[1])
    logs -= 0.5 * (weight * (target - foretold) ** 2).sum(axis=1)
    trust = grid**2 * weight
    every = trust * target + (1.0 - trust) * foretold
    each = grid**2 * (1.0 - trust) + (1.0 - trust) ** 2 * np.einsum("ai,tij,aj->ta", design, cover, design)
    mass = np.exp(logs - logs.max())
    mass /= mass.sum()
    mean = mass @ every
    cumulated = np.cumsum(mass)
    low, high = (each[min(int(np.searchsorted(cumulated, q)), len(grid) - 1)] for q in (0.975, 0.025))
    return mean, mass @ (each + (every - mean) ** 2), (low, high)
