"""Scoring one domain instance: all agents from all starts, compared with the target."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.domain import Episode, Outcome, make_episode
from proxytune.errors import EpisodeError
from proxytune.running.episodes import running
from proxytune.running.progress import Watcher
from proxytune.scores import ScoreTable
from proxytune.space import Theta
from proxytune.storage.store import Store
from proxytune.study.settings import StudySettings
from proxytune.study.study import Study
from proxytune.usefulness import ppv, prpv

FRESH = 1_000_003
"""Added to a seed for the episodes that judge an answer: no engine has seen them."""

Instance = tuple[tuple[str, float], ...]
"""θ as an episode names it."""

Enough = Callable[[Instance, Mapping[Episode, Outcome]], bool]
"""Whether the outcomes known so far are enough of a domain instance."""


@dataclass(frozen=True)
class Evaluation:
    """How useful a domain instance is.

    Attributes:
        theta: The instance.
        proxy: The agents' scores in it, over the episodes that worked; None if an agent has none.
        prpv: PRPV, None if an agent has no episode that worked.
        ppv: PPV, None also where the target's agents all score alike.
        failures: The outcomes that failed.
        failure: Why there is no score, empty if there is one.
    """

    theta: Theta
    proxy: ScoreTable | None
    prpv: int | None
    ppv: float | None
    failures: tuple[Outcome, ...]
    failure: str = ""


def episode_seed(study_seed: int, start: int) -> int:
    """The seed of every episode from this start: common random numbers for all agents and all θ."""
    return int(np.random.SeedSequence([study_seed, start]).generate_state(1)[0])


def plan(settings: StudySettings, theta: Theta, seed: int) -> list[Episode]:
    """The episodes that score a domain instance: every agent from every start."""
    return [
        make_episode(theta, agent=agent, start=start, seed=episode_seed(seed, start))
        for agent in settings.agents
        for start in range(settings.starts)
    ]


@dataclass(frozen=True)
class Spent:
    """What a run has cost: episodes simulated, their time summed over all processes, and how many of them in vain."""

    episodes: int = 0
    seconds: float = 0.0
    unused: int = 0

    def __add__(self, other: "Spent") -> "Spent":
        return Spent(self.episodes + other.episodes, self.seconds + other.seconds, self.unused + other.unused)


def simulate(study: Study, store: Store, theta: Theta, watcher: Watcher, what: str) -> Spent:
    """Run the episodes of a domain instance that are not in the store yet, as in run_missing."""
    return run_missing(study, store, plan(study.settings, theta, study.settings.seed), watcher, what)


def run_missing(
    study: Study,
    store: Store,
    planned: Sequence[Episode],
    watcher: Watcher,
    what: str,
    enough: Enough | None = None,
) -> Spent:
    """Run the episodes that are not in the store yet; each is there as soon as it is finished.

    A failed episode counts as known where failures do not stop the study; where they do, it is tried again, since
    something is expected to have been mended. Where it is asked whether what is known of a domain instance is enough,
    agents begin in their order, each in all instances, and none more begins in an instance after a yes.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    settings, spent = study.settings, Spent()
    known = known_outcomes(study, store, planned)
    stop = settings.stop_on_failure
    known = {episode: outcome for episode, outcome in known.items() if not (stop and outcome.failure)}
    missing = [episode for episode in planned if episode not in known]
    watcher.begin(what, len(planned) - len(missing))
    instances = dict.fromkeys(episode.theta for episode in planned)
    over = {instance for instance in instances if enough and enough(instance, known)}
    order = longest_first(missing, store.seconds())
    if enough:
        # Agent by agent as planned; only within an agent the longest come first.
        place = {agent: number for number, agent in enumerate(dict.fromkeys(episode.agent for episode in planned))}
        order.sort(key=lambda episode: place[episode.agent])
    with running(study.family, order, settings.jobs, lambda episode: episode.theta in over) as outcomes:
        for outcome in outcomes:
            store.save_outcome(study.identity, outcome)
            watcher.episode()
            spent += Spent(1, outcome.seconds)
            if stop and outcome.failure:
                raise EpisodeError(f"{told(outcome)}; correct it and run again, or set on_failure = 'continue'")
            known[outcome.episode] = outcome
            instance = outcome.episode.theta
            if enough and instance not in over and enough(instance, known):
                over.add(instance)
    return spent


def known_outcomes(study: Study, store: Store, planned: Sequence[Episode]) -> dict[Episode, Outcome]:
    """Those of the episodes that the store has, with what became of them."""
    known: dict[Episode, Outcome] = {}
    for theta in dict.fromkeys(episode.theta for episode in planned):
        known |= store.outcomes(study.identity, dict(theta))
    return {episode: known[episode] for episode in planned if episode in known}


def longest_first(episodes: list[Episode], seconds: Mapping[tuple[str, int], float]) -> list[Episode]:
    """The episodes in the order that keeps several processes busy to the end, by how long their like took before."""
    return sorted(episodes, key=lambda episode: -seconds.get((episode.agent, episode.start), float("inf")))


def evaluation(study: Study, store: Store, theta: Theta) -> Evaluation | None:
    """Score a domain instance from what the store has; None if an episode is still missing.

    Each agent is scored over its own episodes that worked. A failed episode has no score, so none is made up for it;
    an agent without any cannot be compared, and then the instance has no score either.
    """
    planned = plan(study.settings, theta, study.settings.seed)
    known = known_outcomes(study, store, planned)
    return score(study, theta, list(known.values())) if len(known) == len(planned) else None


def score(study: Study, theta: Theta, outcomes: list[Outcome]) -> Evaluation:
    """Compare the outcomes of a domain instance's episodes with the target; a pure function."""
    failures = tuple(outcome for outcome in outcomes if outcome.metrics is None)
    worked = {outcome.episode.agent for outcome in outcomes if outcome.metrics is not None}
    for failed in failures:
        if failed.episode.agent not in worked:
            reason = f"agent '{failed.episode.agent}' failed from every start, first with: {failed.failure}"
            return Evaluation(theta, None, None, None, failures, reason)
    proxy = table(outcomes)
    metrics = study.settings.metrics
    usefulness = prpv(proxy=proxy, target=study.target, metrics=metrics)
    predictivity = ppv(proxy=proxy, target=study.target, metrics=metrics)
    return Evaluation(theta, proxy, usefulness.value, predictivity.value, failures)


def table(outcomes: list[Outcome]) -> ScoreTable:
    """The scores of the episodes that worked, labelled by their start."""
    scored: dict[tuple[str, str | int], Mapping[str, float]] = {
        (outcome.episode.agent, outcome.episode.start): outcome.metrics
        for outcome in outcomes
        if outcome.metrics is not None
    }
    return ScoreTable.from_episodes(scored)


def told(outcome: Outcome) -> str:
    """Which episode failed and why, in one phrase."""
    episode = outcome.episode
    return f"agent '{episode.agent}' failed from start {episode.start}: {outcome.failure}"
