"""A trial that cannot be among the best any more is cut off, the same way however it is run."""

import json
import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from partly_dead import ordered_study
from searched import changed, looked_at, searched

from proxytune.scores import Metric
from proxytune.storage import Store, TrialRecord
from proxytune.study import StudyRun, open_study, rescored, score_trials
from proxytune.study.pruning import pruning_rule, spared
from proxytune.study.run import stopped
from proxytune.study.settings import StopRules

BUDGET, ALL = 14, 8 * 3
"""Trials, and episodes of one that is not cut off."""


@pytest.fixture
def cutting(make_study):
    """Writes such a study."""
    return lambda called="cutting", **changes: ordered_study(make_study, called, **changes)


@pytest.fixture(scope="module")
def done_once(make_studies):
    """Such a study, run once."""
    return run(ordered_study(make_studies))


@pytest.fixture
def done(done_once, tmp_path):
    """The same in a folder of one's own."""
    spent, trials, found = done_once
    folder = Path(shutil.copytree(found.study.settings.folder, tmp_path / "done"))
    return spent, trials, replace(found, study=open_study(folder))


def run(folder, **changes):
    study = changed(folder, **changes)
    return *searched(study), looked_at(study)


def test_trials_are_cut_off_after_the_design_and_would_have_scored_no_less_than_their_bounds(done, cutting):
    spent, trials, found = done
    cut = [trial for trial in trials if trial.state == "cut"]
    assert cut
    assert min(trial.number for trial in cut) > 5
    assert all(3 <= len(trial.decided) + 1 <= 8 and trial.prpv is None for trial in cut)
    assert spent.episodes == found.episodes == BUDGET * ALL - 3 * sum(8 - len(trial.decided) for trial in cut)
    assert found.spared[0] == BUDGET * ALL - spent.episodes
    with Store.open(found.study.settings.folder) as store:
        for trial in trials:
            if trial.state == "cut":
                limit = pruning_rule(StudyRun(found.study, store), trials[: trial.number - 1]).limit
                StudyRun(found.study, store).evaluate(trial.theta, "")
                assert StudyRun(found.study, store).evaluation(trial.theta).prpv >= trial.bound > limit
                assert trial.estimate >= trial.bound


def test_a_cut_trial_is_told_by_its_estimate_and_the_agents_that_tell_most_come_first(done):
    _, trials, found = done
    told = score_trials(found.study.settings.space, trials)
    assert [one.score for one in told] == [t.estimate if t.state == "cut" else t.prpv for t in trials]
    assert found.best.trial.state == "finished"
    with sqlite3.connect(found.study.settings.folder / "study.db") as plain:
        rows = plain.execute(
            "SELECT number, measures, decided, bound, score FROM trials WHERE state = 'cut'"
        ).fetchall()
    assert [(row[0], row[1], tuple(json.loads(row[2])), *row[3:]) for row in rows] == [
        (trial.number, "{}", trial.decided, trial.bound, trial.estimate) for trial in trials if trial.state == "cut"
    ]
    with Store.open(found.study.settings.folder) as store:
        against = pruning_rule(StudyRun(found.study, store), trials)
        assert pruning_rule(StudyRun(found.study, store), trials[:4]) is None
    rows = against.disagreement
    assert sorted(against.order) == sorted(found.study.settings.agents)
    assert rows[0, 1] == rows.max()
    assert all(rows[:k, k].sum() >= rows[:k, k + 1 :].sum(axis=0).max() for k in range(1, 7))
    assert against.limit > min(trial.prpv for trial in trials if trial.prpv is not None)


@pytest.mark.parametrize("engine", [pytest.param(name, marks=pytest.mark.slow) for name in ("gp", "random", "sobol")])
def test_two_jobs_cut_off_the_same_trials_at_the_same_agents_as_one(cutting, done, engine):
    one = done if engine == "gp" else run(cutting("one", engine=f'"{engine}"'), jobs=1)
    two = run(cutting("two", engine=f'"{engine}"'), jobs=2)
    assert two[1] == one[1]
    assert two[0].episodes - two[0].unused == one[0].episodes
    assert one[0].unused == 0
    for spent, _, found in (one, two):
        assert found.spared[0] == BUDGET * ALL - spent.episodes, "what was run in vain was not spared"


@pytest.mark.slow
def test_episodes_run_in_vain_change_nothing(cutting, done):
    """All episodes of every trial are known beforehand, in which case nothing is simulated at all."""
    _, trials, _ = done
    folder = cutting("known")
    study = open_study(folder)
    with Store.open(folder) as store:
        for trial in trials:
            StudyRun(study, store).evaluate(trial.theta, "")
    spent, again, _ = run(folder)
    assert (spent.episodes, again) == (0, trials)


@pytest.mark.slow
def test_where_a_tolerance_is_a_percentage_no_trial_is_cut_off(cutting):
    _, trials, _ = run(cutting(metrics='["distance:max:1%", "survival_time:max"]', budget="8"))
    assert {trial.state for trial in trials} == {"finished"}


@pytest.mark.slow
def test_an_agent_that_always_fails_is_a_failure_and_no_reason_to_cut_off(make_study):
    _, trials, found = run(make_study(cut_off="true", domain={"faults": '["agent3:1:raises"]'}, budget="9"))
    assert {trial.state for trial in trials} <= {"finished", "cut"}
    for trial in trials:
        assert trial.failed_episodes == (not trial.decided or "agent3" in trial.decided)
    assert found.failed_episodes == sum(trial.failed_episodes for trial in trials)


