"""Knowledge of θ, learnt from every output of a search's trials: the answer, its region, and whether the model fits.

`Knowledge` puts together the likelihood of the target's outputs (likelihood.py), the posterior of θ and the misfit
(posterior.py). `information_of` says which agents tell what of a parameter, and what stands between them and a sharper
answer; `importances` how much each parameter matters to the score over the whole search box, as the surrogate has it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from proxytune.arrays import Floats, one_thread
from proxytune.search.engine import from_unit, to_unit, unit_points
from proxytune.search.likelihood import Likelihood, OutputModel, fit_outputs
from proxytune.search.loop import Goal, Trial, Values
from proxytune.search.outcomes import composed_scores, fresh_scores
from proxytune.search.posterior import (
    LeftOut,
    Misfit,
    Posterior,
    as_targets,
    leave_out,
    left_out_of,
    misfit_of,
    posterior_of,
)
from proxytune.search.surrogate import Surrogate, unit_array
from proxytune.space import Space

STEP = 0.02
"""In widths of the box, to both sides."""
Limit = Literal["trials", "starts"]


@dataclass(frozen=True)
class Information:
    """Information of the outputs on one parameter where θ is most probable."""

    name: str  # the parameter
    # share of each agent in what is told, all its metrics together, most first; they add up to 1
    agents: tuple[tuple[str, float], ...]
    metrics: tuple[tuple[str, float], ...]  # share of each metric, all agents together, most first
    # what keeps more from being told: too few "trials" near the answer, so that the outputs are not known there; or too
    # few "starts", so that their means are rough and noisy
    limit: Limit


def information_of(likelihood: Likelihood, point: Floats) -> tuple[Information, ...]:
    """Information of each output on each parameter at a point of the unit cube: squared slope over variance.

    That is Fisher's information of a normal output; what outputs tell together is not counted twice by taking shares.
    """
    slopes, total = _slopes(likelihood, point), likelihood.standardised(point[None])[1][0]
    _, unknown = likelihood.model.predict(point[None])
    by_trials = unknown[0, likelihood.columns] / total
    names = [likelihood.goal.outputs[column] for column in likelihood.columns]
    found = []
    for name, slope in zip(likelihood.model.space.names, slopes, strict=True):
        told = slope**2 / total
        shares = told / max(float(told.sum()), 1e-300)
        limit: Limit = "trials" if float(shares @ by_trials) > 0.5 else "starts"
        agents, metrics = (_summed([pair[side] for pair in names], shares) for side in (0, 1))
        found.append(Information(name, agents, metrics, limit))
    return tuple(found)


def _slopes(likelihood: Likelihood, point: Floats) -> Floats:
    """The derivative of each output by each parameter, per width of the box, shape (parameters, outputs)."""
    steps = STEP * np.eye(len(point))
    ends = np.clip(np.concatenate([point + steps, point - steps]), 0.0, 1.0)
    mean, _ = likelihood.model.predict(ends)
    above, below = mean[:, likelihood.columns].reshape(2, len(point), -1)
    width = np.diag(ends[: len(point)] - ends[len(point) :])
    return np.asarray((above - below) / width[:, None])


def _summed(names: Sequence[str], shares: Floats) -> tuple[tuple[str, float], ...]:
    sums: dict[str, float] = {}
    for name, share in zip(names, shares, strict=True):
        sums[name] = sums.get(name, 0.0) + float(share)
    return tuple(sorted(sums.items(), key=lambda pair: (-pair[1], pair[0])))


Ends = tuple[float, float]
REPORTED = 16384
"""Points of the posterior that is reported: four times as many as a draw takes, so that small regions are smooth."""
EXPECTED_FROM = 24
"""At most so many trials are taken for targets to expect what one will tell."""
UPPER = 97.5
"""Percentile of fresh scores of the answer, up to which another θ cannot be told from it."""


@dataclass(frozen=True, eq=False)
class Knowledge:
    """All that finished trials say of θ; everything is a function of them, the goal and the seed."""

    model: OutputModel  # of every output
    goal: Goal  # the target
    trials: tuple[Trial, ...]  # what it was learnt from
    seed: int  # seeds what is drawn

    def of(self, goal: Goal) -> "Knowledge":
        """What the same outputs of the same trials say of another target: calibrated once where noise is the same.

        Scores of trials stay those against the first target: take θ from it, no answer.
        """
        other = replace(self, goal=goal)
        both = ((one.noise, np.isnan(one.values)) for one in (goal, self.goal))
        if all(np.array_equal(*pair) for pair in zip(*both, strict=True)):
            vars(other)["left_out"] = self.left_out
        return other

    @property
    def space(self) -> Space:
        """The search box."""
        return self.model.space

    @cached_property
    def likelihood(self) -> Likelihood:
        """The likelihood by which any θ explains the target's outputs."""
        return Likelihood(self.model, self.goal)

    @cached_property
    def left_out(self) -> LeftOut:
        """The trials as predicted by each other."""
        return leave_out(self.model, self.trials, self.goal, self.seed)

    def log(self, points: Floats) -> Floats:
        """Log density of θ at points (n, parameters) of the unit cube, up to a constant.

        Wider than the likelihood where its regions do not hold as many left-out trials as they should. Where no θ
        explains the target, wider by its dispersion, as a quasi-likelihood is (McCullagh and Nelder, Generalized linear
        models, 1989, chapter 9): outputs are off by more than the model's noise at every θ, so also at the true one.
        """
        return self._log_if_it_fits(points) / self.misfit.dispersion

    @cached_property
    def posterior(self) -> Posterior:
        """θ given the target's outputs, over the unit cube."""
        if self.misfit.dispersion == 1.0:
            return self._posterior_if_it_fits
        return posterior_of(self.log, len(self.space.intervals), REPORTED)

    @cached_property
    def unwidened(self) -> Posterior:
        """θ by the likelihood as it is, for sums in which errors that are told too large are not on the safe side.

        Of 72 simulated robots, errors were 0.7 to 1.3 times the standard deviation that it gives, by parameter.
        """
        return posterior_of(self.likelihood.log, len(self.space.intervals), REPORTED)

    @cached_property
    def values(self) -> Floats:
        """The posterior's points in the parameters' own units (n, parameters), as probable as its weights say."""
        low, high = np.transpose([(box.low, box.high) for box in self.space.intervals])
        return np.asarray(low + (high - low) * self.posterior.points)

    def draw(self, count: int, seed: int) -> Floats:
        """Draw values of θ from the posterior (count, parameters): how parameters vary together is in them."""
        weights = self.posterior.weights
        rows = np.random.default_rng(seed).choice(len(weights), size=count, p=weights)
        return np.asarray(self.values[rows])

    def _log_if_it_fits(self, points: Floats) -> Floats:
        return self.likelihood.log(points) / self.left_out.widening

    @cached_property
    def _posterior_if_it_fits(self) -> Posterior:
        return posterior_of(self._log_if_it_fits, len(self.space.intervals), REPORTED)

    @property
    def intervals(self) -> Mapping[str, Ends]:
        """The 95 % interval of every parameter."""
        low, high = (from_unit(self.space, ends) for ends in self.posterior.intervals.T)
        return {name: (low[row], high[row]) for row, name in enumerate(self.space.names)}

    @property
    def unidentified(self) -> tuple[str, ...]:
        """The parameters whose interval fills more than 0.9 of their range."""
        pairs = zip(self.space.names, self.posterior.unidentified, strict=True)
        return tuple(name for name, flag in pairs if flag)

    @property
    def trades(self) -> tuple[tuple[str, str, float], ...]:
        """Pairs of parameters that make up for each other, with their correlation."""
        names = self.space.names
        return tuple((names[i], names[j], value) for i, j, value in self.posterior.trades)

    def holds(self, values: Values) -> bool:
        """Tell whether a θ is in the 95 % region, which ends where the box does."""
        within = all(box.low <= value <= box.high for box, value in zip(self.space.intervals, values, strict=True))
        return within and bool(self.log(to_unit(self.space, values)[None])[0] >= self.posterior.threshold)

    def scores(self, points: Sequence[Values]) -> tuple[Floats, Floats]:
        """Mean and standard deviation of what PRPV is expected to be at points of the box, rough and noise left out."""
        drawn = self._drawn(unit_array(self.space, points))
        return drawn.mean(axis=0), drawn.std(axis=0)

    def _drawn(self, unit: Floats) -> Floats:
        return composed_scores(self.model, self.goal, self.seed)(unit)

    @cached_property
    def expected(self) -> Mapping[Values, float]:
        """PRPV that is expected of each visited θ in fresh episodes, the lowest first.

        The mean of its trial's score and of what the outputs of all trials are composed to. Of 552 θ on a simulator
        this was nearer to fresh episodes (root mean square 3.5) than either (3.6 and 3.9).
        """
        return self.expected_of({trial.values: trial.score for trial in self.trials if trial.score is not None})

    def expected_of(self, own: Mapping[Values, float]) -> Mapping[Values, float]:
        """PRPV that is expected of θ that scored so, as `expected` has it of those visited."""
        visited = sorted(own)
        composed, _ = self.scores(visited)
        both = {values: (own[values] + float(one)) / 2.0 for values, one in zip(visited, composed, strict=True)}
        return dict(sorted(both.items(), key=lambda pair: pair[1]))

    @property
    def answer(self) -> Values:
        """The visited θ of lowest expected PRPV."""
        return next(iter(self.expected))

    @property
    def mode(self) -> Values:
        """The most probable θ, visited or not."""
        return from_unit(self.space, self.posterior.mode)

    @property
    def mean(self) -> Values:
        """The posterior's mean, visited or not."""
        return from_unit(self.space, self.posterior.mean)

    def likeliest_of(self, points: Sequence[Values]) -> Values:
        """That of some θ which explains the target's outputs best."""
        return points[int(np.argmax(self.likelihood.log(unit_array(self.space, points))))]

    def fresh_scores(self, values: Values) -> Floats:
        """PRPV that a θ would come to in fresh episodes, as drawn from the model, roughness and noise included."""
        return fresh_scores(self.model, self.goal, to_unit(self.space, values), self.seed)

    @cached_property
    def as_good(self) -> tuple[float, Mapping[str, Ends]]:
        """The θ that PRPV cannot tell from the answer: their share of the box, and the ends of each parameter.

        Their expected PRPV is not above what fresh episodes of the answer come to in 97.5 % of cases.
        """
        limit = float(np.percentile(self.fresh_scores(self.answer), UPPER))
        box = posterior_of(lambda unit: -np.maximum(0.0, self._drawn(unit).mean(axis=0) - limit), len(self.space.names))
        inside = box.points[box.density == 0.0]
        found = np.vstack([inside, to_unit(self.space, self.answer)])
        low, high = (from_unit(self.space, ends) for ends in (found.min(axis=0), found.max(axis=0)))
        ends = {name: (low[row], high[row]) for row, name in enumerate(self.space.names)}
        return len(inside) / len(box.points) * box.volume, ends

    @cached_property
    def misfit(self) -> Misfit:
        """The test of whether any θ explains the target."""
        return misfit_of(self.likelihood, self._posterior_if_it_fits, self.left_out)

    @cached_property
    def information(self) -> tuple[Information, ...]:
        """Information of agents and metrics on each parameter, in the order of the box."""
        return information_of(self.likelihood, self.posterior.mode)


