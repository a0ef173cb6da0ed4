"""The loop of a study: propose a batch, simulate, score, until the budget is spent or a rule says stop."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from proxytune.errors import RunError, SettingsError
from proxytune.running.progress import Watcher
from proxytune.search.proposer import Proposer, Trial, batch_at, propose_batch
from proxytune.storage.records import State, TrialRecord
from proxytune.storage.store import Store
from proxytune.study.cutting import Cut, Reference, reference, run_or_cut
from proxytune.study.evaluation import Evaluation, Spent, evaluation, known_outcomes, run_missing
from proxytune.study.history import episodes_of
from proxytune.study.outputs import trial_of
from proxytune.study.stopping import stopped
from proxytune.study.study import Study, changes, facts


def run_study(study: Study, store: Store, proposer: Proposer, watcher: Watcher) -> Spent:
    """Run a study to the end of its budget, or until a rule stops it, from wherever it was left.

    The next batch is a function of the seed and the trials before it alone, and an episode that has been simulated is
    never simulated again: a study stopped at any moment goes on as if it had not been.

    Raises:
        SettingsError: If what the finished trials depend on has changed.
        EpisodeError: If an episode fails and the study is to stop then.
        RunError: If the machine fails, or no trial of the initial design has a score.
        StoreError: If the database cannot be written.
    """
    check_facts(study, store)
    spent = Spent()
    done = [trial for trial in store.trials() if trial.state != "open"]
    told = [trial_of(study, store, trial) for trial in done]
    while not stopped(study, store, done):
        _check_hope(study, done)
        batch = batch_at(len(done), study.settings.batch, study.settings.initial)
        opened = _opened(study, store, proposer, told, batch)
        against = reference(study, store, done[: batch.start])
        cost, ended = _evaluated(study, store, opened, against, watcher)
        spent += cost
        store.save_trial(study.identity, *ended)
        done += ended
        told += [trial_of(study, store, trial) for trial in ended]
        _tell_best(watcher, done)
    return spent


def _opened(study: Study, store: Store, proposer: Proposer, told: Sequence[Trial], batch: range) -> list[TrialRecord]:
    """What is left of a batch within the budget: open trials in the store, or else proposed, and in the store now.

    Where the budget once cut the batch short, the rest of it is what it would have been.
    """
    settings = study.settings
    last = min(batch.stop, settings.budget)
    found = [trial for trial in store.trials() if len(told) < trial.number <= last]
    if len(found) < last - len(told):
        made = propose_batch(proposer, settings.space, told[: batch.start], settings.seed, last - batch.start)
        thetas = enumerate(map(settings.space.theta, made), start=batch.start + 1)
        found += [TrialRecord(number, theta) for number, theta in thetas if number > len(told) + len(found)]
        store.save_trial(study.identity, *found)
    return found


def _evaluated(
    study: Study, store: Store, trials: Sequence[TrialRecord], against: Reference | None, watcher: Watcher
) -> tuple[Spent, list[TrialRecord]]:
    """Simulate trials to their end, or until each is cut off; what it cost and how they ended."""
    what = _told(trials, study.settings.budget)
    if against is None:
        planned = [episode for trial in trials for episode in episodes_of(study.settings, trial)]
        spent = run_missing(study, store, planned, watcher, what)
        return spent, [_ended(study, store, trial, None) for trial in trials]
    spent, cuts = run_or_cut(study, store, trials, against, watcher, what)
    return spent, [_ended(study, store, trial, cut) for trial, cut in zip(trials, cuts, strict=True)]


def _told(trials: Sequence[TrialRecord], budget: int) -> str:
    """Which trials these are, in one phrase."""
    first, last = trials[0].number, trials[-1].number
    return f"trial {first} of {budget}" if first == last else f"trials {first} to {last} of {budget}"


def _ended(study: Study, store: Store, trial: TrialRecord, cut: Cut | None) -> TrialRecord:
    """A trial as its episodes, all or those up to the cut, leave it."""
    if cut is None:
        return record(trial.number, evaluation(study, store, trial.theta))
    ended = replace(trial, state="cut", decided=cut.decided, bound=cut.bound, estimate=cut.estimate)
    outcomes = known_outcomes(study, store, episodes_of(study.settings, ended)).values()
    return replace(ended, failed_episodes=sum(outcome.metrics is None for outcome in outcomes))


def check_facts(study: Study, store: Store) -> None:
    """See to it that what is in the store was made by this very study.

    Raises:
        SettingsError: If there are finished trials and what they depend on has changed.
    """
    before, after = _facts_before(study, store), facts(study)
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
    before = _facts_before(study, store)
    then = replace(study, identity=before.get("identity", study.identity))
    if before and before != facts(then):
        raise _changed(then, store, before)
    return then


def _facts_before(study: Study, store: Store) -> dict[str, Any]:
    """The facts stored with the trials; databases older than cut_off lack that key."""
    before = store.facts()
    return {"cut_off": study.settings.cut_off, **before} if before else {}


def _changed(study: Study, store: Store, before: Mapping[str, Any]) -> SettingsError:
    return SettingsError(
        f"{study.settings.path}: changed since the first trial: {', '.join(changes(before, facts(study)))}; "
        f"put it back, or move {store.path.name} away to start again"
    )


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
