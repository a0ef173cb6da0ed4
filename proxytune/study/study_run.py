"""A study under way: from θ to episodes, outcomes and PRPV; what it needs is simulated once and kept in the store.

A domain instance is scored by every agent from every start (`plan_episodes`), compared with the target
(`evaluate_outcomes`). `StudyRun` is asked for outcomes or an evaluation and simulates what is missing. A search sees a
trial's score, and each agent's mean of every metric that both sides have (`outputs_of`), from which the score is
composed (`compose_of`). `measure_agents` scores the agents in one fixed domain: how a twin's target.csv is made.
"""

import itertools
import sys
from collections import Counter
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from proxytune.arrays import Floats
from proxytune.domain import DomainFamily, Episode, Instance, Outcome, instance_of
from proxytune.errors import EpisodeError, InputError, RunError
from proxytune.running import ENDED, ENDLESS, RAISED, Silent, Watch, Watcher, can_run_together, places, running
from proxytune.scores import ScoreTable
from proxytune.search import Compose, Goal, Knowledge, Trial, Values, learn_theta
from proxytune.seeds import episode_seed, fresh_seed
from proxytune.space import Space, Theta
from proxytune.storage import Store, TrialRecord
from proxytune.study.apart import find_apart, kept_apart, users_agents
from proxytune.study.family import load_family
from proxytune.study.opening import Study
from proxytune.study.settings import LEARNING, StudySettings
from proxytune.usefulness import dominance


@dataclass(frozen=True)
class Evaluation:
    """The usefulness of a domain instance."""

    theta: Theta  # the instance
    proxy: ScoreTable | None  # the agents' scores in it, over the episodes that worked; None if an agent has none
    # every measure by name, the objective's among them; one that is undefined is None; empty if an agent has no episode
    # that worked
    measures: Mapping[str, float | None]
    score: float | None  # what the study makes small; None if there is none
    failures: tuple[Outcome, ...]  # the outcomes that failed
    failure: str = ""  # why there is no score, empty if there is one
    # |α_proxy − α_target| of each pair of agents, in the order of their names, shape (agents, agents)
    disagreement: Floats | None = field(default=None, compare=False, repr=False)

    @property
    def prpv(self) -> float | None:
        """PRPV; None if an agent has no episode that worked."""
        return self.measures.get("prpv")


def plan_episodes(settings: StudySettings, theta: Theta, seed: int | None = None) -> list[Episode]:
    """The episodes that score a domain instance, every agent from every start; the study's seed unless given one."""
    study_seed = settings.seed if seed is None else seed
    instance, seeds = instance_of(theta), [episode_seed(study_seed, start) for start in range(settings.starts)]
    return [Episode(instance, agent, start, own) for agent in settings.agents for start, own in enumerate(seeds)]


def needed_metrics(settings: StudySettings, family: DomainFamily) -> list[str]:
    """The metrics of a family that agents are compared by: an episode without one of them has failed."""
    return [name for name in settings.metric_names if name in family.metrics]


def with_metrics_needed(outcome: Outcome, needed: Sequence[str]) -> Outcome:
    """The outcome; a failure where it lacks a metric that agents are compared by, as when these are others now."""
    lacks = [name for name in needed if outcome.metrics is not None and name not in outcome.metrics]
    return replace(outcome, metrics=None, failure=f"it has no finite '{lacks[0]}'") if lacks else outcome


@dataclass(frozen=True)
class Spent:
    """The cost of a run: episodes simulated, their time summed over all processes, and how many of them in vain."""

    episodes: int = 0
    seconds: float = 0.0
    unused: int = 0

    def __add__(self, other: "Spent") -> "Spent":
        return Spent(self.episodes + other.episodes, self.seconds + other.seconds, self.unused + other.unused)


def longest_first(episodes: Sequence[Episode], seconds: Mapping[tuple[str, int], float]) -> list[Episode]:
    """The episodes in the order that keeps several processes busy to the end, by how long their like took before."""
    return sorted(episodes, key=lambda episode: -seconds.get((episode.agent, episode.start), float("inf")))