@dataclass(frozen=True, eq=False)
class Expected:
    """Knowledge of θ that a target not measured yet is expected to give."""

    widths: Floats  # mean width of each parameter's 95 % interval, in widths of the box
    information: tuple[Information, ...]  # each agent's and each metric's mean share in what is told of each parameter


def expect_of(space: Space, trials: Sequence[Trial], goal: Goal, seed: int = 0) -> Expected:
    """Expect what a target will tell: simulated trials are taken for one in turn, with a target's noise.

    The goal's values count for nothing where they are known. A RunError if no trial has an outcome.
    """
    targets = tuple(as_targets(fit_outputs(space, trials), trials, goal, seed, EXPECTED_FROM))
    if not targets:
        return Expected(np.ones(len(space.names)), ())
    widening = left_out_of(targets).widening
    told = zip(*(information_of(one.likelihood, one.theta) for one in targets), strict=True)
    return Expected(np.mean([one.widths(widening) for one in targets], axis=0), tuple(map(_mean_information, told)))


def _mean_information(several: Sequence[Information]) -> Information:
    def mean(side: Sequence[tuple[tuple[str, float], ...]]) -> tuple[tuple[str, float], ...]:
        pairs = [pair for shares in side for pair in shares]
        return _summed([name for name, _ in pairs], np.array([share / len(several) for _, share in pairs]))

    limits = [one.limit for one in several]
    agents, metrics = mean([one.agents for one in several]), mean([one.metrics for one in several])
    limit: Limit = "trials" if 2 * limits.count("trials") > len(limits) else "starts"
    return Information(several[0].name, agents, metrics, limit)


