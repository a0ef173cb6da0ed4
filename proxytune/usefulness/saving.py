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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from proxytune.arrays import Flags, Floats
from proxytune.scores import ScoreTable
from proxytune.usefulness.comparison import Comparison, by_start, independence, start_places, starts_of
from proxytune.usefulness.resampling import CONFIDENCE, Ends

FEWEST_AGENTS = 4
FEWEST_PAIRS = 3
NORMAL = 1.959964
EDGE = 0.3
"""A rate's interval: between Clopper and Pearson's (0), too wide on average, and Jeffreys' (½), too narrow at some.
It holds at fixed rates with 92 % or more, and with 96 to 97 % on average over all of them."""
SORTED = "outcomes are sorted by value in every agent: episode numbers are no pairs and no order in time"


class Rectified(NamedTuple):
    """The target's means by paired starts; the variance of one is ((1 − share) s² of scores + share s² of rest)/n."""

    means: Floats  # (agents,)
    worth: Floats  # rollouts on the target that each is worth by the correlation within agents, (agents,)
    rest: Floats  # scores less λ times the proxy's, (agents, starts)
    shares: Floats  # N/(n + N) of each agent


@dataclass(frozen=True)
class Saving:
    """What the proxy's rollouts are worth in rollouts on the target, of each agent on average."""

    # "paired": by starts that both sides have; "policies": by a model over agents; "none"
    kind: Literal["paired", "policies", "none"]
    # real rollouts that the proxy's stand for, beside those made; None if it cannot be told
    real_rollouts_worth: float | None
    interval: Ends | None  # its 95 % interval, by that of the correlation or of τ
    correlation: float | None  # of paired rollouts within an agent, or of means over agents; None likewise
    real: float  # rollouts on the target of an agent, on average
    simulated: float  # rollouts in the proxy of an agent, on average
    # each agent's rectified mean with its 95 % interval, on the metric it was asked for
    means: Mapping[str, tuple[float, Ends]] = field(default_factory=dict)
    alone: Mapping[str, tuple[float, Ends]] = field(default_factory=dict)  # the same from the target alone
    rectified: Mapping[str, Rectified] = field(default_factory=dict)  # by metric, where pairs help beyond noise
    reason: str = ""  # why nothing is saved or known; "" if something is

    @property
    def saved_share(self) -> float | None:
        """The share of real rollouts that is saved for one precision; None if it cannot be told."""
        worth = self.real_rollouts_worth
        return None if worth is None else worth / (self.real + worth)


def saving_of(inputs: Comparison, column: int = 0, *others: Comparison) -> Saving:
    """Say what the proxy's rollouts save on one metric: by paired starts, else by a model over agents.

    Other proxies of that target are used together with the first.
    """
    every = (inputs, *others)
    real, simulated = float(inputs.target.counts.mean()), sum(float(one.proxy.counts.mean()) for one in every)
    if inputs.target.counts.min() < 2:
        return Saving("none", None, None, None, real, simulated, reason="the target has one row an agent: no rollouts")
    rectified = {}
    for place, metric in enumerate(inputs.metrics):
        found = _pairs(every, place)
        if found is not None and found.beyond_noise:
            rectified[metric.name] = Rectified(found.means, found.sure_worth, found.rest, found.shares)
    pairs, reason = _pairs(every, column), ""
    if pairs is None:
        return _of_policies(every, column, real, simulated)
    if not pairs.share:
        reason = "both sides have the same starts only: simulate more of them, which costs no real rollout"
    elif not pairs.beyond_noise:
        reason = "paired rollouts do not correlate beyond noise: the proxy is left out"
    if reason:
        return Saving("paired", 0.0, pairs.worth_interval, pairs.correlation, real, simulated, rectified=rectified,
                      reason=reason)  # fmt: skip
    table, worth = inputs.target, float((pairs.worth - pairs.counts).mean())
    alone = _with_ends(table, column, table.means[:, column], pairs.counts)
    means = _with_ends(table, column, pairs.means, pairs.sure_worth)
    return Saving("paired", worth, pairs.worth_interval, pairs.correlation, real, simulated, means, alone, rectified)


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


def is_rate(table: ScoreTable, column: int) -> bool:
    """True of a metric of zeros and ones with more than one episode an agent."""
    return bool(table.counts.max() > 1 and np.isin(table.values[..., column][table.driven], (0.0, 1.0)).all())


def rate_intervals(rates: Floats, counts: Floats) -> list[Ends]:
    """The 95 % interval of each rate (agents,) that rests on so many rollouts."""
    from scipy.special import betaincinv

    tail = (1.0 - CONFIDENCE) / 2.0
    successes = np.clip(rates, 0.0, 1.0) * counts
    failures = counts - successes
    low = betaincinv(successes + EDGE, failures + 1.0 - EDGE, tail)
    high = betaincinv(successes + 1.0 - EDGE, failures + EDGE, 1.0 - tail)
    low, high = np.where(successes < 0.5, 0.0, low), np.where(failures < 0.5, 1.0, high)
    return list(zip(map(float, low), map(float, high), strict=True))


