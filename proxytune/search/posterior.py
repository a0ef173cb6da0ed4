"""The posterior of θ over the search box, its 95 % credible region, and a test whether any θ explains the target.

Both are calibrated by leaving each trial out in turn and taking it for a target (`leave_out`): what a search would say
of it, where the truth is known. The trials are from the proxy itself, so each of them, given the noise of a target, is
a target that the proxy can make. How often the region that the others give holds its θ says how wide a region has to
be. How far it is from what the others predict at its most probable θ says how far a target may be (`misfit_of`).
Nothing is assumed of how outputs correlate.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import t as student

from proxytune.arrays import Floats
from proxytune.search.engine import to_unit, unit_points
from proxytune.search.likelihood import Likelihood, OutputModel, deviance, fit_outputs
from proxytune.search.loop import Goal, Trial

CREDIBLE_LEVEL = 0.95
REGION_POINTS = 4096
ZOOMS = 8
DEPTH = 12.0
"""What lies so far below the largest log density holds nothing that counts."""
PAD = 0.1
"""Of the width of what counts, left round it at every zoom."""
MOST_OF = 0.8
"""A box that keeps more than this of its volume is not worth another look."""
TRADE = 0.6
"""Parameters that correlate by more in the posterior make up for each other."""
EDGE = 0.01
"""An interval that ends nearer to an end of the box reaches it: points are no denser."""
UNIDENTIFIED = 0.9
"""A parameter whose interval fills more of its range than this is not identified."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """θ given the target's outputs, uniform over the box before: points of equal volume with their densities.

    Points (n, parameters) lie evenly over the part of the unit cube that counts, of this volume; densities are
    logarithms up to a constant.
    """

    points: Floats
    density: Floats
    volume: float

    @cached_property
    def weights(self) -> Floats:
        """Probability of each point; they add up to 1."""
        weights = np.exp(self.density - self.density.max())
        return np.asarray(weights / weights.sum())

    @cached_property
    def threshold(self) -> float:
        """The density down to which the most probable points hold 95 %."""
        order = np.argsort(-self.density, kind="stable")
        reached = int(np.searchsorted(np.cumsum(self.weights[order]), CREDIBLE_LEVEL))
        return float(self.density[order[min(reached, len(order) - 1)]])

    @cached_property
    def inside(self) -> Floats:
        """The points that are in the region, as truth values."""
        return np.asarray(self.density >= self.threshold)

    @property
    def share(self) -> float:
        """The region's share of the box."""
        return float(self.inside.mean() * self.volume)

    @property
    def mode(self) -> Floats:
        """The most probable point."""
        return np.asarray(self.points[int(np.argmax(self.density))])

    @property
    def mean(self) -> Floats:
        """The mean of θ."""
        return np.asarray(self.weights @ self.points)

    @property
    def covariance(self) -> Floats:
        """The covariance of θ."""
        away = self.points - self.mean
        return np.asarray((self.weights[:, None] * away).T @ away)

    @cached_property
    def intervals(self) -> Floats:
        """The central 95 % of every parameter, shape (parameters, 2), and an end of the box that is as probable.

        Central ones leave 2.5 % out at either end, so they never hold an end of the box, where a delay of 0 lies. It
        is held where the shortest interval with 95 % reaches it.
        """

        def ends(values: Floats) -> tuple[float, float]:
            order = np.argsort(values, kind="stable")
            values, below = values[order], np.append(0.0, np.cumsum(self.weights[order]))
            firsts = np.flatnonzero(below + CREDIBLE_LEVEL <= below[-1])
            lasts = np.searchsorted(below[1:], below[firsts] + CREDIBLE_LEVEL)
            shortest = int(np.argmin(values[lasts] - values[firsts]))
            low, high = values[np.searchsorted(below[1:], ((1.0 - CREDIBLE_LEVEL) / 2.0, (1.0 + CREDIBLE_LEVEL) / 2.0))]
            at_low, at_high = values[firsts[shortest]] < EDGE, values[lasts[shortest]] > 1.0 - EDGE
            return (0.0 if at_low else low, 1.0 if at_high else high)

        return np.array([ends(column) for column in self.points.T])

    @cached_property
    def unidentified(self) -> Floats:
        """The parameters that are not identified, as truth values."""
        return np.asarray(np.diff(self.intervals, axis=1)[:, 0] > UNIDENTIFIED)

    @property
    def trades(self) -> tuple[tuple[int, int, float], ...]:
        """Pairs of parameters that make up for each other, with their correlation."""
        covariance = self.covariance
        size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        matrix = covariance / np.outer(size, size)
        pairs = [(i, j, float(matrix[i, j])) for i in range(len(size)) for j in range(i)]
        return tuple((j, i, found) for i, j, found in pairs if abs(found) > TRADE)

    def draw(self, seed: int) -> Floats:
        """A point drawn from the posterior, moved within the volume that it stands for."""
        generator = np.random.default_rng(seed)
        row = int(generator.choice(len(self.points), p=self.weights))
        reach = (self.volume / len(self.points)) ** (1.0 / self.points.shape[1]) / 2.0
        return np.asarray(np.clip(self.points[row] + generator.uniform(-reach, reach, self.points.shape[1]), 0.0, 1.0))