def evaluate_outcomes(study: Study, theta: Theta, outcomes: Sequence[Outcome]) -> Evaluation:
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
    proxy, objective = score_table(outcomes), study.objective
    measures = objective.measure(proxy=proxy, target=study.target, metrics=study.settings.metrics)
    value = measures[objective.name]
    reason = "" if value is not None else f"{objective.label} is undefined here"
    pairs = disagreement_of(study, proxy, sorted(study.settings.agents))
    cost = None if value is None else objective.sign * value
    return Evaluation(theta, proxy, measures, cost, failures, reason, pairs)


def disagreement_of(study: Study, proxy: ScoreTable, agents: Sequence[str]) -> Floats:
    """|α_proxy − α_target| of each pair of these agents, in their order; eq. (4) sums it up to PRPV."""
    settings = study.settings
    sides = (table.select(settings.metric_names).arrange(agents=agents) for table in (proxy, study.target))
    one, other = (dominance(side.means, settings.metrics) for side in sides)
    return np.abs(one - other)


def score_table(*repetitions: Iterable[Outcome]) -> ScoreTable:
    """The scores of the episodes that worked, in the metrics that all of them have, labelled by their start.

    Of several repetitions each start is another episode every time, labelled START/REPETITION.
    """
    several = len(repetitions) > 1
    worked = {
        (one.episode.agent, f"{one.episode.start}/{number}" if several else str(one.episode.start)): one.metrics
        for number, outcomes in enumerate(repetitions)
        for one in outcomes
        if one.metrics is not None
    }
    return ScoreTable.from_episodes(_in_common(worked))


def _in_common(scored: Mapping[tuple[str, str], Mapping[str, float]]) -> dict[tuple[str, str | int], dict[str, float]]:
    """Scores by agent and episode, in the metrics that every one of them has."""
    whole = [name for name in next(iter(scored.values()), {}) if all(name in scores for scores in scored.values())]
    return {key: {name: scores[name] for name in whole} for key, scores in scored.items()}


def failure_of(outcome: Outcome) -> str:
    """Name the episode that failed, and why, in one phrase."""
    episode = outcome.episode
    return f"agent '{episode.agent}' failed from start {episode.start}: {outcome.failure}"


def score_trials(space: Space, done: Iterable[TrialRecord]) -> list[Trial]:
    """Finished trials as a search sees them that learns from scores alone."""
    return [Trial(space.values(trial.theta), trial.score) for trial in done]


def outputs_of(study: Study, outcomes: Collection[Outcome]) -> Values | None:
    """Every agent's mean metrics, in the order of the target's table, NaN where no episode tells of one.

    None where no episode tells of any. Where an agent failed from some starts, its mean is over the others; where some
    episodes lack a metric, that mean is over the others too.
    """
    names, rows = study.target.metrics, {agent: row for row, agent in enumerate(study.target.agents)}
    sums, counts = np.zeros((2, *study.target.means.shape))
    # In the order of the starts, so that a sum has the same last bit whatever came in first.
    for outcome in sorted(outcomes, key=lambda one: one.episode.start):
        if outcome.metrics is not None:
            row = rows[outcome.episode.agent]
            sums[row] += [outcome.metrics.get(name, 0.0) for name in names]
            counts[row] += [name in outcome.metrics for name in names]
    means = np.where(counts > 0.0, sums / np.maximum(counts, 1.0), np.nan)
    return None if np.isnan(means).all() else tuple(means.ravel().tolist())


def compose_of(study: Study) -> Compose:
    """The function of outputs that the study makes small, against its target."""
    metrics, table, objective = study.settings.metrics, study.target, study.objective
    compared = table.means[:, : len(metrics)]

    def compose(outputs: Floats) -> Floats:
        means = outputs.reshape(*outputs.shape[:-1], *table.means.shape)
        scores = objective.sign * objective.of_means(means[..., : len(metrics)], compared, metrics)
        finite = np.isfinite(scores)
        # Where a user's measure is undefined, no θ is better than the worst.
        return scores if finite.all() else np.where(finite, scores, scores.max(where=finite, initial=0.0))

    return compose


