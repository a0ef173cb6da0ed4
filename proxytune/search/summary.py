"""What many runs say of an engine, alone and against the default, with bootstrap intervals over seeds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.search.comparison import Run

Array = NDArray[np.float64]
RESAMPLES = 4000
LEVELS = (2.5, 97.5)


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % bootstrap interval over seeds."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class EngineSummary:
    """An engine over all its seeds.

    Attributes:
        engine: Its name.
        seeds: How many runs.
        regret: Median regret of the answer.
        reached: In how many runs a visited point was within the noise floor.
        evaluations: Median number of evaluations to get there; a run that did not counts as one more than the budget.
        error: Median error of θ in widths of the box; None where truth is not known.
        seconds: Median time per proposal.
        saved: Mean number of evaluations that the default saves against it, seed by seed; a run that did not reach
            the floor counts as one more than the budget. None for the default itself.
        regret_difference: Mean regret of the answer minus that of the default, seed by seed.
    """

    engine: str
    seeds: int
    regret: Estimate
    reached: int
    evaluations: Estimate
    error: Estimate | None
    seconds: float
    saved: Estimate | None
    regret_difference: Estimate | None


def summarise(runs: Sequence[Run], default: Sequence[Run], tolerance: float) -> EngineSummary:
    """Sum up the runs of one engine against those of the default on the same seeds, both in the order of the seeds."""
    regrets, needed = _regrets(runs), _needed(runs, tolerance)
    errors = [run.error for run in runs if run.error is not None]
    other = runs[0].key.engine != default[0].key.engine
    return EngineSummary(
        engine=runs[0].key.engine,
        seeds=len(runs),
        regret=estimate(regrets, np.median),
        reached=sum(run.evaluations_to(tolerance) is not None for run in runs),
        evaluations=estimate(needed, np.median),
        error=estimate(np.array(errors), np.median) if errors else None,
        seconds=float(np.median([run.seconds for run in runs])),
        saved=estimate(needed - _needed(default, tolerance), np.mean) if other else None,
        regret_difference=estimate(regrets - _regrets(default), np.mean) if other else None,
    )


def estimate(values: Array, figure: Callable[..., Array]) -> Estimate:
    """A figure of the values (n,) and its interval; the figure is a numpy reduction."""
    rows = np.random.default_rng(0).integers(0, len(values), (RESAMPLES, len(values)))
    low, high = np.percentile(figure(values[rows], axis=1), LEVELS)
    return Estimate(float(figure(values)), float(low), float(high))


def median_curve(runs: Sequence[Run]) -> tuple[Array, Array, Array]:
    """Median over runs of the lowest regret so far, after each evaluation, and the ends of its interval."""
    curves = np.array([run.best_regrets for run in runs])
    rows = np.random.default_rng(0).integers(0, len(curves), (RESAMPLES, len(curves)))
    ends = np.array([np.percentile(np.median(column[rows], axis=1), LEVELS) for column in curves.T])
    return np.median(curves, axis=0), ends[:, 0], ends[:, 1]


def _needed(runs: Sequence[Run], tolerance: float) -> Array:
    return np.array([run.evaluations_to(tolerance) or run.key.budget + 1 for run in runs], dtype=float)


def _regrets(runs: Sequence[Run]) -> Array:
    """A run whose answer has no regret counts as its worst visited point."""
    return np.array(
        [
            max(r for r in run.regrets if r is not None) if run.answer_regret is None else run.answer_regret
            for run in runs
        ]
    )
