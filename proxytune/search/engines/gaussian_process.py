"""Bayesian optimisation: expected improvement over a Gaussian process of the finished trials.

Of a pending trial it believes the posterior mean given the finished ones (Ginsbourger, Le Riche and Carraro, Kriging is
well-suited to parallelize optimization, 2010): nothing is left to be learnt there, so the next proposal goes elsewhere.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from proxytune.search.design import from_unit, unit_points
from proxytune.search.engines.engine import Engine, Look
from proxytune.search.proposer import Trial, Values, with_failures_as_worst
from proxytune.search.surrogate import Array, Surrogate, fit_surrogate, unit_array
from proxytune.seeds import proposal_seed
from proxytune.space import Space

CLOUD = 2048
REFINED = 8
WIDTHS = (0.05, 0.015, 0.005)
SAME = 0.1
"""Points closer than this, divided by the number of trials, in every parameter (in widths of the box) are the same
point: a deterministic score has nothing new to say there."""


@dataclass(frozen=True)
class GaussianProcess:
    """Proposes where the score is expected to improve most.

    The improvement is measured from the best posterior mean among the visited points: the lowest score itself is
    partly luck.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the set of trials and the seed alone; never a point visited or pending.

        Raises:
            RunError: If no trial has a score.
        """
        with threadpool_limits(limits=1):
            return from_unit(space, _most_promising(_believing(space, trials), proposal_seed(seed, len(trials)))[0])


def expected_improvement(space: Space, trials: Sequence[Trial], seed: int) -> tuple[float, float]:
    """The most that any θ is expected to improve the score, and the standard deviation of the score's noise.

    Raises:
        RunError: If no trial has a score.
    """
    surrogate = fit_surrogate(space, with_failures_as_worst(trials))
    with threadpool_limits(limits=1):
        _, gain = _most_promising(surrogate, proposal_seed(seed, len(trials)))
    return gain, surrogate.noise_deviation


def _believing(space: Space, trials: Sequence[Trial]) -> Surrogate:
    """The surrogate of the trials, a pending one taken for one that scored what is expected of it."""
    surrogate = fit_surrogate(space, trials)
    pending = [trial for trial in trials if trial.pending]
    if not pending:
        return surrogate
    means = surrogate.mean(unit_array(space, [trial.values for trial in pending]))
    believed = [replace(trial, score=float(mean)) for trial, mean in zip(pending, means, strict=True)]
    return fit_surrogate(space, [*surrogate.visited, *believed])


def _most_promising(surrogate: Surrogate, seed: int) -> tuple[Array, float]:
    """The point of the unit cube with the highest expected improvement, and that."""
    # Takes a second to load, so only where a point is looked for.
    from skopt.acquisition import gaussian_ei

    _, incumbent = surrogate.incumbent()
    visited = unit_array(surrogate.space, [trial.values for trial in surrogate.visited])
    return highest(lambda points: gaussian_ei(points, surrogate.model, y_opt=incumbent, xi=0.0), visited, seed)


def highest(gain: Callable[[Array], Array], visited: Array, seed: int) -> tuple[Array, float]:
    """The unvisited point of the unit cube that promises the highest gain, and that: a Sobol cloud, then closer looks.

    Args:
        gain: What points (n, parameters) promise, shape (n,).
        visited: The points that are not to be proposed again, shape (trials, parameters).
        seed: Seeds the clouds.
    """
    dimensions = visited.shape[1]
    points = _new(unit_points(dimensions, CLOUD, seed), visited)
    gains = gain(points)
    offsets = 2.0 * unit_points(dimensions, CLOUD // 16, seed + 1) - 1.0
    for width in WIDTHS:
        leaders = points[np.argsort(-gains, kind="stable")[:REFINED]]
        around = np.clip(leaders[:, None, :] + width * offsets, 0.0, 1.0).reshape(-1, dimensions)
        points = np.concatenate([leaders, _new(around, visited)])
        gains = gain(points)
    best = int(np.argmax(gains))
    return points[best], float(gains[best])


def _new(points: Array, visited: Array) -> Array:
    """The points that are not the same as a visited one."""
    distances = np.abs(points[:, None, :] - visited[None, :, :]).max(axis=2)
    return np.asarray(points[distances.min(axis=1) > SAME / len(visited)])


ENGINE = Engine(
    name="gp",
    label="Gaussian process of the score",
    summary="the θ whose score is expected to improve most, by a Gaussian process of the score",
    make=GaussianProcess,
    look=Look("#0072B2"),
)