def posterior_of(log_density: Callable[[Floats], Floats], dimensions: int, count: int = REGION_POINTS) -> Posterior:
    """Look at the whole box, then ever closer at the box round what counts, by so many points each time."""
    low, high, cloud = np.zeros(dimensions), np.ones(dimensions), unit_points(dimensions, count, 0)
    for _ in range(ZOOMS):
        points = low + (high - low) * cloud
        density = log_density(points)
        near = points[density > density.max() - DEPTH]
        between = 0.5 * (high - low) / len(points) ** (1.0 / points.shape[1])
        reach = PAD * np.ptp(near, axis=0) + between
        inner_low, inner_high = np.maximum(low, near.min(axis=0) - reach), np.minimum(high, near.max(axis=0) + reach)
        if np.prod(inner_high - inner_low) > MOST_OF * np.prod(high - low):
            break
        low, high = inner_low, inner_high
    points = low + (high - low) * cloud
    return Posterior(points, log_density(points), float(np.prod(high - low)))


MOST = 72
"""So many trials at most are left out, spread evenly over the box. Time grows with it; but 24 know the spread of their
deviances so badly that a bank of 200 trials misses tyres that scrub in 2 of 4 targets, with 72 in none."""
FEWEST = 6
"""Fewer say nothing."""
DEVIANCE_POINTS = 1024
WIDENINGS = (1.0, 1.25, 1.5, 2.0, 3.0, 4.0)
HELD = 0.9
"""Share of left-out trials that regions have to hold: of 24, one may miss 95 % regions by chance, and a second."""
MARGIN = 1.25
"""Regions are wider by so much again: trials of a search lie close together, a target where it has not looked.

Of 46 searches of five engines for nine truths, regions held the truth in 40 without it, in 43 with it, in 45 with 1.5.
"""