WAVE = 16
"""So many episodes for each process at once, before it is asked whether they are enough."""
Enough = Callable[[Instance, Mapping[Episode, Outcome]], bool]
"""True if the outcomes so far are enough of a domain instance, so that no more of its episodes begin."""


class StudyRun:
    """A study with its store: asked for outcomes or an evaluation, it simulates what is missing and returns them.

    Every finished episode is kept in the store at once, its watcher hears of it, and `spent` is what all has cost.
    """

    def __init__(self, study: Study, store: Store, watcher: Watcher | None = None) -> None:
        self.study, self.store, self.watcher = study, store, watcher or Silent()
        self.spent = Spent()
        self._evaluations: dict[Instance, Evaluation] = {}
        self._trials: dict[int, Trial] = {}
        self._learnt: dict[Hashable, Knowledge] = {}

    @property
    def settings(self) -> StudySettings:
        """The settings of study.toml."""
        return self.study.settings

    def of(self, study: Study) -> "StudyRun":
        """The run of another study whose episodes are kept in the same store."""
        return StudyRun(study, self.store, self.watcher)

    def finished_trials(self) -> list[TrialRecord]:
        """The trials that have ended, in order."""
        return [trial for trial in self.store.trials(self.study.objective.name) if trial.state != "open"]

    def open_trials(self) -> list[TrialRecord]:
        """The trials that have been proposed and have not ended, in order."""
        return [trial for trial in self.store.trials(self.study.objective.name) if trial.state == "open"]

    def save_trials(self, *trials: TrialRecord) -> None:
        """Keep trials."""
        self.store.save_trial(self.study.identity, *trials, objective=self.study.objective.name)

    def known(self, planned: Sequence[Episode]) -> dict[Episode, Outcome]:
        """The outcomes of those of the episodes that have been simulated."""
        known: dict[Episode, Outcome] = {}
        for theta in dict.fromkeys(episode.theta for episode in planned):
            known |= self.store.outcomes(self.study.identity, dict(theta))
        needed = needed_metrics(self.settings, self.study.family)
        return {e: with_metrics_needed(known[e], needed) for e in planned if e in known}

    def outcomes(self, planned: Sequence[Episode], what: str, enough: Enough | None = None) -> dict[Episode, Outcome]:
        """The outcomes of episodes; those not simulated yet are simulated now.

        A failed episode counts as known where failures do not stop the study and the code that failed is still the
        same; else it is tried again, since something is expected to have been corrected. An episode that an earlier run
        gave too little time is tried once more. With `enough`, agents begin in their order, each in all domain
        instances, and no episode begins in an instance of which enough is known. An EpisodeError is raised if one fails
        and the study is to stop then.
        """
        again = self.settings.stop_on_failure
        known = {e: o for e, o in self.known(planned).items() if not (o.failure and (again or e in self.corrected))}
        missing = [episode for episode in planned if episode not in known]
        self.watcher.begin(what, len(planned) - len(missing))
        if missing:
            self._simulate(planned, missing, known, enough)
        return {episode: known[episode] for episode in planned if episode in known}

    @cached_property
    def corrected(self) -> set[Episode]:
        """The episodes that failed in code that has changed since or for time alone, and were not tried again."""
        return self.store.failed_in_other_code(self.study.identity, self.study.code)

    def _simulate(
        self,
        planned: Sequence[Episode],
        missing: Sequence[Episode],
        known: dict[Episode, Outcome],
        enough: Enough | None,
    ) -> None:
        ended = {theta for theta in {episode.theta for episode in planned} if enough and enough(theta, known)}
        left, least = longest_first(missing, self.store.seconds()), len(missing)
        if enough:
            # Agents as planned, and only within a wave of them the longest first
            place = {agent: number for number, agent in enumerate(dict.fromkeys(one.agent for one in planned))}
            left.sort(key=lambda episode: place[episode.agent])
            least = WAVE * places(self.settings.jobs) if can_run_together(self.study.family) else least
        family, needed = self.study.family, needed_metrics(self.settings, self.study.family)
        with self.watched() as watch:
            while left:
                episodes = [one for one in left if one.theta not in ended]
                end = least
                while 0 < end < len(episodes) and episodes[end].agent == episodes[end - 1].agent:
                    end += 1
                wave, left = episodes[:end], episodes[end:]
                with running(family, wave, self.settings.jobs, lambda one: one.theta in ended, needed, watch) as fleets:
                    for outcomes in fleets:
                        self._keep(outcomes)
                        known.update({outcome.episode: outcome for outcome in outcomes})
                        thetas = {outcome.episode.theta for outcome in outcomes} - ended
                        ended.update(theta for theta in thetas if enough and enough(theta, known))

    @contextmanager
    def watched(self) -> Iterator[Watch]:
        """Watch episodes: one that ends this process is known to the next, and its agent is isolated then."""
        store, identity = self.store, self.study.identity
        left, agents = store.under_way(identity), store.agents_that_failed(ENDED, ENDLESS)
        watch = Watch(
            self.settings.episode_timeout_s,
            lambda one: one in left or one.agent in agents,
            lambda fleet: store.begin_episode(identity, *fleet),
            self.watcher.waiting,
            known=store.seconds(),
        )
        needed = needed_metrics(self.settings, self.study.family)
        try:
            apart = kept_apart(store, self.settings, self.study.family, self.study.code, needed, watch)
            yield replace(watch, alone=apart | store.agents_that_failed(RAISED))
        finally:
            # What Ctrl-C left open ends when the store is closed.
            if not isinstance(sys.exception(), GeneratorExit):
                store.begin_episode(identity)

    def _keep(self, outcomes: Sequence[Outcome]) -> None:
        """Keep the outcomes of a fleet; what took too long for the first time is tried again by the next run."""
        late = [one for one in outcomes if one.failure.startswith(ENDLESS) and one.episode not in self.corrected]
        for some, code in (([one for one in outcomes if one not in late], self.study.code), (late, "")):
            if some:
                self.store.save_outcome(self.study.identity, *some, code=code)
        for outcome in outcomes:
            self.corrected.discard(outcome.episode)
            self.watcher.episode()
            self.spent += Spent(1, outcome.seconds)
        failed = [outcome for outcome in outcomes if outcome.failure]
        if self.settings.stop_on_failure and failed:
            raise EpisodeError(f"{failure_of(failed[0])}; correct it and run again, or set on_failure = 'continue'")

    def evaluate(self, theta: Theta, what: str) -> Evaluation:
        """Score a domain instance by every agent from every start, unless one fails and the study is to stop then."""
        self.outcomes(plan_episodes(self.settings, theta), what)
        evaluation = self.evaluation(theta)
        assert evaluation is not None
        return evaluation

    def evaluation(self, theta: Theta) -> Evaluation | None:
        """The score of a domain instance; None if an episode of it has not been simulated."""
        key = instance_of(theta)
        if key not in self._evaluations:
            planned = plan_episodes(self.settings, theta)
            known = self.known(planned)
            if len(known) < len(planned):
                return None
            self._evaluations[key] = evaluate_outcomes(self.study, theta, list(known.values()))
        return self._evaluations[key]

    def evaluation_of(self, trial: TrialRecord) -> Evaluation:
        """The score of a finished trial; refused if the store lacks some of its episodes."""
        if evaluation := self.evaluation(trial.theta):
            return evaluation
        raise self._lacks_episodes(trial)

    def episodes_of(self, trial: TrialRecord) -> list[Episode]:
        """The episodes that a trial stands on: all, or those of the agents decided before it was pruned."""
        planned = plan_episodes(self.settings, trial.theta)
        return [episode for episode in planned if not trial.decided or episode.agent in trial.decided]

    def learn(self, trials: Iterable[Trial], goal: Goal) -> Knowledge:
        """What trials say of θ against a target; the last few answers are kept, since several stages ask for the same.

        Raises:
            RunError: If no trial has an outcome, or no output changes.
        """
        trials = tuple(trials)
        asked = trials, goal.values.tobytes(), goal.noise.tobytes()
        if asked not in self._learnt:
            self._learnt = dict([*self._learnt.items()][-2:])
            self._learnt[asked] = learn_theta(self.settings.space, trials, goal, self.settings.seed)
        return self._learnt[asked]

    def search_trial(self, trial: TrialRecord) -> Trial:
        """A finished trial as the search sees it; of one that was pruned, outputs of the agents driven until then."""
        if trial.number not in self._trials:
            # Of these the store may happen to have more: other processes had begun them.
            planned = self.episodes_of(trial)
            known = self.known(planned)
            if len(known) < len(planned):
                raise self._lacks_episodes(trial)
            values = self.settings.space.values(trial.theta)
            self._trials[trial.number] = Trial(values, trial.score, outputs_of(self.study, known.values()))
        return self._trials[trial.number]

    def _lacks_episodes(self, trial: TrialRecord) -> RunError:
        again = f"drive them again: python -m proxytune study {self.settings.home}"
        return RunError(f"{self.store.path}: lacks episodes of trial {trial.number}; {again}")


