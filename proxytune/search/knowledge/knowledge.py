"""What a search has learnt of θ from every output of its trials: the answer, the region, and whether the model fits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from proxytune.search.design import from_unit, to_unit
from proxytune.search.engines.composite import composed_scores, fresh_scores
from proxytune.search.goal import Goal
from proxytune.search.knowledge.information import Information, information_of
from proxytune.search.knowledge.left_out import LeftOut, leave_out
from proxytune.search.knowledge.likelihood import Likelihood
from proxytune.search.knowledge.misfit import Misfit, misfit_of
from proxytune.search.knowledge.output_model import OutputModel, fit_outputs
from proxytune.search.knowledge.region import Posterior, posterior_of
from proxytune.search.proposer import Trial, Values
from proxytune.search.surrogate import Array, unit_array
from proxytune.space import Space

Ends = tuple[float, float]
REPORTED = 16384
"""Points of the posterior that is reported: four times as many as a draw takes, so that small regions are smooth."""
UPPER = 97.5
"""Percentile of fresh scores of the answer, up to which another θ cannot be told from it."""


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What finished trials say of θ; everything is a function of them, the goal and the seed.

    Attributes:
        model: Of every output.
        goal: The target.
        trials: What it was learnt from.
        seed: Seeds what is drawn.
    """

    model: OutputModel
    goal: Goal
    trials: tuple[Trial, ...]
    seed: int

    @property
    def space(self) -> Space:
        """The search box."""
        return self.model.space

    @cached_property
    def likelihood(self) -> Likelihood:
        """How well any θ explains the target's outputs."""
        return Likelihood(self.model, self.goal)

    @cached_property
    def left_out(self) -> LeftOut:
        """What the trials say of each other."""
        return leave_out(self.model, self.trials, self.goal, self.seed)

    def log(self, points: Array) -> Array:
        """Log density of θ at points (n, parameters) of the unit cube, up to a constant.

        Wider than the likelihood where its regions do not hold as many left-out trials as they should.
        """
        return self.likelihood.log(points) / self.left_out.widening

    @cached_property
    def posterior(self) -> Posterior:
        """θ given the target's outputs, over the unit cube."""
        return posterior_of(self.log, len(self.space.intervals), REPORTED)

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
        """Whether a θ of the box is in the 95 % region."""
        return bool(self.log(to_unit(self.space, values)[None])[0] >= self.posterior.threshold)

    def scores(self, points: Sequence[Values]) -> tuple[Array, Array]:
        """Mean and standard deviation of what PRPV is expected to be at points of the box, rough and noise left out."""
        drawn = self._drawn(unit_array(self.space, points))
        return drawn.mean(axis=0), drawn.std(axis=0)

    def _drawn(self, unit: Array) -> Array:
        return composed_scores(self.model, self.goal, self.seed)(unit)

    @cached_property
    def expected(self) -> Mapping[Values, float]:
        """PRPV that is expected of each visited θ in fresh episodes, the lowest first.

        The mean of its trial's score and of what the outputs of all trials are composed to. Of 552 θ on a simulator
        this was nearer to fresh episodes (root mean square 3.5) than either (3.6 and 3.9).
        """
        own = {trial.values: trial.score for trial in self.trials if trial.score is not None}
        visited = sorted(own)
        composed, _ = self.scores(visited)
        both = {values: (own[values] + float(one)) / 2.0 for values, one in zip(visited, composed, strict=True)}
        return dict(sorted(both.items(), key=lambda pair: pair[1]))

    @property
    def answer(self) -> Values:
        """The visited θ of lowest expected PRPV."""
        return next(iter(self.expected))

    def likeliest_of(self, points: Sequence[Values]) -> Values:
        """That of some θ which explains the target's outputs best."""
        return points[int(np.argmax(self.likelihood.log(unit_array(self.space, points))))]

    def fresh_scores(self, values: Values) -> Array:
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
        """Whether any θ explains the target."""
        return misfit_of(self.likelihood, self.posterior, self.left_out)

    @cached_property
    def information(self) -> tuple[Information, ...]:
        """Which agents and metrics tell what of each parameter, in the order of the box."""
        return information_of(self.likelihood, self.posterior.mode)


def learn(space: Space, trials: Sequence[Trial], goal: Goal, seed: int = 0) -> Knowledge:
    """Learn what finished trials say of θ; same trials in any order, same knowledge.

    Raises:
        RunError: If no trial has an outcome, or no output changes.
    """
    return Knowledge(fit_outputs(space, trials), goal, tuple(trials), seed)