def learn_theta(space: Space, trials: Sequence[Trial], goal: Goal, seed: int = 0) -> Knowledge:
    """Learn what finished trials say of θ, in any order; a RunError if none has an outcome, or no output changes."""
    return Knowledge(fit_outputs(space, trials), goal, tuple(trials), seed)


POINTS = 2048
"""At most so many points for the posterior mean."""
DRAWN_POINTS = 1024
"""At most so many for the functions drawn: these are drawn jointly, which takes the cube of their number."""
DRAWS = 200
LEVELS = (0.025, 0.975)
JITTER = 1e-8


@dataclass(frozen=True)
class Importance:
    """A parameter's share in the variance of the score over the box (Sobol indices, θ uniform)."""

    name: str  # the parameter
    # of the posterior mean's variance, what the parameter takes part in, alone or together with others (the
    # total-effect index): shares add up to 1 where parameters do not interact, and to more where they do
    share: float
    interval: tuple[float, float]  # 95 % of the shares of functions drawn from the posterior, the share itself in it
    alone: float  # what the parameter does whatever the others are (the first-order index); not above the share


def importances(surrogate: Surrogate) -> tuple[Importance, ...]:
    """The importance of every parameter, in the order of the box: a function of the surrogate alone.

    Indices are those of Jansen (1999), on a Sobol sequence, as in Saltelli et al. (2010), table 2. The functions drawn
    share the surrogate's length scales, so the interval leaves out that these are not known exactly either.
    """
    names = surrogate.space.names
    with one_thread():
        share, alone = _indices(surrogate.mean(_points(len(names), POINTS)).reshape(2 + len(names), -1))
        drawn = _draws(surrogate, _points(len(names), DRAWN_POINTS)).reshape(DRAWS, 2 + len(names), -1)
    low, high = np.quantile(_indices(drawn)[0], LEVELS, axis=0)
    ends = zip(np.minimum(low, share).tolist(), np.maximum(high, share).tolist(), strict=True)
    return tuple(map(Importance, names, share.tolist(), ends, alone.tolist()))