@dataclass(frozen=True)
class _Pairs:
    means: Floats
    counts: Floats
    correlation: float
    beyond_noise: bool  # whether proxies' further rollouts help by more than chance makes of no correlation
    likely: Ends  # 95 % of the square of the correlation
    square: float  # of the correlation, without what chance adds to that of few pairs
    sure_square: float  # of one lower by its standard error: what is chosen for being high is too high
    rest: Floats  # the target's scores less λ times the proxy's, (agents, starts)
    shares: Floats  # N/(n + N) of each agent

    @property
    def share(self) -> float:
        return float(self.shares.mean())

    @property
    def worth(self) -> Floats:
        return self.counts / (1.0 - self.square * self.shares)

    @property
    def sure_worth(self) -> Floats:
        return self.counts / (1.0 - self.sure_square * self.shares)

    @property
    def worth_interval(self) -> Ends:
        mean = float(self.counts.mean())
        ends = (mean / (1.0 - min(square * self.share, 0.99)) - mean for square in self.likely)
        return next(ends), next(ends)


def _pairs(every: Sequence[Comparison], column: int) -> _Pairs | None:
    """Means of a metric, rectified by one or several proxies; None where starts are not paired."""
    from scipy.special import chdtri, fdtri

    target, agents = every[0].target, every[0].agents
    if is_sorted(target, column) and any(is_sorted(one.proxy, column) for one in every):
        return None
    if (target.driven.sum(axis=0) < 2).all() and len(set(starts_of(target.episodes))) > 1:
        return None  # no two agents share a label: these are numbers
    proxies, other = [by_start(one.proxy) for one in every], by_start(target)
    known = set.intersection(*(set(one.episodes) for one in proxies))
    shared = [label for label in other.episodes if label in known]
    if len(shared) < FEWEST_PAIRS:
        return None
    unpaired = known - set(shared)
    alone = [label for label in proxies[0].episodes if label in unpaired]
    x = np.stack([one.arrange(agents=agents, episodes=shared + alone).values[..., column] for one in proxies])
    y = other.arrange(agents=agents, episodes=shared).values[..., column]
    met: Flags = np.asarray(~np.isnan(x).any(axis=0))
    more = met[:, len(shared) :].sum(axis=1)
    both: Flags = met[:, : len(shared)] & ~np.isnan(y)
    if both.sum(axis=1).min() < FEWEST_PAIRS or (both.sum(axis=1) < other.counts).any():
        return None
    n = both.sum(axis=1).astype(np.float64)
    paired, y = np.where(both, x[..., : len(shared)], np.nan), np.where(both, y, np.nan)
    dx, dy = (np.nan_to_num(side - np.nanmean(side, axis=-1, keepdims=True)) for side in (paired, y))
    gram, xy, yy = np.einsum("ian,jan->ij", dx, dx), np.einsum("ian,an->i", dx, dy), float((dy * dy).sum())
    if not (np.diag(gram).min() > 0.0 and yy > 0.0):
        return None
    slopes = np.linalg.lstsq(gram, xy, rcond=1e-9)[0]
    freedom, used = float(n.sum() - len(n)), len(every)
    size = min(math.sqrt(max(float(slopes @ xy), 0.0) / yy), 0.999999)
    rho = math.copysign(size, slopes[0]) if used == 1 else size
    error = 1.0 / math.sqrt(max(freedom - used - 1.0, 1.0))
    middle, shares = math.atanh(size), more / (n + more)
    least = error * math.sqrt(chdtri(used, 1.0 - CONFIDENCE))
    # Without each start in turn (a jackknife): tails may be heavy, and a start may move all agents alike.
    less = np.sqrt(both * (n / (n - 1.0))[:, None])
    dx, dy = dx * less, dy * less
    grams, crosses = gram - np.einsum("ian,jan->nij", dx, dx), xy - np.einsum("ian,an->ni", dx, dy)
    explained = np.einsum("ni,nij,nj->n", crosses, np.linalg.pinv(grams, rcond=1e-9, hermitian=True), crosses)
    sizes = np.sqrt(np.clip(explained / np.maximum(yy - (dy * dy).sum(axis=0), 1e-12 * yy), 0.0, 0.999998))
    spread = math.sqrt((len(shared) - 1.0) * float(np.arctanh(sizes).var()))
    half = spread * math.sqrt(used * fdtri(used, len(shared) - 1.0, CONFIDENCE))
    counted = np.concatenate([both, met[:, len(shared) :]], axis=1)
    everything = np.nanmean(np.where(counted, x, np.nan), axis=-1)
    rest = np.full((len(agents), len(other.episodes)), np.nan)
    rest[:, [label in known for label in other.episodes]] = y - np.einsum("i,ian->an", slopes, paired)
    means = np.nanmean(y, axis=1) - slopes @ (np.nanmean(paired, axis=-1) - everything)
    return _Pairs(
        means=means,
        counts=target.counts.astype(np.float64),
        correlation=rho,
        beyond_noise=bool(shares.mean() > 0.0 and middle > least),
        likely=(math.tanh(max(0.0, middle - half)) ** 2, math.tanh(middle + half) ** 2),
        square=max(0.0, 1.0 - (1.0 - rho**2) * freedom / max(freedom - used, 1.0)),
        sure_square=math.tanh(max(0.0, middle - error)) ** 2,
        rest=rest,
        shares=shares,
    )


