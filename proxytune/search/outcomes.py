"""The engines that learn from every output of a trial, not from PRPV alone: `composite` and `outcomes`.

`composite` is Bayesian optimisation of a composite score: the θ whose PRPV, composed of modelled outputs, is expected
to improve most. `outcomes` does that in turn with drawing θ from what is known of it. Draws find the θ that made the
target and escape what a greedy search sticks to; expected improvement keeps PRPV the goal where the proxy cannot be
like the target whatever θ is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from proxytune.arrays import Floats, one_thread
from proxytune.search.engine import Engine, Look, from_unit
from proxytune.search.likelihood import Likelihood, OutputModel, fit_outputs
from proxytune.search.loop import Goal, Trial, Values
from proxytune.search.posterior import posterior_of
from proxytune.search.surrogate import maximise_gain, unit_array
from proxytune.seeds import proposal_seed
from proxytune.space import Space

FRESH_DRAWS = 400
DRAWS = 24
"""Outputs drawn at every point; all points share the normal numbers behind them."""


@dataclass(frozen=True)
class Composite:
    """Proposes where the score of drawn outputs is expected to improve most.

    PRPV is a count of flipped pairs, but the metrics that it compares change smoothly with θ: each is modelled on its
    own (Astudillo and Frazier, Bayesian optimization of composite functions, ICML 2019). The improvement is measured
    from the lowest expected score of a visited point.
    """

    goal: Goal

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the set of trials and the seed alone; never a point visited before."""
        return most_improving(space, trials, self.goal, proposal_seed(seed, len(trials)))


def most_improving(space: Space, trials: Sequence[Trial], goal: Goal, seed: int) -> Values:
    """The θ whose composed score is expected to improve most on the best visited one."""
    with one_thread():
        model = _with_pending(fit_outputs(space, trials), trials)
        return from_unit(space, _most_improving(model, trials, goal, seed)[0])


def _with_pending(model: OutputModel, trials: Sequence[Trial]) -> OutputModel:
    """The model as a kriging believer has it: pending trials take their posterior mean, and need no second look."""
    pending = [trial for trial in trials if trial.pending]
    if not pending or not model.groups:
        return model
    mean, _ = model.predict(unit_array(model.space, [trial.values for trial in pending]))
    told = [replace(trial, outcome=tuple(row)) for trial, row in zip(pending, mean.tolist(), strict=True)]
    finished = [trial for trial in trials if not trial.pending]
    return fit_outputs(model.space, [*finished, *told], model.kernel)


def expected_gain(space: Space, trials: Sequence[Trial], goal: Goal, seed: int) -> tuple[float, float]:
    """The most that any θ is expected to improve the score, and the standard deviation of a fresh score of the best.

    Raises:
        RunError: If no trial has an outcome.
    """
    with one_thread():
        model = fit_outputs(space, trials)
        _, gain = _most_improving(model, trials, goal, proposal_seed(seed, len(trials)))
        best = model.visited[int(np.argmin(composed_scores(model, goal, seed)(model.visited).mean(axis=0)))]
        return gain, float(fresh_scores(model, goal, best, seed).std())


def _most_improving(model: OutputModel, trials: Sequence[Trial], goal: Goal, seed: int) -> tuple[Floats, float]:
    scores = composed_scores(model, goal, seed)
    incumbent = float(scores(model.visited).mean(axis=0).min())
    taken = unit_array(model.space, [trial.values for trial in trials])
    return maximise_gain(lambda points: np.maximum(0.0, incumbent - scores(points)).mean(axis=0), taken, seed)


def composed_scores(model: OutputModel, goal: Goal, seed: int) -> Callable[[Floats], Floats]:
    """Draw scores anywhere: a function of points (n, parameters) of the unit cube gives them, shape (draws, n).

    An output that the trials do not change is what it was in them; one that none knows is the target's.
    """
    normal = np.random.default_rng(seed).standard_normal((DRAWS, 1, model.outputs))

    def scores(points: Floats) -> Floats:
        mean, variance = _every_output(model, goal, points)
        return np.stack([goal.compose(mean + np.sqrt(variance) * row) for row in normal])

    return scores


def fresh_scores(model: OutputModel, goal: Goal, point: Floats, seed: int) -> Floats:
    """Scores that a point of the unit cube would come to in fresh episodes, roughness and noise included, (draws,)."""
    mean, variance = _every_output(model, goal, point[None])
    deviation = np.sqrt(variance + np.nan_to_num(model.rough) + goal.noise / 2.0)
    drawn = mean + deviation * np.random.default_rng(seed).standard_normal((FRESH_DRAWS, model.outputs))
    return goal.compose(drawn)


def _every_output(model: OutputModel, goal: Goal, points: Floats) -> tuple[Floats, Floats]:
    """Mean and variance of every output at points (n, parameters), those included that are not modelled."""
    mean, variance = model.predict(points)
    known = np.where(np.isnan(model.constant), goal.values, model.constant)
    return np.where(np.isnan(mean), known, mean), np.nan_to_num(variance)


COMPOSITE = Engine(
    name="composite",
    label="expected improvement of composed outputs",
    summary="the θ whose PRPV, composed of Gaussian processes of all outputs, is expected to improve most",
    make=Composite,
    learns_from="outputs",
    look=Look("#E69F00"),
)


@dataclass(frozen=True)
class Outcomes:
    """Proposes draws from the posterior of θ and the θ of highest expected improvement, in turn."""

    goal: Goal

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the trials and the seed alone."""
        drawn = proposal_seed(seed, len(trials))
        with one_thread():
            if len(trials) % 2:
                return most_improving(space, trials, self.goal, drawn)
            likelihood = Likelihood(fit_outputs(space, trials), self.goal)
            posterior = posterior_of(likelihood.log, len(space.intervals))
            return from_unit(space, posterior.draw(drawn))


OUTCOMES = Engine(
    name="outcomes",
    label="outcomes",
    summary="in turn, a draw from what is known of θ and the θ whose PRPV is expected to improve most",
    make=Outcomes,
    learns_from="outputs",
    look=Look("#D55E00"),
)
