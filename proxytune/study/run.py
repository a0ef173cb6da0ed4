"""The loop of a study: propose, simulate, score, until the budget is spent or a rule says stop."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from proxytune.errors import RunError, SettingsError
from proxytune.search.proposer import Proposer, Trial
from proxytune.space import Theta
from proxytune.study.composition import trial_of
from proxytune.study.cutting import Reference, reference, run_or_cut
from proxytune.study.evaluate import Evaluation, Spent, evaluation, known_outcomes, simulate
from proxytune.study.history import episodes_of
from proxytune.study.progress import Watcher
from proxytune.study.stopping import stopped
from proxytune.study.store import State, Store, TrialRecord
from proxytune.study.study import Study, changes, facts


def run_study(study: Study, store: Store, proposer: Proposer, watcher: Watcher) -> Spent:
    """Run a study to the end of its budget, or until a rule stops it, from wherever it was left.

    The next θ is a function of the seed and the finished trials alone, and an episode that has been simulated is never
    simulated again: a study stopped at any moment goes on as if it had not been.

    Raises:
        SettingsError: If what the finished trials depend on has changed.
        EpisodeError: If an episode fails and the study is to stop then.
        RunError: If the machine fails, or no trial of the initial design has a score.
        StoreError: If the database cannot be written.
    """
    check_facts(study, store)
    spent = Spent()
    trials = store.trials()
    done = [trial for trial in trials if trial.state != "open"]
    told = [trial_of(study, store, trial) for trial in done]
    while not stopped(study, store, done):
        _check_hope(study, done)
        number = len(done) + 1
        theta = trials[-1].theta if len(trials) == number else _propose(study, proposer, told)
        store.save_trial(study.identity, TrialRecord(number, theta))
        against = reference(study, store, done)
        cost, ended = _evaluated(study, store, TrialRecord(number, theta), against, watcher)
        spent += cost
        done.append(ended)
        store.save_trial(study.identity, done[-1])
        told.append(trial_of(study, store, done[-1]))
        _tell_best(watcher, done)
    return spent


def _evaluated(
    study: Study, store: Store, trial: TrialRecord, against: Reference | None, watcher: Watcher
) -> tuple[Spent, TrialRecord]:
    """Simulate a trial to its end, or until it is cut off; what it cost and how it ended."""
    what = f"trial {trial.number} of {study.settings.budget}"
    if against is None:
        spent, cut = simulate(study, store, trial.theta, watcher, what), None
    else:
        spent, cut = run_or_cut(study, store, trial, against, watcher, what)
    if cut is None:
        return spent, record(trial.number, evaluation(study, store, trial.theta))
    ended = replace(trial, state="cut", decided=cut.decided, bound=cut.bound, estimate=cut.estimate)
    outcomes = known_outcomes(study, store, episodes_of(study.settings, ended)).values()
    return spent, replace(ended, failed_episodes=sum(outcome.metrics is None for outcome in outcomes))


def check_facts(study: Study, store: Store) -> None:
    """See to it that what is in the store was made by this very study.

    Raises:
        SettingsError: If there are finished trials and what they depend on has changed.
    """
    before, after = store.facts(), facts(study)
    if before == after:
        return
    if any(trial.state != "open" for trial in store.trials()):
        raise _changed(study, store, before)
    store.begin(after)


def as_stored(study: Study, store: Store) -> Study:
    """The study as its trials were run: with the domain family of then, where its code has changed since.

    Raises:
        SettingsError: If anything else that the finished trials depend on has changed.
    """
    before = store.facts()
    then = replace(study, identity=before.get("identity", study.identity))
    if before and before != facts(then):
        raise _changed(then, store, before)
    return then


def _changed(study: Study, store: Store, before: Mapping[str, Any]) -> SettingsError:
    return SettingsError(
        f"{study.settings.path}: changed since the first trial: {', '.join(changes(before, facts(study)))}; "
        f"put it back, or move {store.path.name} away to start again"
    )


def _propose(study: Study, proposer: Proposer, told: Sequence[Trial]) -> Theta:
    space = study.settings.space
    return space.theta(proposer.propose(space, told, study.settings.seed))


def record(number: int, found: Evaluation | None) -> TrialRecord:
    """A trial as the store keeps it, from what its episodes came to."""
    assert found is not None
    state: State = "failed" if found.failure else "finished"
    return TrialRecord(number, found.theta, state, found.prpv, found.ppv, len(found.failures), found.failure)


def _check_hope(study: Study, done: Sequence[TrialRecord]) -> None:
    """Stop where nothing has worked: more of the same would only burn time."""
    if len(done) >= study.settings.initial and all(trial.state == "failed" for trial in done):
        raise RunError(f"all {len(done)} trials failed; the first: {done[0].failure}")


def _tell_best(watcher: Watcher, done: Sequence[TrialRecord]) -> None:
    scores = [trial.prpv for trial in done if trial.prpv is not None]
    if scores:
        watcher.best(min(scores))
