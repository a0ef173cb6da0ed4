"""What more episodes would come to: PRPV and PPV expected of a proxy, and what a perfect proxy scores beside it.

An agent from one start does nearly the same each time. The noise of PRPV is a few cells (agent, start) that turn out
one way or the other, as by a crash, and break or make ties; starts do not vary between repeats, so resampling them says
nothing of it. What is known of noise are pairs: cells that were driven twice from the same start (`donors_of`). A cell
is repeated by the change of one of the pairs most like it (`Donors.again`), each cell by itself.

    expected    mean v ± t √(s²/m),    v = PRPV(P, T) of m fresh tables, which is unbiased; s by P repeated
    floor       the quantiles of f = PRPV(T repeated, T): what a perfect proxy scores against this target
    excess      mean v − mean f ± z √(s²/m + var f)

s² pools the variance of the fresh scores with that of repeated tables, which counts as ten more. PPV likewise. Where a
proxy draws nothing, the target's repeats are the donors, or where there are none its episodes from different starts,
which overstate noise: then a proxy is not called imperfect for that.
"""

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from proxytune.arrays import NORMAL_95, Flags, Floats, Whole
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, by_start, compare, start_places
from proxytune.usefulness.decision import Difference
from proxytune.usefulness.noise import NoiseFloor, floor_of_halves
from proxytune.usefulness.predictivity import ppv, ppv_of_means
from proxytune.usefulness.resampling import BLOCK, interval, prpv_in_blocks

NEAREST = 24
"""Pairs most like a cell, one of which is drawn to repeat it."""
DRAWS = 400
MOST_DONORS = 2000
"""Of a target's own repeats so many tell of its noise; more take long."""
ATOM = 0.05
"""A value that more than this share of all cells have is one that agents end up at, as the time limit."""
OTHER_ATOMS = 10.0
"""How far, in ranks, a pair at other such values is off."""
MODELLED = 10.0
"""The variance of repeated tables counts as so many fresh ones."""