@pytest.mark.slow
def test_the_order_of_agents_in_the_settings_does_not_matter(cutting, done):
    folder = cutting("turned", agents="[" + ", ".join(f'"agent{number}"' for number in range(7, -1, -1)) + "]")
    assert run(folder)[1] == done[1]


def test_trials_and_the_search_stand_on_decided_agents_alone_and_what_was_spared_is_counted(done):
    _, _, found = done
    trial = TrialRecord(1, {"first": 0.0, "second": 0.0}, "cut", decided=("agent2", "agent5"), bound=1.0, score=2.0)
    driven = StudyRun(found.study, None).episodes_of(trial)
    assert {episode.agent for episode in driven} == {"agent2", "agent5"}
    assert len(driven) == 6
    assert len(StudyRun(found.study, None).episodes_of(replace(trial, state="finished", decided=()))) == ALL

    _, trials, found = done
    with Store.open(found.study.settings.folder) as store:
        seconds = store.seconds()
        episodes, spared_seconds = spared(StudyRun(found.study, store), trials)
    missing = [
        seconds[agent, start]
        for trial in trials
        for agent in found.study.settings.agents
        for start in range(3)
        if trial.decided and agent not in trial.decided
    ]
    assert episodes == len(missing)
    assert spared_seconds == pytest.approx(sum(missing))
    cut, study = next(trial for trial in trials if trial.state == "cut"), found.study
    with Store.open(found.study.settings.folder) as store:
        before = StudyRun(found.study, store).search_trial(cut)
        StudyRun(found.study, store).evaluate(cut.theta, "")
        assert np.array_equal(StudyRun(found.study, store).search_trial(cut).outcome, before.outcome, equal_nan=True)
    known = ~np.isnan(before.outcome).reshape(study.target.means.shape).any(axis=1)
    assert {agent for agent, is_known in zip(study.target.agents, known, strict=True) if is_known} == set(cut.decided)


@pytest.mark.slow
def test_by_other_metrics_a_cut_trial_is_bounded_by_its_own_agents_and_by_its_own_it_keeps_its_bound(done):
    _, trials, found = done
    with Store.read(found.study.settings.folder) as store:
        own = rescored(StudyRun(found.study, store), found.study.settings.metrics)
        other = rescored(StudyRun(found.study, store), [Metric.parse("distance:max:2")])
    assert [trial.bound for trial in own.trials] == [trial.bound for trial in trials]
    assert [trial.state for trial in other.trials] == [trial.state for trial in trials]
    assert [trial.bound for trial in other.trials] != [trial.bound for trial in trials]


NEVER, ALWAYS = 1e-9, 1e9


def ruled(folder, **rules):
    return changed(folder, stop=StopRules(**rules))


def run_of_stopping(study):
    """The trials, and why there are no more."""
    return searched(study)[1], looked_at(study).stopped


RULES = {
    "time": ({"wall_time_s": NEVER}, 1, "s and stop.wall_time_s is 1e-09; raise or remove it to continue"),
    "no gain": ({"no_improvement": ALWAYS}, 5, "stop.no_improvement is 1e+09; lower or remove it to continue"),
}


@pytest.mark.slow
@pytest.mark.parametrize("rule", RULES)
def test_a_rule_stops_a_study_also_run_again_and_without_it_trials_are_those_of_one_without(make_study, finished, rule):
    """`no_improvement` waits for the end of the design."""
    rules, count, told = RULES[rule]
    whole, _ = run_of_stopping(ruled(finished))
    folder = make_study("stopped")
    trials, reason = run_of_stopping(ruled(folder, **rules))
    assert trials == whole[:count]
    assert reason.endswith(told)
    assert run_of_stopping(ruled(folder, **rules)) == (trials, reason)
    assert run_of_stopping(ruled(folder))[0] == whole


@pytest.mark.parametrize("rules", [{}, {"wall_time_s": ALWAYS}, {"no_improvement": NEVER}])
def test_a_study_under_way_is_not_stopped_by_a_rule_that_does_not_hold(finished, rules):
    with Store.read(finished) as store:
        assert stopped(StudyRun(ruled(finished, **rules), store), store.trials()[:6]) == ""


def test_rules_to_stop_hold_over_all_runs_and_jobs_and_not_without_a_trial(finished):
    study = ruled(finished)
    with Store.read(finished) as store:
        trials = store.trials()[:6]
        known = [store.outcomes(study.identity, trial.theta) for trial in trials]
        taken = sum(outcome.seconds for outcomes in known for outcome in outcomes.values())
        assert stopped(StudyRun(ruled(finished, wall_time_s=0.9 * taken), store), trials)
        assert not stopped(StudyRun(ruled(finished, wall_time_s=1.1 * taken), store), trials)
        assert not stopped(StudyRun(changed(finished, stop=StopRules(wall_time_s=0.9 * taken), jobs=2), store), trials)
    failed = [TrialRecord(number, {"trim": 0.0, "delay": 0.0}, "failed") for number in range(1, 7)]
    with Store.read(finished) as store:
        assert stopped(StudyRun(ruled(finished, no_improvement=ALWAYS), store), failed) == ""
