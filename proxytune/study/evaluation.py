"""Scoring one domain instance: all agents from all starts, compared with the target."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from proxytune.domain import DomainFamily, Episode, Outcome, instance_of
from proxytune.scores import Array, ScoreTable
from proxytune.seeds import episode_seed
from proxytune.space import Theta
from proxytune.study.settings import StudySettings
from proxytune.study.study import Study
from proxytune.usefulness.prpv import dominance


@dataclass(frozen=True)
class Evaluation:
    """How useful a domain instance is.

    Attributes:
        theta: The instance.
        proxy: The agents' scores in it, over the episodes that worked; None if an agent has none.
        measures: Every measure by name, the objective's among them; one that is undefined is None. Empty if an agent
            has no episode that worked.
        score: What the study makes small; None if there is none.
        failures: The outcomes that failed.
        failure: Why there is no score, empty if there is one.
        disagreement: |α_proxy − α_target| of each pair of agents, in the order of their names, shape (agents, agents).
    """

    theta: Theta
    proxy: ScoreTable | None
    measures: Mapping[str, float | None]
    score: float | None
    failures: tuple[Outcome, ...]
    failure: str = ""
    disagreement: Array | None = field(default=None, compare=False, repr=False)

    @property
    def prpv(self) -> float | None:
        """PRPV; None if an agent has no episode that worked."""
        return self.measures.get("prpv")


def plan(settings: StudySettings, theta: Theta, seed: int) -> list[Episode]:
    """The episodes that score a domain instance: every agent from every start."""
    instance, seeds = instance_of(theta), [episode_seed(seed, start) for start in range(settings.starts)]
    return [Episode(instance, agent, start, own) for agent in settings.agents for start, own in enumerate(seeds)]


def needed_metrics(settings: StudySettings, family: DomainFamily) -> list[str]:
    """The metrics of a family that agents are compared by: an episode without one of them has failed."""
    return [metric.name for metric in settings.metrics if metric.name in family.metrics]


def with_metrics_needed(outcome: Outcome, needed: Sequence[str]) -> Outcome:
    """The outcome; a failure where it lacks a metric that agents are compared by, as when these are others now."""
    lacks = [name for name in needed if outcome.metrics is not None and name not in outcome.metrics]
    return replace(outcome, metrics=None, failure=f"it has no finite '{lacks[0]}'") if lacks else outcome


@dataclass(frozen=True)
class Spent:
    """What a run has cost: episodes simulated, their time summed over all processes, and how many of them in vain."""

    episodes: int = 0
    seconds: float = 0.0
    unused: int = 0

    def __add__(self, other: "Spent") -> "Spent":
        return Spent(self.episodes + other.episodes, self.seconds + other.seconds, self.unused + other.unused)


def longest_first(episodes: Sequence[Episode], seconds: Mapping[tuple[str, int], float]) -> list[Episode]:
    """The episodes in the order that keeps several processes busy to the end, by how long their like took before."""
    return sorted(episodes, key=lambda episode: -seconds.get((episode.agent, episode.start), float("inf")))


def score(study: Study, theta: Theta, outcomes: Sequence[Outcome]) -> Evaluation:
    """Compare the outcomes of a domain instance's episodes with the target; a pure function.

    Each agent is scored over its own episodes that worked. A failed episode has no score, so none is made up for it;
    an agent without any cannot be compared, and then the instance has no score either.
    """
    failures = tuple(outcome for outcome in outcomes if outcome.metrics is None)
    worked = {outcome.episode.agent for outcome in outcomes if outcome.metrics is not None}
    for failed in failures:
        if failed.episode.agent not in worked:
            reason = f"agent '{failed.episode.agent}' failed from every start, first with: {failed.failure}"
            return Evaluation(theta, None, {}, None, failures, reason)
    proxy, objective = table(outcomes), study.objective
    measures = objective.measure(proxy=proxy, target=study.target, metrics=study.settings.metrics)
    value = measures[objective.name]
    reason = "" if value is not None else f"{objective.label} is undefined here"
    pairs = disagreement_of(study, proxy, sorted(study.settings.agents))
    cost = None if value is None else objective.sign * value
    return Evaluation(theta, proxy, measures, cost, failures, reason, pairs)


def disagreement_of(study: Study, proxy: ScoreTable, agents: Sequence[str]) -> Array:
    """|α_proxy − α_target| of each pair of these agents, in their order; eq. (4) sums it up to PRPV."""
    metrics = study.settings.metrics
    names = [metric.name for metric in metrics]
    sides = [table.select(names).arrange(agents=agents).means for table in (proxy, study.target)]
    ranked = [dominance(means, metrics) for means in sides]
    return np.abs(ranked[0] - ranked[1])


def table(outcomes: Sequence[Outcome]) -> ScoreTable:
    """The scores of the episodes that worked, labelled by their start, in the metrics that all of them have."""
    worked = {(one.episode.agent, str(one.episode.start)): one.metrics for one in outcomes if one.metrics is not None}
    return ScoreTable.from_episodes(in_common(worked))


def in_common(scored: Mapping[tuple[str, str], Mapping[str, float]]) -> dict[tuple[str, str | int], dict[str, float]]:
    """Scores by agent and episode, in the metrics that every one of them has."""
    whole = [name for name in next(iter(scored.values()), {}) if all(name in scores for scores in scored.values())]
    return {key: {name: scores[name] for name in whole} for key, scores in scored.items()}


def failure_of(outcome: Outcome) -> str:
    """Which episode failed and why, in one phrase."""
    episode = outcome.episode
    return f"agent '{episode.agent}' failed from start {episode.start}: {outcome.failure}"
