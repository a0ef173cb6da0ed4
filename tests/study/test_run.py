import re
import sqlite3
from dataclasses import replace

import pytest
from one_line import complaint_of
from searched import changed, searched
from stopping import Stopping
from telling import Telling

from proxytune.errors import EpisodeError, RunError, SettingsError
from proxytune.scores import Metric
from proxytune.storage import Store, TrialRecord
from proxytune.study import (
    PRPV,
    StudyRun,
    check_facts,
    open_study,
    rescored,
    result_of,
    score_trials,
    stored_run,
    with_metrics,
)
from proxytune.study.run import came_to
from proxytune.study.settings import StopRules

COARSE = (Metric.parse("distance:max:20%"), Metric.parse("survival_time:max"))


def found(folder, metrics):
    with Store.read(folder) as store:
        return rescored(StudyRun(open_study(folder), store), metrics)


def scores(result):
    return [trial.prpv for trial in result.trials]


@pytest.mark.slow
def test_every_trial_is_scored_as_a_study_of_these_metrics_would_have(finished, make_study):
    again = found(finished, COARSE)
    folder = make_study("other", metrics='["distance:max:20%", "survival_time:max"]')
    other, identity = open_study(folder), open_study(finished).identity
    with Store.read(finished) as store:
        expected = [
            StudyRun(replace(other, identity=identity), store).evaluation(trial.theta) for trial in store.trials()
        ]
        before = [trial.prpv for trial in store.trials()]
    assert scores(again) == [one.prpv for one in expected]
    assert scores(again) != before
    assert again.best.assessment.prpv.value == again.best.trial.prpv


@pytest.mark.slow
def test_why_a_study_has_stopped_is_not_judged_by_the_other_metrics(finished):
    study = changed(finished, budget=9, stop=StopRules(no_improvement=1e9))
    with Store.read(finished) as store:
        assert rescored(StudyRun(study, store), COARSE).stopped == result_of(StudyRun(study, store)).stopped != ""


REFUSED = {
    "unknown": (("distanse:max",), "--metric distanse: no such metric; did you mean 'distance'?"),
    "twice": (("distance:max", "distance:max:5%"), "--metric distance: is given twice; give each metric once"),
}


@pytest.mark.parametrize(("texts", "line"), REFUSED.values(), ids=REFUSED)
def test_a_metric_that_cannot_be_used_is_refused(finished, texts, line):
    assert complaint_of(with_metrics, open_study(finished), [Metric.parse(text) for text in texts]) == line


def test_metrics_that_no_trial_or_target_has_are_refused(finished):
    rows = [line.rsplit(",", 1)[0] for line in (finished / "target.csv").read_text().splitlines()]
    (finished / "other.csv").write_text("\n".join(rows) + "\n")
    study = changed(finished, targets=(finished / "other.csv",))
    assert re.search(r"other\.csv.*survival_time", complaint_of(with_metrics, study, COARSE))
    with Store.open(finished) as store:
        store.save_trial(
            open_study(finished).identity, TrialRecord(7, {"trim": 0.0, "delay": 0.1}, "finished", 3.0, {"prpv": 3.0})
        )
    with pytest.raises(RunError, match=r"study\.db: lacks episodes of trial 7"):
        found(finished, COARSE)


def run(folder, **changes):
    spent, trials = searched(changed(folder, **changes))
    return spent.episodes, trials


def test_a_study_spends_its_budget_and_then_no_more(make_study):
    folder = make_study()
    episodes, trials = run(folder)
    assert [trial.number for trial in trials] == [1, 2, 3, 4, 5, 6, 7]
    assert {trial.state for trial in trials} == {"finished"}
    assert episodes == 7 * 18
    assert run(folder) == (0, trials)


def test_an_interrupted_study_loses_no_episode_and_goes_on_to_the_same_trials(make_study, finished, tmp_path):
    _, whole = run(finished)
    journal = tmp_path / "journal"
    folder = make_study("stopped", domain={"journal": f'"{journal}"'})
    for episodes in (5, 40, 40):
        with pytest.raises(KeyboardInterrupt):
            searched(open_study(folder), Stopping(episodes))
    with sqlite3.connect(folder / "study.db") as plain:
        assert plain.execute("SELECT count(*) FROM episodes").fetchone() == (85,)
    episodes, trials = run(folder)
    assert episodes == 7 * 18 - 85
    assert trials == whole
    lines = journal.read_text().splitlines()
    assert len(lines) == len(set(lines)) == 7 * 18


def test_failures_are_counted_and_where_no_trial_works_it_stops_after_the_design_and_names_the_agent(make_study):
    folder = make_study(domain={"faults": '["agent3:1:raises"]'})
    _, trials = run(folder)
    assert {trial.failed_episodes for trial in trials} == {1}
    assert {trial.state for trial in trials} == {"finished"}
    folder = make_study("other", domain={"faults": '["agent3:*:raises"]'})
    with pytest.raises(RunError, match="all 5 trials failed; the first: agent 'agent3' failed from every start"):
        run(folder)
    with pytest.raises(RunError, match="all 5 trials failed"):
        run(folder)


