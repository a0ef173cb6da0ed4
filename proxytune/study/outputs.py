"""A study as a search that learns from every output sees it: each agent's mean of every metric that both sides have."""

from collections.abc import Collection, Iterable

import numpy as np

from proxytune.domain import Outcome
from proxytune.scores import Array
from proxytune.search.goal import Goal
from proxytune.search.knowledge.knowledge import Knowledge, learn
from proxytune.search.proposer import Compose, Trial, Values
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.evaluation import known_outcomes
from proxytune.study.history import episodes_of, lacks_episodes
from proxytune.study.noise import noise_of
from proxytune.study.study import Study
from proxytune.usefulness.prpv import prpv_of_means


def trial_of(study: Study, store: Store, done: TrialRecord) -> Trial:
    """A finished trial as the search sees it; of one that was cut off, the outputs of the agents driven until then.

    Of these the store may happen to have more: other processes had begun them.

    Raises:
        RunError: If the store lacks episodes of it.
    """
    planned = episodes_of(study.settings, done)
    known = known_outcomes(study, store, planned)
    if len(known) < len(planned):
        raise lacks_episodes(store, done)
    return Trial(study.settings.space.values(done.theta), done.score, outputs_of(study, known.values()))


def trials_of(study: Study, store: Store, done: Iterable[TrialRecord]) -> list[Trial]:
    """Finished trials as the search sees them."""
    return [trial_of(study, store, trial) for trial in done]


def knowledge_of(study: Study, store: Store, done: Iterable[TrialRecord]) -> Knowledge:
    """What finished trials say of θ.

    Raises:
        RunError: If no trial has an outcome, or the store lacks episodes of one.
    """
    trials = trials_of(study, store, done)
    return learn(study.settings.space, trials, goal_of(study, store), study.settings.seed)


def outputs_of(study: Study, outcomes: Collection[Outcome]) -> Values | None:
    """Every agent's mean metrics, in the order of the target's table, NaN for an agent that no episode tells of.

    None where no episode tells of any. Where an agent failed from some starts, its mean is over the others.
    """
    means = _means(study, outcomes)
    return None if np.isnan(means).all() else tuple(means.ravel().tolist())


def _means(study: Study, outcomes: Collection[Outcome]) -> Array:
    names = study.target.metrics
    rows = {agent: row for row, agent in enumerate(study.target.agents)}
    sums, counts = np.zeros(study.target.means.shape), np.zeros((len(rows), 1))
    # In the order of the starts, so that a sum has the same last bit whatever came in first.
    for outcome in sorted(outcomes, key=lambda one: one.episode.start):
        if outcome.metrics is not None:
            sums[rows[outcome.episode.agent]] += [outcome.metrics[name] for name in names]
            counts[rows[outcome.episode.agent]] += 1.0
    return np.where(counts > 0.0, sums / np.maximum(counts, 1.0), np.nan)


def goal_of(study: Study, store: Store) -> Goal:
    """What the study's search is after; a function of the pre-flight and the target's table."""
    table = study.target
    outputs = tuple((agent, metric) for agent in table.agents for metric in table.metrics)
    return Goal(outputs, table.means.ravel(), noise_of(study, store).variance.ravel(), compose_of(study))


def compose_of(study: Study) -> Compose:
    """PRPV of outputs against the study's target."""
    metrics, table = study.settings.metrics, study.target
    compared = table.means[:, : len(metrics)]

    def compose(outputs: Array) -> Array:
        means = outputs.reshape(*outputs.shape[:-1], *table.means.shape)
        return prpv_of_means(means[..., : len(metrics)], compared, metrics)

    return compose
