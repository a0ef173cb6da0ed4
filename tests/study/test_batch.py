"""Several θ are tried together; what comes of it depends on how many, and on nothing else."""

import sqlite3
from dataclasses import replace

import pytest
from partly_dead import ordered_study
from processes import episodes as stored_episodes
from stopping import Stopping

from proxytune.errors import SettingsError
from proxytune.running.progress import Silent
from proxytune.search.engines.registry import STUDY_ENGINES, make_proposer
from proxytune.search.proposer import propose_batch
from proxytune.storage.store import Store
from proxytune.study.knowledge import goal_of
from proxytune.study.run import run_study
from proxytune.study.stages.cutting import reference
from proxytune.study.stages.stopping import stopped
from proxytune.study.stop_rules import StopRules
from proxytune.study.study import facts, open_study
from proxytune.study.study_run import StudyRun

BATCH = 3
KEYS = {"batch": str(BATCH), "seed": "4", "engine": '"gp"'}
"""Of a study two trials of one batch of which are cut off."""


def changed(folder, **changes):
    study = open_study(folder)
    return replace(study, settings=replace(study.settings, **changes))


def run(folder, watcher=None, **changes):
    """What it cost, and the trials."""
    study = changed(folder, **changes)
    with Store.open(folder) as store:
        proposer = make_proposer(study.settings.engine, study.settings.initial, goal_of(StudyRun(study, store)))
        study_run = StudyRun(study, store, watcher or Silent())
        run_study(study_run, proposer)
        return study_run.spent, store.trials()


@pytest.fixture(scope="module")
def cutting(make_studies):
    """A study in batches, trials cut off, run with one job: its folder, what it cost and its trials."""
    folder = ordered_study(make_studies, "whole", **KEYS)
    return folder, *run(folder)


def test_the_thetas_of_a_batch_follow_from_the_trials_before_it(make_study):
    folder = make_study(batch=str(BATCH), budget="10", engine='"gp"')
    _, trials = run(folder)
    study = open_study(folder)
    with Store.read(folder) as store:
        told = [StudyRun(study, store).search_trial(trial) for trial in trials]
    for base, count in ((0, 3), (3, 2), (5, 3), (8, 2)):
        made = propose_batch(make_proposer("gp", 5), study.settings.space, told[:base], 1, count)
        assert made == tuple(trial.values for trial in told[base : base + count])
    assert [trial.number for trial in trials] == list(range(1, 11))
    assert len({tuple(trial.theta.items()) for trial in trials}) == 10


@pytest.mark.slow
def test_two_jobs_cut_off_the_same_trials_of_a_batch_at_the_same_agents_as_one(make_study, cutting):
    _, one, expected = cutting
    two, trials = run(ordered_study(make_study, **KEYS, jobs="2"))
    assert trials == expected
    assert sum(trial.state == "cut" for trial in trials[5:8]) > 1, "of the first batch of the engine"
    assert two.episodes - two.unused == one.episodes
    assert one.unused == 0


def test_each_trial_of_a_batch_is_held_against_the_trials_before_the_batch_by_its_own_agents(cutting):
    folder, _, trials = cutting
    study = open_study(folder)
    with Store.open(folder) as store:
        for trial in (trial for trial in trials if trial.state == "cut"):
            base = 5 + (trial.number - 6) // BATCH * BATCH
            against = reference(StudyRun(study, store), trials[:base])
            assert trial.decided == against.order[: len(trial.decided)]
            StudyRun(study, store).evaluate(trial.theta, "")
            assert StudyRun(study, store).evaluation(trial.theta).prpv >= trial.bound > against.limit


@pytest.mark.parametrize("first", [1, 4, 6, 9])
def test_a_budget_raised_within_a_batch_gives_the_trials_of_one_that_was_so_from_the_start(make_study, cutting, first):
    folder = ordered_study(make_study, "raised", **KEYS)
    assert len(run(folder, budget=first)[1]) == first
    assert run(folder)[1] == cutting[2]


