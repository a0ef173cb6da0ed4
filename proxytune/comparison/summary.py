"""What many runs say of an engine, alone and against the first, with bootstrap intervals over seeds."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.comparison.judgement import Reading
from proxytune.comparison.runs import Run

RESAMPLES = 4000
LEVELS = (2.5, 97.5)


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % bootstrap interval over seeds."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Region:
    """What the points of an engine's runs tell of θ, read as a study reads them.

    Attributes:
        covered: In how many runs the truth is in the 95 % region; None where it is not known.
        share: Median share of the region in the box.
        intervals_covered: For each parameter, in how many runs its 95 % interval holds the truth; None as above.
        misfits: In how many runs it was said that the proxy lacks something.
    """

    covered: int | None
    share: Estimate
    intervals_covered: Mapping[str, int] | None
    misfits: int


@dataclass(frozen=True)
class EngineSummary:
    """An engine over all its seeds. Differences and ratios are to the first engine, seed by seed; None for itself.

    Attributes:
        engine: Its name.
        seeds: How many runs.
        score: Mean score of the answers, free of the noise that the engine has seen; None if all failed.
        regret_difference: How much higher that is on average; the regret is higher by as much.
        regret: Median regret of the answer.
        reached: In how many runs a visited point was within the noise floor, or no worse than the truth.
        evaluations: Median number of evaluations to get there; a run that did not counts as one more than the budget.
        saved: Mean number of evaluations by which the first gets there sooner.
        ratio: Mean number of evaluations of the first, as a share of this engine's.
        error: Median error of θ in widths of the box; None where truth is not known.
        region: What its points tell of θ; None where a score has no parts.
        seconds: Median time per proposal.
    """

    engine: str
    seeds: int
    score: Estimate | None
    regret_difference: Estimate | None
    regret: Estimate
    reached: int
    evaluations: Estimate
    saved: Estimate | None
    ratio: Estimate | None
    error: Estimate | None
    region: Region | None
    seconds: float


def summarise(runs: Sequence[Run], first: Sequence[Run], tolerance: float) -> EngineSummary:
    """Sum up the runs of one engine against those of the first on the same seeds, both in the order of the seeds."""
    needed, firsts = _needed(runs, tolerance), _needed(first, tolerance)
    errors = [run.judgement.error for run in runs if run.judgement.error is not None]
    other = runs[0].key.engine != first[0].key.engine
    scores = [run.judgement.answer_score for run in runs if run.judgement.answer_score is not None]
    regrets = _regrets(runs)
    return EngineSummary(
        engine=runs[0].key.engine,
        seeds=len(runs),
        score=estimate(np.array(scores), np.mean) if scores else None,
        regret_difference=estimate(regrets - _regrets(first), np.mean) if other else None,
        regret=estimate(regrets, np.median),
        reached=sum(run.judgement.evaluations_to(tolerance) is not None for run in runs),
        evaluations=estimate(needed, np.median),
        saved=estimate(needed - firsts, np.mean) if other else None,
        ratio=ratio(firsts, needed) if other else None,
        error=estimate(np.array(errors), np.median) if errors else None,
        region=_region(runs),
        seconds=float(np.median([run.seconds for run in runs])),
    )


def estimate(values: Floats, figure: Callable[..., Floats]) -> Estimate:
    """A figure of the values (n,) and its interval; the figure is a numpy reduction."""
    low, high = np.percentile(figure(values[_resampled(len(values))], axis=1), LEVELS)
    return Estimate(float(figure(values)), float(low), float(high))


def ratio(values: Floats, others: Floats) -> Estimate:
    """Mean of the values (n,) as a share of that of others (n,), the pairs resampled together."""
    rows = _resampled(len(values))
    low, high = np.percentile(values[rows].mean(axis=1) / others[rows].mean(axis=1), LEVELS)
    return Estimate(float(values.mean() / others.mean()), float(low), float(high))


def median_curve(runs: Sequence[Run]) -> tuple[Floats, Floats, Floats]:
    """Median over runs of the lowest regret so far, after each evaluation, and the ends of its interval."""
    curves = np.array([run.judgement.best_regrets for run in runs])
    rows = _resampled(len(curves))
    with np.errstate(invalid="ignore"):  # infinite while all have failed
        ends = np.array([np.percentile(np.median(column[rows], axis=1), LEVELS) for column in curves.T])
    return np.median(curves, axis=0), ends[:, 0], ends[:, 1]


def _resampled(count: int) -> NDArray[np.int64]:
    return np.random.default_rng(0).integers(0, count, (RESAMPLES, count))


def _needed(runs: Sequence[Run], tolerance: float) -> Floats:
    return np.array([run.judgement.evaluations_to(tolerance) or run.key.budget + 1 for run in runs], dtype=float)


def _regrets(runs: Sequence[Run]) -> Floats:
    """A run whose answer has no regret counts as its worst visited point."""
    found = [run.judgement for run in runs]
    worst = [max(regret for regret in one.regrets if regret is not None) for one in found]
    return np.array(
        [high if one.answer_regret is None else one.answer_regret for one, high in zip(found, worst, strict=True)]
    )


def _region(runs: Sequence[Run]) -> Region | None:
    found = [run.judgement.reading for run in runs if run.judgement.reading is not None]
    if not found:
        return None
    return Region(
        covered=_count([reading.holds for reading in found]),
        share=estimate(np.array([reading.share for reading in found]), np.median),
        intervals_covered=_by_parameter(found),
        misfits=sum(reading.fits is False for reading in found),
    )


def _count(flags: Sequence[bool | None]) -> int | None:
    return None if None in flags else sum(bool(flag) for flag in flags)


def _by_parameter(found: Sequence[Reading]) -> dict[str, int] | None:
    held = [reading.intervals_hold for reading in found if reading.intervals_hold is not None]
    if len(held) < len(found):
        return None
    return {name: sum(one[name] for one in held) for name in held[0]}