class Estimate(NamedTuple):
    """A figure and the ends of its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Donors:
    """Cells (pairs, metrics) that were driven twice from the same start; every pair is there both ways round."""

    first: Floats
    second: Floats

    @property
    def still(self) -> bool:
        """True if nothing changes from one time to the other, or nothing was driven twice."""
        return np.array_equal(self.first, self.second)

    @cached_property
    def _sorted(self) -> Floats:
        return np.sort(self.first, axis=0)

    def _ranks(self, cells: Floats) -> Floats:
        """Where cells lie among the pairs' in each metric, 0 to 1; the middle of equal ones."""
        sides = [
            [np.searchsorted(known, own, side=side) for side in ("left", "right")]
            for known, own in zip(self._sorted.T, cells.T, strict=True)
        ]
        return np.asarray(np.mean(sides, axis=1).T / len(self.first))

    def _atoms(self, cells: Floats) -> Floats:
        """In each metric, the value that many cells share; NaN of all other values."""
        found = np.full(cells.shape, np.nan)
        for column, known in enumerate(self.first.T):
            values, counts = np.unique(known, return_counts=True)
            shared = np.isin(cells[:, column], values[counts > ATOM * len(known)])
            found[shared, column] = cells[shared, column]
        return found

    def again(self, cells: Floats, rng: np.random.Generator, draws: int = DRAWS) -> Floats:
        """Repeat cells (cells, metrics) so many times: (draws, cells, metrics).

        Each takes the change of one of its nearest pairs: another outcome where that changed to or from a value that
        many share; else its difference, within the range of all.
        """
        own, before, after = (self._atoms(each) for each in (cells, self.first, self.second))
        size = max(1, BLOCK // self.first.size)
        rows = [slice(start, start + size) for start in range(0, len(cells), size)]
        near = np.concatenate([self._nearest(cells[some], own[some], before, rng) for some in rows])
        chosen = near[np.arange(len(cells)), rng.integers(near.shape[1], size=(draws, len(cells)))]
        turned = np.asarray(~_same(before, after).all(axis=-1))[chosen]
        moved = np.clip(cells + self.second[chosen] - self.first[chosen], self._sorted[0], self._sorted[-1])
        moved = np.where(np.isnan(own), moved, cells)
        return np.where(turned[..., None], self.second[chosen], moved)

    def _nearest(self, cells: Floats, atoms: Floats, before: Floats, rng: np.random.Generator) -> Whole:
        """The places of the pairs most like each cell, equal ones in random order."""
        apart = np.abs(self._ranks(cells)[:, None] - self._ranks(self.first)).sum(axis=-1)
        other = ~_same(atoms[:, None], before).all(axis=-1)
        apart += OTHER_ATOMS * other + 1e-6 * rng.random(apart.shape)
        count = min(NEAREST, len(self.first))
        return np.argpartition(apart, count - 1, axis=1)[:, :count]


def _same(one: Floats, other: Floats) -> Flags:
    return np.asarray((one == other) | (np.isnan(one) & np.isnan(other)), dtype=np.bool_)


def donors_of(pairs: Iterable[Floats], metrics: int) -> Donors:
    """Gather what is known of noise: arrays (2, …, metrics) of the same cells driven twice, NaN where one failed."""
    flat = [np.reshape(pair, (2, -1, metrics)) for pair in pairs]
    both = np.concatenate([np.empty((2, 0, metrics)), *flat], axis=1)
    both = both[:, ~np.isnan(both).any(axis=(0, 2))]
    return Donors(np.concatenate([both[0], both[1]]), np.concatenate([both[1], both[0]]))


@dataclass(frozen=True)
class Expected:
    """One measure in more episodes."""

    value: Estimate  # what is expected of fresh ones
    floor: Estimate | None  # what a perfect proxy scores, and where 95 % of its scores lie; None if noise is not known
    excess: Estimate | None  # the value's over the floor; None likewise


@dataclass(frozen=True, eq=False)
class Expectation:
    """What is expected of a proxy in more episodes, from so many fresh tables; PPV is None where it is undefined.

    PRPV has this standard deviation from one table to the next.
    """

    prpv: Expected
    ppv: Expected | None
    repetitions: int
    deviation: float
    floor: NoiseFloor


def expect(
    *, fresh: Sequence[ScoreTable], target: ScoreTable, metrics: Sequence[Metric], donors: Donors, seed: int = 0
) -> Expectation:
    """What a proxy and a perfect one are expected to score against this target.

    The fresh tables, a repetition each, are of episodes that nothing was chosen by; metrics are in the donors' order.
    """
    rng, sides = np.random.default_rng(seed), [compare(proxy=one, target=target, metrics=metrics) for one in fresh]
    means, known = sides[0].target.means, len(donors.first) > 0
    proxies = np.stack([side.proxy.means for side in sides])
    draws = [np.nanmean(_again(one.proxy, donors, rng), axis=2) for one in sides] if known else []
    of_target = _donors_within(sides[0].target) if donors.still else donors
    perfect = _perfect(sides[0], of_target, rng) if len(of_target.first) else None
    weights = ppv(sides[0]).beta
    beta = np.array([weights[metric.name] or 0.0 for metric in metrics])

    most, all_of = float(len(means) * (len(means) - 1)), partial(_expected, proxies, draws, perfect)
    counted, deviation = all_of(lambda it: prpv_in_blocks(it, np.broadcast_to(means, it.shape), metrics), most)
    level = counted.floor
    unknown = NoiseFloor("none", reason="noise is not known: nothing was driven twice")
    floor = NoiseFloor("same starts", *level) if level else unknown
    error = all_of(lambda it: ppv_of_means(it, means, beta), np.inf)[0] if beta.any() else None
    return Expectation(counted, error, len(fresh), deviation, floor)


def noise_floor(inputs: Comparison, seed: int = 0) -> NoiseFloor:
    """What a perfect proxy, driven as this one was, scores against this target.

    From the target's starts, if it has two repeats of each, the target's cells are repeated. From other starts two
    halves of the target's are compared.
    """
    in_proxy, on_target = (int(np.bincount(start_places(side)).min()) for side in (inputs.proxy, inputs.target))
    if not inputs.paired or on_target < 2:
        return floor_of_halves(target=inputs.target, metrics=inputs.metrics, seed=seed)
    rng, donors = np.random.default_rng(seed), _donors_within(inputs.target)
    some = rng.permutation(len(donors.first))[:MOST_DONORS]
    donors, times = Donors(donors.first[some], donors.second[some]), min(in_proxy, on_target)
    perfect = np.mean([_perfect(inputs, donors, rng, times) for _ in range(times)], axis=0)
    known = np.broadcast_to(by_start(inputs.target).means, perfect.shape)
    levels = prpv_in_blocks(perfect, known, inputs.metrics)
    return NoiseFloor("same starts", float(levels.mean()), *interval(levels))


def _donors_within(target: ScoreTable) -> Donors:
    """The target's starts driven twice, or where there are none its episodes from different starts."""
    places = start_places(target)
    two = np.array([(a, b) for a in range(len(places)) for b in range(a)], dtype=np.intp).reshape(-1, 2)
    alike = two[places[two[:, 0]] == places[two[:, 1]]]
    chosen = (alike if len(alike) else two).T
    return donors_of([np.moveaxis(target.values[:, chosen], 1, 0)], target.values.shape[-1])


def expected_differences(proxies: Mapping[str, Expectation]) -> tuple[Difference, ...]:
    """How much lower the PRPV expected of one proxy is than another's, of every two against one target.

    The better one comes first; the intervals hold for all pairs at once.
    """
    from scipy.stats import norm

    pairs = list(itertools.combinations(sorted(proxies, key=lambda name: proxies[name].prpv.value.value), 2))
    reach = float(norm.ppf(1.0 - 0.025 / max(1, len(pairs))))
    found = []
    for better, worse in pairs:
        two = proxies[better], proxies[worse]
        more = two[1].prpv.value.value - two[0].prpv.value.value
        half = reach * float(np.sqrt(sum(one.deviation**2 / one.repetitions for one in two)))
        known = all(one.prpv.excess for one in two)
        found.append(Difference(better, worse, more, *((more - half, more + half) if known else (None, None))))
    return tuple(found)


def _expected(
    proxies: Floats, draws: Sequence[Floats], perfect: Floats | None, measure: Callable[[Floats], Floats], most: float
) -> tuple[Expected, float]:
    """A measure of fresh tables (m, agents, metrics), and its standard deviation from one to the next."""
    # Loading scipy.stats takes longer than all else of most commands.
    from scipy.stats import t as student

    values, m = measure(proxies), len(proxies)
    modelled = float(np.mean([measure(each).var() for each in draws])) if draws else 0.0
    own, counts = float(values.var(ddof=1)) if m > 1 else 0.0, m - 1 + MODELLED * bool(draws)
    middle = float(values.mean())
    if not counts:
        # Nothing tells of noise.
        return Expected(Estimate(middle, 0.0, most), None, None), 0.0
    variance = ((m - 1) * own + MODELLED * modelled) / counts
    reach = float(student.ppf(0.975, counts)) if m > 1 else NORMAL_95
    half = reach * np.sqrt(variance / m)
    value = Estimate(middle, max(0.0, middle - half), min(most, middle + half))
    if perfect is None:
        return Expected(value, None, None), float(np.sqrt(variance))
    levels = measure(perfect)
    more, wide = middle - float(levels.mean()), NORMAL_95 * np.sqrt(variance / m + levels.var())
    floor = Estimate(float(levels.mean()), *interval(levels))
    return Expected(value, floor, Estimate(more, more - wide, more + wide)), float(np.sqrt(variance))


def _again(table: ScoreTable, donors: Donors, rng: np.random.Generator) -> Floats:
    """The cells of a table repeated: (draws, agents, episodes, metrics)."""
    driven = table.driven
    values = np.full((DRAWS, *table.values.shape), np.nan)
    values[:, driven] = donors.again(table.values[driven], rng)
    return values


def _perfect(sides: Comparison, donors: Donors, rng: np.random.Generator, times: int = 1) -> Floats:
    """Mean scores of a perfect proxy: the target's cells repeated, each start once, by one of its repeats.

    So many times that their mean is to be off the target's as that of as many new repeats.
    """
    places = start_places(sides.target)
    count = int(places.max()) + 1
    keys = rng.random((DRAWS, len(places)))
    each = np.stack([np.where(places == start, keys, -1.0).argmax(axis=1) for start in range(count)], axis=1)
    # From other starts it meets starts like the target's: as many of them, drawn with replacement.
    if not sides.paired:
        drawn = rng.integers(count, size=(DRAWS, len(sides.proxy.episodes)))
        each = np.take_along_axis(each, drawn, axis=1)
    values = _again(sides.target, donors, rng)
    # The mean of n new repeats of a cell is off that of R by (1/n + 1/R) of its variance, that of n drawn of the R by
    # (1 − 1/R)/n, and a change is 2: so (n + 1)/2 in R change.
    alike = rng.random(values.shape[:3]) >= (times + 1) / 2.0 / np.bincount(places)[places]
    values = np.where(alike[..., None], sides.target.values, values)
    chosen = np.take_along_axis(values, each[:, None, :, None], axis=2)
    # An agent that was driven from none of the starts drawn keeps its mean.
    missing = np.isnan(chosen).all(axis=2, keepdims=True)
    return np.asarray(np.nanmean(np.where(missing, sides.target.means[:, None], chosen), axis=2))