def _variances(table: ScoreTable, column: int) -> Floats:
    """Variance of a rollout of each agent: of successes by their rate with two of each kind added, else pooled."""
    values, share = table.values[..., column], independence(table, column)
    if np.isin(values[table.driven], (0.0, 1.0)).all():
        # Two of each kind are the z²/2 of Agresti and Coull (1998): with one, intervals over few hold 92 %.
        rates = (share * np.nansum(values, axis=1) + 2.0) / (share * table.counts + 4.0)
        return np.asarray(rates * (1.0 - rates), dtype=np.float64)
    squares = np.nansum((values - np.nanmean(values, axis=1, keepdims=True)) ** 2)
    return np.full(len(table.agents), squares / max(1.0, float(table.counts.sum() - (1.0 / share).sum())))


def _common_share(table: ScoreTable, column: int) -> float:
    """The share of the variance of scores that starts make by moving all agents alike; 0 where agents share none."""
    starts = by_start(table)
    agents, count = starts.values.shape[:2]
    if not starts.complete or count < 2:
        return 0.0
    residuals = starts.values[..., column] - starts.means[:, [column]]
    own = residuals - residuals.mean(axis=0)
    whole = float((residuals**2).sum()) / agents
    return min(max(1.0 - float((own**2).sum()) / (agents - 1) / whole, 0.0), 0.999) if whole > 0.0 else 0.0


def _with_ends(table: ScoreTable, column: int, means: Floats, counts: Floats) -> dict[str, tuple[float, Ends]]:
    """Means with their 95 % intervals: of rates as rates have them, else by Student's t."""
    share = independence(table, column)
    counts = counts * share
    if is_rate(table, column):
        return {
            agent: (float(mean), ends)
            for agent, mean, ends in zip(table.agents, means, rate_intervals(means, counts), strict=True)
        }
    from scipy.special import stdtrit

    freedom = max(1.0, float((share * table.counts).sum() - len(table.agents)))
    wider = float(stdtrit(freedom, 0.5 + CONFIDENCE / 2.0)) / NORMAL
    return _normal(table.agents, means, np.asarray(wider * np.sqrt(_variances(table, column) / counts)))


def _normal(agents: tuple[str, ...], means: Floats, errors: Floats) -> dict[str, tuple[float, Ends]]:
    rows = zip(agents, means, errors, strict=True)
    return {agent: (float(m), (float(m - NORMAL * s), float(m + NORMAL * s))) for agent, m, s in rows}


def _of_policies(every: Sequence[Comparison], column: int, real: float, simulated: float) -> Saving:
    """By what the proxies' means foretell of the target's, over agents."""
    inputs, agents = every[0], every[0].agents
    proxies, target = np.stack([one.means[0][:, column] for one in every], axis=1), inputs.means[1][:, column]
    fewest = FEWEST_AGENTS + len(every) - 1
    if len(agents) < fewest or np.ptp(proxies, axis=0).min() <= 0.0:
        few = f"there are fewer than {fewest} agents"
        what = few if len(agents) < fewest else "all agents score alike in the proxy"
        return Saving("none", None, None, None, real, simulated, reason=f"too few starts are paired, and {what}")
    counts = inputs.target.counts.astype(np.float64)
    variances = _variances(inputs.target, column) / (counts * independence(inputs.target, column))
    if not (variances > 0.0).all():
        return Saving("none", None, None, None, real, simulated, reason="the target's rollouts do not differ")
    # What starts do to all agents alike tells them not apart, and no model over agents takes it off.
    common, ones = _common_share(inputs.target, column) * variances, np.ones(len(agents))
    design = np.column_stack([ones, proxies - proxies.mean(axis=0)])
    means, spread, ends = _shrunken(target, variances - common, design)
    _, without, _ = _shrunken(target, variances - common, ones[:, None])
    spread, without = spread + common, without + common
    worth = float((counts * (variances / spread - variances / without)).mean())
    low, high = (float((counts * (variances / (end + common) - variances / without)).mean()) for end in ends)
    one = len(every) == 1 and np.ptp(target) > 0.0
    r = float(np.corrcoef(proxies[:, 0], target)[0, 1]) if one else None
    return Saving(
        "policies", max(worth, 0.0), (max(min(low, high), 0.0), max(low, high, 0.0)), r, real, simulated,
        _normal(agents, means, np.sqrt(spread)), _normal(agents, target, np.sqrt(variances)),
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
