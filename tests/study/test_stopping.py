from dataclasses import replace

import pytest

from proxytune.search.engines.registry import make_proposer
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.run import run_study
from proxytune.study.stages.stopping import stopped
from proxytune.study.stop_rules import StopRules
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun

NEVER, ALWAYS = 1e-9, 1e9


def ruled(folder, **rules):
    study = open_study(folder)
    return replace(study, settings=replace(study.settings, stop=StopRules(**rules)))


def run(study):
    """The trials, and why there are no more."""
    with Store.open(study.settings.folder) as store:
        study_run = StudyRun(study, store)
        run_study(study_run, make_proposer("gp", study.settings.initial))
        return store.trials(), stopped(StudyRun(study, store), store.trials())


def test_a_spent_budget_is_said(finished):
    trials, reason = run(ruled(finished))
    assert len(trials) == 7
    assert reason == "the budget of 7 trials is spent"


def test_a_study_under_way_is_not_stopped(finished):
    study = ruled(finished)
    with Store.read(finished) as store:
        assert stopped(StudyRun(study, store), store.trials()[:6]) == ""


RULES = {
    "time": ({"wall_time_s": NEVER}, 1, "s and stop.wall_time_s is 1e-09; raise or remove it to continue"),
    "no gain": ({"no_improvement": ALWAYS}, 5, "stop.no_improvement is 1e+09; lower or remove it to continue"),
}


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_stops_a_study_also_when_it_is_run_again_and_without_it_the_trials_are_those_of_one_without(
    make_study, finished, rule
):
    """`no_improvement` waits for the end of the design."""
    rules, count, told = RULES[rule]
    whole, _ = run(ruled(finished))
    folder = make_study("stopped")
    trials, reason = run(ruled(folder, **rules))
    assert trials == whole[:count]
    assert reason.endswith(told)
    assert run(ruled(folder, **rules)) == (trials, reason)
    assert run(ruled(folder))[0] == whole


@pytest.mark.parametrize("rules", [{"wall_time_s": ALWAYS}, {"no_improvement": NEVER}])
def test_a_rule_that_never_holds_changes_nothing(make_study, finished, rules):
    whole, _ = run(ruled(finished))
    trials, reason = run(ruled(make_study("ruled"), **rules))
    assert trials == whole
    assert reason == "the budget of 7 trials is spent"


def test_time_counts_over_all_runs_and_is_shared_among_jobs(finished):
    study = ruled(finished)
    with Store.read(finished) as store:
        trials = store.trials()[:6]
        known = [store.outcomes(study.identity, trial.theta) for trial in trials]
        taken = sum(outcome.seconds for outcomes in known for outcome in outcomes.values())
        assert stopped(StudyRun(ruled(finished, wall_time_s=0.9 * taken), store), trials)
        assert not stopped(StudyRun(ruled(finished, wall_time_s=1.1 * taken), store), trials)
        twice = ruled(finished, wall_time_s=0.9 * taken)
        assert not stopped(StudyRun(replace(twice, settings=replace(twice.settings, jobs=2)), store), trials)


def test_where_all_trials_failed_nothing_is_said_of_a_gain(finished):
    failed = [TrialRecord(number, {"trim": 0.0, "delay": 0.0}, "failed") for number in range(1, 7)]
    with Store.read(finished) as store:
        assert stopped(StudyRun(ruled(finished, no_improvement=ALWAYS), store), failed) == ""