MOST_TRIALS, MOST_JOBS = 100_000, 1024


def with_spending(study: Study, *, budget: int | None = None, jobs: int | None = None) -> Study:
    """The study with this budget [trials] and this many processes; None leaves what study.toml says.

    Raises:
        InputError: If one is out of bounds, or the study's trials are not the ones that a budget counts.
    """
    for name, value, most in (("budget", budget, MOST_TRIALS), ("jobs", jobs, MOST_JOBS)):
        least = 0 if name == "budget" and study.settings.learn_from else 1
        if value is not None and not least <= value <= most:
            raise InputError(f"{name} must be between {least} and {most}, got {value}")
    settings = study.settings
    if budget is not None and settings.objective == LEARNING:
        told = f"a search for '{LEARNING}' has its own; set teaching.budget in this file instead"
        raise settings.error("budget", told)
    spending = replace(settings, budget=settings.budget if budget is None else budget, jobs=jobs or settings.jobs)
    return replace(study, settings=spending)


def measure_agents(
    settings: StudySettings,
    model: Path,
    seed: int,
    watcher: Watcher,
    repeats: int = 1,
    warn: Callable[[str], None] = lambda _: None,
) -> ScoreTable:
    """Score the study's agents over its starts in the domain that a model describes.

    Every metric of the family is kept that all episodes have; `warn` hears of any other. Rows are in the order of the
    study's agents and starts, whatever the number of jobs: the same model, settings and seed give the same table. Of
    several repeats, each has placement noise of its own, and episodes are labelled START/REPEAT; the first repeat is
    what a single one would be.

    Raises:
        InputError: If the settings, the model or the family cannot be used.
        EpisodeError: If any episode fails: a target has no holes.
    """
    family = load_family(settings, model)
    runs = [plan_episodes(settings, {}, fresh_seed(seed, repeat)) for repeat in range(repeats)]
    # By agent, then start, then repeat
    labels = {
        episode: f"{episode.start}/{repeat}" if repeats > 1 else str(episode.start)
        for alike in zip(*runs, strict=True)
        for repeat, episode in enumerate(alike)
    }
    watcher.begin(f"measuring {model.name}", 0)
    needed, left = needed_metrics(settings, family), Counter(episode.agent for episode in labels)
    metrics: dict[Episode, Mapping[str, float]] = {}
    watch = Watch(settings.episode_timeout_s, waits=watcher.waiting)
    watch = replace(watch, alone=find_apart(settings, family, users_agents(settings), needed, watch))
    with running(family, longest_first(list(labels), {}), settings.jobs, needed=needed, watch=watch) as fleets:
        for outcome in itertools.chain.from_iterable(fleets):
            if outcome.metrics is None:
                raise EpisodeError(failure_of(outcome))
            agent = outcome.episode.agent
            metrics[outcome.episode] = outcome.metrics
            watcher.episode()
            left[agent] -= 1
            if not left[agent]:
                watcher.finished(f"agent {agent} measured")
    for name in family.metrics:
        if missing := sum(name not in scores for scores in metrics.values()):
            warn(f"{name}: missing in {missing} of {len(metrics)} episodes, left out of the table")
    scored = {(episode.agent, label): metrics[episode] for episode, label in labels.items()}
    return ScoreTable.from_episodes(_in_common(scored))