@dataclass(frozen=True, eq=False)
class AsTarget:
    """A trial that is taken for a target, with a target's noise, as the other trials explain it."""

    theta: Floats
    likelihood: Likelihood

    @cached_property
    def posterior(self) -> Posterior:
        """What the others say of its θ."""
        return posterior_of(self.likelihood.log, len(self.theta), DEVIANCE_POINTS)

    def above(self, widening: float) -> float:
        """Probability of all θ more probable than its own, with the log density divided by so much."""
        density, own = self.posterior.density, float(self.likelihood.log(self.theta[None])[0])
        weights = np.exp((density - density.max()) / widening)
        return float(weights[density > own].sum() / weights.sum())

    def widths(self, widening: float) -> Floats:
        """Widths of the 95 % intervals that the others give, in widths of the box."""
        return np.diff(replace(self.posterior, density=self.posterior.density / widening).intervals)[:, 0]


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Trials that were left out, each as a target whose θ is known.

    `deviances` are mean ones at their most probable θ (trials,), `above` the probability of all θ more probable than
    their own (trials, widenings).
    """

    deviances: Floats
    above: Floats

    @property
    def enough(self) -> bool:
        """True if there are enough of them to say anything."""
        return len(self.deviances) >= FEWEST

    @property
    def widening(self) -> float:
        """The further divisor of the log density, so that 95 % regions hold as many targets as they should."""
        if not self.enough:
            return MARGIN
        held = (self.above <= CREDIBLE_LEVEL).mean(axis=0)
        enough = (one for one, share in zip(WIDENINGS, held, strict=True) if share >= HELD)
        return MARGIN * next(enough, WIDENINGS[-1])


def leave_out(model: OutputModel, trials: Sequence[Trial], goal: Goal, seed: int) -> LeftOut:
    """Leave out trials that know every output, one at a time; a function of the set of trials and the seed.

    The model's kernel is kept; outputs that the target lacks tell nothing here either; the seed draws a target's noise.
    """
    return left_out_of(as_targets(model, trials, goal, seed))


def left_out_of(targets: Iterable[AsTarget]) -> LeftOut:
    """Sum up trials that were taken for targets."""
    told = [(least_deviance(one.likelihood, one.posterior), [one.above(w) for w in WIDENINGS]) for one in targets]
    return LeftOut(np.array([one[0] for one in told]), np.array([one[1] for one in told]).reshape(-1, len(WIDENINGS)))


def as_targets(
    model: OutputModel, trials: Sequence[Trial], goal: Goal, seed: int, most: int = MOST
) -> Iterator[AsTarget]:
    """Take each of the trials that `leave_out` leaves out for a target, at most so many of them."""
    known = sorted((trial for trial in trials if trial.outcome is not None), key=lambda trial: trial.values)
    whole = [row for row, one in enumerate(known) if not one.low_fidelity and not np.isnan(one.outcome or ()).any()]
    normal = np.random.default_rng(seed).standard_normal((len(known), len(goal.values)))
    places = np.unique(np.linspace(0, max(0, len(whole) - 1), most).round().astype(int)).tolist()
    for row in [whole[place] for place in places] if len(whole) >= FEWEST else []:
        # Not of the same θ under another placement either, which would tell too much.
        elsewhere = [trial for trial in known if trial.low_fidelity or trial.values != known[row].values]
        others = fit_outputs(model.space, elsewhere, model.kernel)
        outcome = np.array(known[row].outcome) + normal[row] * np.sqrt(goal.noise)
        likelihood = Likelihood(others, replace(goal, values=np.where(np.isnan(goal.values), np.nan, outcome)))
        if likelihood.columns.size:
            yield AsTarget(to_unit(model.space, known[row].values), likelihood)


def least_deviance(likelihood: Likelihood, posterior: Posterior) -> float:
    """Mean deviance of the target's outputs at the most probable θ."""
    distance, _ = likelihood.standardised(posterior.mode[None])
    return float(deviance(distance).mean())


SIGNIFICANCE = 0.03
"""A p-value below says that no θ explains the target; at 0.05 that was said wrongly of 3 of 40 targets."""
LEAST = 1e-12
"""A deviance of which the logarithm can be taken."""


@dataclass(frozen=True)
class Misfit:
    """The test of whether some θ explains the target's outputs."""

    deviance: float | None  # mean deviance of the target's outputs at its best θ; None where no output tells of θ
    expected: float | None  # the same of trials left out, their middle: what a proxy that fits has
    p_value: float | None  # how likely a proxy that fits is to be as far off; None with too few trials to tell

    @property
    def fits(self) -> bool | None:
        """True if the proxy may have made the target; None where that cannot be told."""
        return None if self.p_value is None else self.p_value >= SIGNIFICANCE

    @property
    def dispersion(self) -> float:
        """How many times farther off the target is than a proxy that fits, where no θ explains it; else 1."""
        if self.fits is not False or self.deviance is None or self.expected is None:
            return 1.0
        return max(1.0, self.deviance / self.expected)


def misfit_of(likelihood: Likelihood, posterior: Posterior, left_out: LeftOut) -> Misfit:
    """Hold the target's deviance at its most probable θ against that of trials left out.

    The logarithms of these are taken for normal, so the p-value is Student's for one more of them.
    """
    if not likelihood.columns.size:
        return Misfit(None, None, None)
    found = least_deviance(likelihood, posterior)
    if not left_out.enough:
        return Misfit(found, None, None)
    ours = np.log(left_out.deviances + LEAST)
    spread = max(float(ours.std(ddof=1)), 1e-9) * np.sqrt(1.0 + 1.0 / len(ours))
    away = (np.log(found + LEAST) - ours.mean()) / spread
    return Misfit(found, float(np.exp(ours.mean())), float(student.sf(away, len(ours) - 1)))