def test_where_failures_stop_the_study_what_was_finished_is_kept(make_study):
    folder = make_study(domain={"faults": '["agent5:2:raises"]'}, on_failure='"stop"')
    with pytest.raises(EpisodeError, match="agent 'agent5'"):
        run(folder)
    with Store.read(folder) as store:
        (trial,) = store.trials()
        known = store.outcomes(open_study(folder).identity, trial.theta)
    assert trial.state == "open"
    assert len(known) == 18
    assert sum(outcome.metrics is None for outcome in known.values()) == 1


EDITS = {
    "the seed": ({"seed": "2"}, "seed (was 1)"),
    "the starts, and the seed": ({"starts": "2", "seed": "3"}, "starts (was 3), seed (was 1)"),
    "the design": ({"initial": "4"}, "initial (was 5)"),
    "the box": ({"parameters": {"trim": "[-0.2, 0.3]", "delay": "[0, 0.3]"}}, "parameters.trim (was [-0.3, 0.3])"),
    "another parameter": ({"parameters": {"trim": "[-0.3, 0.3]"}}, "parameters.delay (was [0.0, 0.3])"),
    "the metrics": ({"metrics": '["distance:max"]'}, "metrics"),
    "a tolerance": ({"metrics": '["distance:max:5%", "survival_time:max"]'}, "metrics"),
    "the agents": ({"agents": '["agent0", "agent1"]'}, "agents"),
    "the batch": ({"batch": "2"}, "batch (was 1)"),
    "the objective": ({"objective": '"ppv"'}, "objective"),
    "the engine": ({"engine": '"sobol"'}, 'engine (was "gp");'),
    "cutting off": ({"cut_off": "true"}, "cut_off (was false)"),
    "the domain": ({"domain": {"version": '"2"'}}, "domain.version (was nothing)"),
}


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_that_changes_what_a_trial_means_is_refused_by_name_and_nothing_is_lost(finished, make_study, edit):
    changes, expected = EDITS[edit]
    _, trials = run(finished)
    make_study(**changes)
    assert f"changed since the first trial: {expected}" in complaint_of(run, finished)
    make_study()
    assert run(finished) == (0, trials)


def test_a_changed_target_is_refused_but_not_what_the_study_does_not_use_of_it(finished, make_study):
    _, trials = run(finished)
    text = (finished / "target.csv").read_text()
    (finished / "target.csv").write_text(text + "somebody_else,0,1.0,2.0\n")
    assert run(finished) == (0, trials)
    (finished / "target.csv").write_text(text.replace("agent2,1,", "agent2,1,1"))
    with pytest.raises(SettingsError, match=r"target \(its contents\)"):
        run(finished)


def test_changed_code_of_the_family_is_refused_but_its_old_result_can_still_be_looked_at(finished, make_study):
    _, trials = run(finished)
    newer = replace(open_study(finished), identity="wobbly 2 ()")
    with Store.open(finished) as store:
        with pytest.raises(SettingsError, match="the domain family"):
            check_facts(StudyRun(newer, store))
        assert stored_run(newer, store).study.identity == open_study(finished).identity
        assert store.trials() == trials


def test_budget_jobs_name_and_what_failures_do_may_change_and_another_edit_is_not_looked_at(finished, make_study):
    _, trials = run(finished)
    make_study(jobs="2", on_failure='"stop"', name='"renamed"', budget="8")
    assert run(finished)[1][:7] == trials
    make_study(seed="3")
    with Store.read(finished) as store, pytest.raises(SettingsError, match=r"seed \(was 1\)"):
        stored_run(open_study(finished), store)


@pytest.mark.slow
def test_before_the_first_finished_trial_everything_may_change(make_study):
    folder = make_study()
    with pytest.raises(KeyboardInterrupt):
        searched(open_study(folder), Stopping(4))
    make_study(seed="2")
    assert len(run(folder)[1]) == 7


def test_the_search_sees_failed_trials_without_a_score_and_what_became_of_one_is_a_phrase(make_study):
    space = open_study(make_study()).settings.space
    done = [
        TrialRecord(1, {"trim": 0.1, "delay": 0.2}, "failed"),
        TrialRecord(2, {"trim": 0, "delay": 0}, "finished", 3),
    ]
    assert [(trial.values, trial.score) for trial in score_trials(space, done)] == [((0.2, 0.1), None), ((0.0, 0.0), 3)]
    large = replace(PRPV, label="Kendall τ", maximise=True)
    trials = {
        "PRPV 12": (TrialRecord(1, {}, "finished", 12.0), PRPV),
        "Kendall τ 0.5": (TrialRecord(1, {}, "finished", -0.5), large),
        "stopped early, PRPV at least 9": (TrialRecord(1, {}, "cut", 14.0, bound=9.0), PRPV),
        "failed": (TrialRecord(1, {}, "failed"), PRPV),
    }
    assert {came: came_to(*given) for came, given in trials.items()} == {came: came for came in trials}


def test_every_trial_is_told_with_its_score_and_the_best_so_far(make_study):
    telling = Telling()
    scores = [trial.score for trial in searched(open_study(make_study()), telling)[1]]
    assert telling.lines == [
        f"trial {number} of 7: PRPV {score:g}, best so far {min(scores[:number]):g}"
        for number, score in enumerate(scores, start=1)
    ]
