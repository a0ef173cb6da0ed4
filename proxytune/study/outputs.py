"""A study as a search sees it: its trials' scores, and each agent's mean of every metric that both sides have."""

from collections.abc import Collection, Iterable

import numpy as np

from proxytune.domain import Outcome
from proxytune.scores import Array
from proxytune.search.proposer import Compose, Trial, Values
from proxytune.space import Space
from proxytune.storage.records import TrialRecord
from proxytune.study.study import Study


def score_trials(space: Space, done: Iterable[TrialRecord]) -> list[Trial]:
    """Finished trials as a search sees them that learns from scores alone."""
    return [Trial(space.values(trial.theta), trial.score) for trial in done]


def outputs_of(study: Study, outcomes: Collection[Outcome]) -> Values | None:
    """Every agent's mean metrics, in the order of the target's table, NaN where no episode tells of one.

    None where no episode tells of any. Where an agent failed from some starts, its mean is over the others; where some
    episodes lack a metric, that mean is over the others too.
    """
    means = _means(study, outcomes)
    return None if np.isnan(means).all() else tuple(means.ravel().tolist())


def _means(study: Study, outcomes: Collection[Outcome]) -> Array:
    names = study.target.metrics
    rows = {agent: row for row, agent in enumerate(study.target.agents)}
    sums, counts = np.zeros(study.target.means.shape), np.zeros(study.target.means.shape)
    # In the order of the starts, so that a sum has the same last bit whatever came in first.
    for outcome in sorted(outcomes, key=lambda one: one.episode.start):
        if outcome.metrics is not None:
            row, known = rows[outcome.episode.agent], [name in outcome.metrics for name in names]
            sums[row] += [outcome.metrics.get(name, 0.0) for name in names]
            counts[row] += known
    return np.where(counts > 0.0, sums / np.maximum(counts, 1.0), np.nan)


def compose_of(study: Study) -> Compose:
    """What the study makes small, of outputs against the study's target."""
    metrics, table, objective = study.settings.metrics, study.target, study.objective
    compared = table.means[:, : len(metrics)]

    def compose(outputs: Array) -> Array:
        means = outputs.reshape(*outputs.shape[:-1], *table.means.shape)
        return objective.sign * objective.of_means(means[..., : len(metrics)], compared, metrics)

    return compose
