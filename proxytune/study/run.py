"""The search of a study: its trials proposed, simulated and scored, until the budget is spent or a rule says stop.

A study scored anew by other metrics or tolerances, from the episodes it has; nothing is simulated.
Trials with failed episodes, once the code that failed has been corrected.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from proxytune.errors import InputError, RunError, SettingsError, StoreError
from proxytune.scores import Metric
from proxytune.search import BatchPoints, Proposer, Search, Trial
from proxytune.settings import nearest
from proxytune.storage import State, Store, TrialRecord
from proxytune.study.facts import CODE, DESCRIBED, SEARCH, adopt, describe, differ
from proxytune.study.opening import Objective, Study, changes, read_target, study_facts
from proxytune.study.preflight import FACT as NOT_REPEATABLE, check_some_work
from proxytune.study.pruning import Pruned, pruning_rule, rescored_pruned, run_or_prune, stopped
from proxytune.study.result import StudyResult, result_of
from proxytune.study.settings import LEARNING
from proxytune.study.study_run import Evaluation, StudyRun, plan_episodes

OTHERS = (LEARNING, SEARCH, DESCRIBED, NOT_REPEATABLE)
"""Facts that trials do not depend on: of a search for learning value, which code proposed what, looks, and agents."""


def run_trials(run: StudyRun, proposer: Proposer) -> None:
    """Run a study to the end of its budget, or until a rule stops it, from wherever it was left.

    The next batch is a function of the seed and the trials before it alone, and an episode that has been simulated is
    never simulated again: a study stopped at any moment goes on as if it had not been.

    Raises:
        SettingsError: If what the finished trials depend on has changed.
        EpisodeError: If an episode fails and the study is to stop then.
        RunError: If the machine fails, every episode of the first trial fails alike, or no trial of the initial
            design has a score.
        StoreError: If the database cannot be written.
    """
    check_facts(run)
    _drive_lost(run)
    settings = run.settings
    search = Search(settings.space, proposer, settings.seed, settings.budget, settings.initial, settings.batch)
    search.run(StudyTrials(run))


def _drive_lost(run: StudyRun) -> None:
    """Drive again the episodes of ended trials that a damaged study.db has lost."""
    for trial in run.finished_trials():
        planned = run.episodes_of(trial)
        if len(run.known(planned)) < len(planned):
            run.outcomes(planned, f"trial {trial.number} again")


class StudyTrials:
    """The trials of a study, as the search loop evaluates them."""

    def __init__(self, run: StudyRun) -> None:
        self._run = run
        self._done = run.finished_trials()

    def trials(self) -> Sequence[Trial]:
        """The finished trials, in order."""
        return [self._run.search_trial(trial) for trial in self._done]

    def ended(self) -> str:
        """Why the study runs no further; empty while it does.

        Raises:
            RunError: If nothing has worked: more of the same would only burn time.
        """
        why = stopped(self._run, self._done)
        failed = all(trial.state == "failed" for trial in self._done)
        if not why and failed and len(self._done) >= self._run.settings.initial:
            raise RunError(f"all {len(self._done)} trials failed; the first: {self._done[0].failure}")
        return why

    def evaluate(self, batch: range, propose: BatchPoints) -> None:
        """Simulate what is left of a batch, all its trials together, and keep how they ended."""
        trials = self._open(batch, propose)
        what = _name_trials(trials, self._run.settings.budget)
        against = pruning_rule(self._run, self._done[: batch.start])
        if against is None:
            outcomes = self._run.outcomes([one for trial in trials for one in self._run.episodes_of(trial)], what)
            if not self._done:
                check_some_work(outcomes.values(), what)
            cuts: list[Pruned | None] = [None] * len(trials)
        else:
            cuts = run_or_prune(self._run, trials, against, what)
        ended = [_end(self._run, trial, cut) for trial, cut in zip(trials, cuts, strict=True)]
        self._run.save_trials(*ended)
        self._done += ended
        self._tell(ended)

    def _open(self, batch: range, propose: BatchPoints) -> list[TrialRecord]:
        """What is left of a batch: open trials in the store, or else proposed, and in the store from now on."""
        done = len(self._done)
        trials = [trial for trial in self._run.open_trials() if done < trial.number <= batch.stop]
        if len(trials) < batch.stop - done:
            thetas = enumerate(map(self._run.settings.space.theta, propose()), start=batch.start + 1)
            trials += [TrialRecord(number, theta) for number, theta in thetas if number > done + len(trials)]
            self._run.save_trials(*trials)
        return trials

    def _tell(self, ended: Sequence[TrialRecord]) -> None:
        """Tell who watches of the best score so far and of each trial."""
        watcher, objective, settings = self._run.watcher, self._run.study.objective, self._run.settings
        scores = [trial.score for trial in self._done if trial.state == "finished" and trial.score is not None]
        if scores:
            watcher.best(objective.sign * min(scores))
        best = f", best so far {objective.sign * min(scores):g}" if scores else ""
        for trial in ended:
            came = came_to(trial, objective)
            watcher.finished(f"trial {trial.number} of {settings.budget}: {came}{best}")


def _name_trials(trials: Sequence[TrialRecord], budget: int) -> str:
    """Which trials these are, in one phrase."""
    first, last = trials[0].number, trials[-1].number
    return f"trial {first} of {budget}" if first == last else f"trials {first} to {last} of {budget}"


def came_to(trial: TrialRecord, objective: Objective) -> str:
    """What became of a trial, in one phrase."""
    if trial.state == "cut":
        return f"stopped early, {objective.label} at least {trial.bound:g}"
    return "failed" if trial.score is None else f"{objective.label} {objective.sign * trial.score:g}"


def _end(run: StudyRun, trial: TrialRecord, cut: Pruned | None) -> TrialRecord:
    """A trial as its episodes, all or those up to the cut, leave it."""
    if cut is None:
        return record(trial.number, run.evaluation_of(trial))
    ended = replace(trial, state="cut", decided=cut.decided, bound=cut.bound, score=cut.estimate)
    outcomes = run.known(run.episodes_of(ended)).values()
    return replace(ended, failed_episodes=sum(outcome.metrics is None for outcome in outcomes))


def check_facts(run: StudyRun) -> None:
    """See to it that what is in the store was made by this very study, or by earlier code that does the same.

    Raises:
        SettingsError: If there are finished trials and what they depend on has changed.
    """
    study, store = run.study, run.store
    adopt(study, store)
    before, after = _facts_before(store), study_facts(study)
    if before == after:
        describe(study, store)
        return
    if set(store.searches()) - {LEARNING}:
        raise _changed(study, store, before)
    others = {key: value for key, value in store.facts().items() if key in OTHERS}
    store.begin({**after, **others}, study.objective.name)
    describe(study, store)


def stored_run(study: Study, store: Store) -> StudyRun:
    """What is to be seen of a study: its run, of which nothing is simulated.

    Raises:
        SettingsError: If anything that the finished trials depend on has changed, apart from code.
    """
    return StudyRun(as_stored(study, store), store)


def as_stored(study: Study, store: Store) -> Study:
    """The study as its trials were run: with the domain family of then, where its code has changed since.

    Raises:
        SettingsError: If anything else that the finished trials depend on has changed.
    """
    before = _facts_before(store)
    then = replace(study, identity=before.get("identity", study.identity))
    after = study_facts(then)
    if before and differ(before, after):
        raise _changed(then, store, {**before, **{key: after[key] for key in CODE if key in after}})
    return then


def _facts_before(store: Store) -> dict[str, Any]:
    """The facts stored with the trials."""
    before = {key: value for key, value in store.facts().items() if key not in OTHERS}
    if not isinstance(before.get("versions", {}), dict):
        raise StoreError(f"{store.path}: 'versions' is not as proxytune writes it; restore a copy, or move it away")
    return before


def _changed(study: Study, store: Store, before: Mapping[str, Any]) -> SettingsError:
    settings = study.settings
    where = f"{settings.path}: {settings.family_name and f'families.{settings.family_name}: '}"
    database = store.path if settings.family_name else store.path.name
    return SettingsError(
        f"{where}changed since the first trial: {', '.join(changes(before, study_facts(study)))}; "
        f"put it back, or move {database} away to start again"
    )


def record(number: int, evaluation: Evaluation) -> TrialRecord:
    """A trial as the store keeps it, from what its episodes came to."""
    state: State = "failed" if evaluation.failure else "finished"
    score, measures = evaluation.score, evaluation.measures if state == "finished" else {}
    failed = len(evaluation.failures)
    return TrialRecord(number, evaluation.theta, state, score, measures, failed, evaluation.failure)


def with_metrics(study: Study, metrics: Sequence[Metric]) -> Study:
    """The study with its agents compared by these metrics instead.

    Raises:
        InputError: If the domain family or the target's table lacks one, or one is named twice.
    """
    names = [metric.name for metric in metrics]
    for name in names:
        if name not in study.family.metrics:
            raise InputError(f"--metric {name}: no such metric; {nearest(name, study.family.metrics)}")
        if names.count(name) > 1:
            raise InputError(f"--metric {name}: is given twice; give each metric once")
    settings = replace(study.settings, metrics=tuple(metrics))
    return replace(study, settings=settings, target=read_target(settings, study.family)[0])


def rescored(run: StudyRun, metrics: Sequence[Metric]) -> StudyResult:
    """The result that the study's trials give by these metrics; they remain those that its own metrics led to.

    Raises:
        InputError: If a metric cannot be used.
        RunError: If no trial has a score, or episodes are missing.
    """
    own, other = run.finished_trials(), run.of(with_metrics(run.study, metrics))
    trials = [_rescored(other, trial) for trial in own]
    return replace(result_of(other, trials), stopped=stopped(run, own))


def _rescored(other: StudyRun, trial: TrialRecord) -> TrialRecord:
    if trial.state == "cut":
        return rescored_pruned(other, trial)
    return record(trial.number, other.evaluation_of(trial))


def retry_failed(run: StudyRun) -> None:
    """Drive failed episodes of ended trials again where the user's code has changed since, and score these trials anew.

    Such a trial is driven in full, also if it was cut off before. θ of later trials stay what they are.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    for trial in run.finished_trials():
        if trial.failed_episodes and _has_changed(run, trial):
            run.outcomes(plan_episodes(run.settings, trial.theta, run.settings.seed), f"trial {trial.number} again")
            run.save_trials(record(trial.number, run.evaluation_of(trial)))


def _has_changed(run: StudyRun, trial: TrialRecord) -> bool:
    """Whether episodes are to be tried again, or were before this process and are not in the trial yet."""
    known = run.known(run.episodes_of(trial))
    failed = [episode for episode, outcome in known.items() if outcome.metrics is None]
    return len(failed) != trial.failed_episodes or any(episode in run.corrected for episode in failed)