def test_a_budget_lowered_within_an_open_batch_and_raised_again_changes_nothing(make_study, cutting):
    folder = ordered_study(make_study, "lowered", **KEYS)
    with pytest.raises(KeyboardInterrupt):
        run(folder, Stopping(5 * 24 + 7))
    _, trials = run(folder, budget=6)
    assert [trial.state == "open" for trial in trials] == [False] * 6 + [True] * 2
    assert run(folder)[1] == cutting[2]


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_interrupted_within_batches_it_goes_on_to_the_same_trials_and_runs_no_episode_twice(make_study, cutting, jobs):
    folder = ordered_study(make_study, "stopped", **KEYS, jobs=str(jobs))
    run_before = 0
    for moment, open_ones in ((30, 3), (50, 2), (60, 3), (8, 3)):
        with pytest.raises(KeyboardInterrupt):
            run(folder, Stopping(moment))
        run_before += moment
        with Store.read(folder) as store:
            assert sum(trial.state == "open" for trial in store.trials()) == open_ones
    spent, trials = run(folder)
    assert trials == cutting[2]
    assert spent.episodes - spent.unused <= cutting[1].episodes - run_before + (jobs > 1) * 9
    assert len(stored_episodes(folder)) == spent.episodes + run_before


@pytest.mark.parametrize("engine", STUDY_ENGINES)
def test_with_every_engine_an_interrupted_batch_goes_on_to_the_same_trials(make_study, engine):
    if engine == "tpe":
        pytest.importorskip("optuna")
    keys = {"engine": f'"{engine}"', "batch": "2", "initial": "3"}
    _, whole = run(make_study("whole", **keys))
    for episodes in (60, 20):
        with pytest.raises(KeyboardInterrupt):
            run(make_study("stopped", **keys), Stopping(episodes))
    assert run(make_study("stopped", **keys))[1] == whole


def test_a_batch_beyond_the_budget_is_cut_short_by_it(make_study):
    _, trials = run(make_study(batch="100"))
    assert [trial.state for trial in trials] == ["finished"] * 7


def test_rules_to_stop_are_asked_where_a_batch_has_ended(make_study):
    """The same rule stops a study by one trial at a time after its first."""
    folder = make_study(batch=str(BATCH))
    hurried = {"stop": StopRules(wall_time_s=1e-9)}
    assert len(run(folder, **hurried)[1]) == BATCH
    assert len(run(folder, **hurried)[1]) == BATCH
    _, trials = run(folder, budget=BATCH + 1)
    study = changed(folder, **hurried)
    with Store.read(folder) as store:
        assert stopped(StudyRun(study, store), trials) == ""
        assert stopped(StudyRun(study, store), trials[:BATCH]).startswith("episodes took")


class Listening(Silent):
    """Keeps what is begun."""

    def __init__(self):
        self.begun = []

    def begin(self, what, known):
        self.begun.append(what)


def test_what_is_told_of_the_progress_names_the_trials_of_a_batch(make_study):
    listening = Listening()
    run(make_study(batch="4", budget="10"), listening)
    expected = ["trials 1 to 4 of 10", "trial 5 of 10", "trials 6 to 9 of 10", "trial 10 of 10"]
    assert list(dict.fromkeys(listening.begun)) == expected


def test_a_study_from_before_there_were_batches_goes_on_one_trial_at_a_time_and_no_other_way(finished, make_study):
    """Its study.db says nothing of a batch, and neither does one of today with a batch of one."""
    assert "batch" not in facts(open_study(finished))
    with sqlite3.connect(finished / "study.db") as plain:
        assert plain.execute("SELECT count(*) FROM facts WHERE key = 'batch'").fetchone() == (0,)
    make_study(batch="1", budget="8")
    assert [trial.number for trial in run(finished)[1]] == list(range(1, 9))
    make_study(batch="2", budget="8")
    with pytest.raises(SettingsError, match=r"changed since the first trial: batch \(was 1\)"):
        run(finished)


def test_the_size_of_a_batch_may_not_change_under_way(make_study):
    run(make_study(batch="2", budget="4"))
    with pytest.raises(SettingsError, match=r"changed since the first trial: batch \(was 2\)"):
        run(make_study(budget="4"))
