"""A study under way: what it needs of its domain family is simulated once, kept in the store, and remembered."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property

from proxytune.domain import Episode, Instance, Outcome, instance_of
from proxytune.errors import EpisodeError, RunError
from proxytune.running.episodes import ENDED, ENDLESS, Watch, running
from proxytune.running.progress import Silent, Watcher
from proxytune.search.proposer import Trial
from proxytune.space import Theta
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.evaluation import (
    Evaluation,
    Spent,
    failure_of,
    longest_first,
    needed_metrics,
    plan,
    score,
    with_metrics_needed,
)
from proxytune.study.outputs import outputs_of
from proxytune.study.settings import StudySettings
from proxytune.study.study import Study

Enough = Callable[[Instance, Mapping[Episode, Outcome]], bool]
"""Whether the outcomes so far are enough of a domain instance, so that no more of its episodes begin."""


class StudyRun:
    """A study with its store: asked for outcomes or an evaluation, it simulates what is missing and returns them.

    Attributes:
        study: The study.
        store: Where every finished episode is kept, at once.
        watcher: Hears of every episode.
        spent: What this run has cost so far.
    """

    def __init__(self, study: Study, store: Store, watcher: Watcher | None = None) -> None:
        self.study, self.store, self.watcher = study, store, watcher or Silent()
        self.spent = Spent()
        self._evaluations: dict[Instance, Evaluation] = {}
        self._trials: dict[int, Trial] = {}

    @property
    def settings(self) -> StudySettings:
        """What study.toml says."""
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
        """What became of those of the episodes that have been simulated."""
        known: dict[Episode, Outcome] = {}
        for theta in dict.fromkeys(episode.theta for episode in planned):
            known |= self.store.outcomes(self.study.identity, dict(theta))
        needed = needed_metrics(self.settings, self.study.family)
        return {e: with_metrics_needed(known[e], needed) for e in planned if e in known}

    def outcomes(self, planned: Sequence[Episode], what: str, enough: Enough | None = None) -> dict[Episode, Outcome]:
        """What becomes of episodes; those not simulated yet are simulated now.

        A failed episode counts as known where failures do not stop the study and the code that failed is still the
        same; else it is tried again, since something is expected to have been corrected. Where it is asked whether what
        is known of a domain instance is enough, agents begin in their order, each in all instances, and none more
        begins in an instance after a yes.

        Raises:
            EpisodeError: If an episode fails and the study is to stop then.
        """
        known = {e: one for e, one in self.known(planned).items() if not (one.failure and self._is_tried_again(e))}
        missing = [episode for episode in planned if episode not in known]
        self.watcher.begin(what, len(planned) - len(missing))
        if missing:
            self._simulate(planned, missing, known, enough)
        return {episode: known[episode] for episode in planned if episode in known}

    @cached_property
    def corrected(self) -> set[Episode]:
        """The episodes that failed in code that has changed since, and have not been tried again."""
        return self.store.failed_in_other_code(self.study.identity, self.study.code)

    def _is_tried_again(self, failed: Episode) -> bool:
        return self.settings.stop_on_failure or failed in self.corrected

    def _simulate(
        self,
        planned: Sequence[Episode],
        missing: Sequence[Episode],
        known: dict[Episode, Outcome],
        enough: Enough | None,
    ) -> None:
        """Simulate what is missing, and add it to what is known."""
        ended = {theta for theta in {episode.theta for episode in planned} if enough and enough(theta, known)}
        order = self._order(planned, missing, by_agent=enough is not None)
        family, needed = self.study.family, needed_metrics(self.settings, self.study.family)
        with (
            self.watched() as watch,
            running(family, order, self.settings.jobs, lambda one: one.theta in ended, needed, watch) as outcomes,
        ):
            for outcome in outcomes:
                self._keep(outcome)
                known[outcome.episode] = outcome
                theta = outcome.episode.theta
                if enough and theta not in ended and enough(theta, known):
                    ended.add(theta)

    @contextmanager
    def watched(self) -> Iterator[Watch]:
        """How episodes are watched: one that ends this process is known to the next, and its agent runs apart then."""
        under_way = self.store.under_way(self.study.identity)
        left, agents = under_way.left(), under_way.agents_that_failed(ENDED, ENDLESS)
        timeout_s = self.settings.episode_timeout_s
        with under_way.ended():
            watch = Watch(timeout_s, lambda one: one in left or one.agent in agents, under_way.begin)
            yield replace(watch, waits=self.watcher.waiting)

    def _order(self, planned: Sequence[Episode], missing: Sequence[Episode], *, by_agent: bool) -> list[Episode]:
        """The longest first; or agent by agent as planned, and only within an agent the longest first."""
        order = longest_first(missing, self.store.seconds())
        place = {agent: number for number, agent in enumerate(dict.fromkeys(episode.agent for episode in planned))}
        return sorted(order, key=lambda episode: place[episode.agent]) if by_agent else order

    def _keep(self, outcome: Outcome) -> None:
        self.store.save_outcome(self.study.identity, outcome, self.study.code)
        self.corrected.discard(outcome.episode)
        self.watcher.episode()
        self.spent += Spent(1, outcome.seconds)
        if self.settings.stop_on_failure and outcome.failure:
            raise EpisodeError(f"{failure_of(outcome)}; correct it and run again, or set on_failure = 'continue'")

    def evaluate(self, theta: Theta, what: str) -> Evaluation:
        """Score a domain instance by every agent from every start.

        Raises:
            EpisodeError: If an episode fails and the study is to stop then.
        """
        self.outcomes(plan(self.settings, theta, self.settings.seed), what)
        evaluation = self.evaluation(theta)
        assert evaluation is not None
        return evaluation

    def evaluation(self, theta: Theta) -> Evaluation | None:
        """The score of a domain instance; None if an episode of it has not been simulated."""
        key = instance_of(theta)
        if key not in self._evaluations:
            planned = plan(self.settings, theta, self.settings.seed)
            known = self.known(planned)
            if len(known) < len(planned):
                return None
            self._evaluations[key] = score(self.study, theta, list(known.values()))
        return self._evaluations[key]

    def evaluation_of(self, trial: TrialRecord) -> Evaluation:
        """The score of a finished trial.

        Raises:
            RunError: If the store lacks some of its episodes.
        """
        evaluation = self.evaluation(trial.theta)
        if evaluation is None:
            raise self._lacks_episodes(trial)
        return evaluation

    def episodes_of(self, trial: TrialRecord) -> list[Episode]:
        """The episodes that a trial stands on: all, or those of the agents decided before it was cut off."""
        planned = plan(self.settings, trial.theta, self.settings.seed)
        return [episode for episode in planned if not trial.decided or episode.agent in trial.decided]

    def search_trial(self, trial: TrialRecord) -> Trial:
        """A finished trial as the search sees it; of one that was cut off, the outputs of the agents driven until then.

        Of these the store may happen to have more: other processes had begun them.

        Raises:
            RunError: If the store lacks episodes of it.
        """
        if trial.number not in self._trials:
            planned = self.episodes_of(trial)
            known = self.known(planned)
            if len(known) < len(planned):
                raise self._lacks_episodes(trial)
            values = self.settings.space.values(trial.theta)
            self._trials[trial.number] = Trial(values, trial.score, outputs_of(self.study, known.values()))
        return self._trials[trial.number]

    def _lacks_episodes(self, trial: TrialRecord) -> RunError:
        path = self.store.path
        return RunError(f"{path}: lacks episodes of trial {trial.number}; move it away and run the study again")