def _points(dimensions: int, most: int) -> Floats:
    """At most so many points of the unit cube in 2 + parameters rows, one after another: (points, parameters).

    Row 0 is one set of points, row 1 another, row 2 + i the first with column i of the other.
    """
    pairs = unit_points(2 * dimensions, 2 ** int(np.log2(most / (2 + dimensions))), 0)
    first, second = pairs[:, :dimensions], pairs[:, dimensions:]
    swapped = [np.where(np.arange(dimensions) == column, second, first) for column in range(dimensions)]
    return np.concatenate([first, second, *swapped])


def _draws(surrogate: Surrogate, points: Floats) -> Floats:
    mean, covariance = surrogate.joint(points)
    scale = max(float(np.diag(covariance).mean()), JITTER)
    root = np.linalg.cholesky(covariance + JITTER * scale * np.eye(len(mean)))
    drawn: Floats = mean + np.random.default_rng(0).standard_normal((DRAWS, len(mean))) @ root.T
    return drawn


def _indices(values: Floats) -> tuple[Floats, Floats]:
    """Total-effect and first-order indices (…, parameters) of values (…, 2 + parameters, points); 0 if constant."""
    first, second, swapped = values[..., :1, :], values[..., 1:2, :], values[..., 2:, :]
    variance = values[..., :2, :].var(axis=(-1, -2))[..., None]
    safe = np.where(variance > 0, variance, 1.0)
    total = np.clip(0.5 * ((first - swapped) ** 2).mean(axis=-1) / safe, 0.0, 1.0)
    rest = 0.5 * ((second - swapped) ** 2).mean(axis=-1) / safe
    return total, np.where(variance > 0, np.clip(1.0 - rest, 0.0, total), 0.0)
