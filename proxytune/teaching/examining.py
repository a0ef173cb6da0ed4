"""The examinations of a learning experiment: all of a grid, or those that tell most, batch by batch.

A batch is a pure function of the scores of the batches before it, and every score is cached by all that determines it:
an experiment that is stopped at any moment goes on where it was, to the same scores.
"""

from collections.abc import Mapping

import numpy as np

from proxytune.learning import posterior
from proxytune.learning.curves import Curve
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import SampleNeeds, sample_needs
from proxytune.learning.settings import NONE, TeachingSettings
from proxytune.learning.spending import Examination, Scores, Spending, curves_of, first_examinations, next_examinations
from proxytune.running.progress import Watcher
from proxytune.teaching.points import Point, TeachingSetup
from proxytune.teaching.spreading import prepare_shared, score_points

BATCH = 12
"""So many examinations are chosen at once, however many processes there are."""
DRAWS = 500
"""So many draws of the learning curves choose the next examinations."""


def examine_curves(
    setup: TeachingSetup,
    proxies: Mapping[str, Distribution | None],
    jobs: int,
    watcher: Watcher,
    known: Scores | None = None,
) -> dict[Examination, float]:
    """Examine learners of these proxies; what is cached is not made again.

    Args:
        setup: Where they learn.
        proxies: p(θ) by name; None of the learner without a proxy.
        jobs: How many processes there are.
        watcher: Hears of every examination.
        known: Scores of learners that are not examined further, the one without a proxy among them.

    Returns:
        The known scores and the new ones.
    """
    taught, scores = setup.settings, dict(known or {})
    if taught.examinations is None:
        return {**scores, **_examine(setup, proxies, _whole_grid(taught, proxies), jobs, watcher)}
    wanted = len(scores) + count_examinations(taught, len(proxies))
    spending = Spending(NONE, taught.target_samples, taught.seeds, BATCH)
    batch = first_examinations(list(proxies), spending)
    while batch and len(scores) < wanted:
        scores |= _examine(setup, proxies, batch[: wanted - len(scores)], jobs, watcher)
        if len(scores) < wanted:
            needs = needs_of(setup, curves_of(taught.target_samples, scores), DRAWS)
            batch = next_examinations(needs, list(proxies), spending)
    return scores


def count_examinations(taught: TeachingSettings, curves: int) -> int:
    """How many examinations this many learning curves take."""
    return curves * (taught.examinations or taught.seeds * len(taught.target_samples))


def needs_of(setup: TeachingSetup, curves: Mapping[str, Curve], draws: int = posterior.DRAWS) -> SampleNeeds:
    """How many target samples each learner needs, by what [teaching] says of convergence."""
    taught, best = setup.settings, setup.target.best_score
    return sample_needs(curves, none=NONE, best_score=best, tolerance=taught.tolerance, level=taught.level, draws=draws)


def _whole_grid(taught: TeachingSettings, names: Mapping[str, Distribution | None]) -> list[Examination]:
    return [
        Examination(name, repetition, count)
        for name in names
        for repetition in range(taught.seeds)
        for count in taught.target_samples
    ]


def _examine(
    setup: TeachingSetup,
    proxies: Mapping[str, Distribution | None],
    batch: list[Examination],
    jobs: int,
    watcher: Watcher,
) -> dict[Examination, float]:
    points = {one: Point(one.curve, proxies[one.curve], one.repetition, one.samples) for one in batch}
    missing = [point for point in points.values() if not setup.is_cached(point)]
    watcher.begin("demonstrations", len(points) - len(missing))
    prepare_shared(setup, missing, jobs)
    watcher.begin("learning", 0)
    with score_points(setup, missing, jobs) as scored:
        for point, score in scored:
            watcher.episode()
            watcher.finished(_came_to(point, score))
    return {one: setup.score(point) for one, point in points.items()}


def _came_to(point: Point, score: float) -> str:
    """What became of a point of a learning curve, in one line."""
    came = "nothing learnt yet" if np.isnan(score) else f"score {score:.3g}"
    return f"{point.name}, repetition {point.repetition + 1}, {point.count} target samples: {came}"
