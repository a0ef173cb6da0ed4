"""How far chance alone puts proxy and target apart at the same θ: what a search has to forgive.

Both sides drive from the same starts, so it is the placement noise that differs, not the starts. The pre-flight has
driven the centre of the box under two placements, from which follows the variance of a difference of two episodes.
Without shared starts, or without a pre-flight, there is the spread between episodes only, which is far larger: starts
differ more than placements.
"""

import warnings
from dataclasses import dataclass

import numpy as np

from proxytune.scores import Array
from proxytune.study.stages.preflight import placement_pairs
from proxytune.study.study import Study
from proxytune.study.study_run import StudyRun
from proxytune.usefulness.repeats import start_of

PRIOR_PAIRS = 2
"""An agent's own pairs are few, so the median over the agents counts as so many more."""

UNKNOWN = 0.1
"""Where nothing tells: standard deviation of a mean, as a share of the spread over agents."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Chance between the mean scores of proxy and target at the same θ.

    Attributes:
        variance: Of the difference of the two means, shape (agents, metrics).
        caution: What is lost, in one line; empty where both sides drive from the same starts and a pre-flight has told
            what placement does.
    """

    variance: Array
    caution: str = ""


def noise_of(run: StudyRun) -> Noise:
    """What is known of noise before the first trial; a function of the pre-flight and the target's table."""
    study = run.study
    driven = study.settings.starts
    measured = np.maximum(1, study.target.counts)[:, None]
    pairs = placement_pairs(run)
    if shares_starts(study) and pairs.size:
        return Noise(_shrunk((pairs[:, 0] - pairs[:, 1]) ** 2) / 2.0 * (1.0 / driven + 1.0 / measured))
    remedy = "to know θ better, measure the target from the study's own starts and leave the pre-flight on"
    if study.target.counts.min() >= 2:
        between = _shrunk(np.moveaxis(_apart(study.target.values), 1, 0))
        caution = f"noise is estimated from the spread between the target's episodes, which is too large; {remedy}"
        return Noise(between * (1.0 / driven + 1.0 / measured), caution)
    spread = np.ptp(study.target.means, axis=0) * UNKNOWN
    caution = f"noise is unknown and assumed to be {UNKNOWN:.0%} of the spread between agents; {remedy}"
    return Noise(np.broadcast_to(spread**2, study.target.means.shape), caution)


def shares_starts(study: Study) -> bool:
    """Whether the target was driven from the study's own starts, each as often, by every agent."""
    starts = [start_of(label) for label in study.target.episodes]
    wanted = {str(start) for start in range(study.settings.starts)}
    each = {start: starts.count(start) for start in starts}
    return study.target.complete and set(each) == wanted and len(set(each.values())) == 1


def _apart(values: Array) -> Array:
    """Squared distances of an agent's episodes from its mean, scaled so that their mean is the variance."""
    count = np.sum(~np.isnan(values), axis=1, keepdims=True)
    return np.asarray((values - np.nanmean(values, axis=1, keepdims=True)) ** 2 * (count / (count - 1)))


def _shrunk(squares: Array) -> Array:
    """Mean squares per agent and metric of squares (pairs, agents, metrics), NaN where one is missing.

    Drawn towards the median over agents, since few pairs tell little of one agent.
    """
    counts = np.sum(~np.isnan(squares), axis=0)
    sums = np.nansum(squares, axis=0)
    with warnings.catch_warnings():
        # Of a metric that no pair has, nothing is known.
        warnings.simplefilter("ignore", RuntimeWarning)
        middle = np.nanmedian(np.where(counts > 0, sums / np.maximum(1, counts), np.nan), axis=0)
    return np.asarray((sums + PRIOR_PAIRS * middle) / (counts + PRIOR_PAIRS))
