"""Several θ are tried together; what comes of it depends on how many, and on nothing else."""

import sqlite3
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from partly_dead import ordered_study
from processes import episodes as stored_episodes
from searched import changed, running, searched
from stopping import Stopping
from taught import make_taught
from telling import Telling

from proxytune.domain import Outcome
from proxytune.errors import EpisodeError, InputError, SettingsError
from proxytune.running import Silent
from proxytune.search import ENGINE_NAMES, make_proposer, propose_batch
from proxytune.seeds import episode_seed
from proxytune.storage import Store, TrialRecord
from proxytune.study import (
    StudyRun,
    evaluate_outcomes,
    goal_of,
    measure_agents,
    open_study,
    plan_episodes,
    read_study_settings,
    study_facts,
    with_spending,
)
from proxytune.study.pruning import pruning_rule
from proxytune.study.run import stopped
from proxytune.study.settings import StopRules
from proxytune.study.study_run import longest_first
from proxytune.usefulness import assess, compare
from proxytune.usefulness.pairs import prpv
from proxytune.usefulness.predictivity import ppv

BATCH = 3
KEYS = {"batch": str(BATCH), "seed": "4", "engine": '"gp"'}
"""Of a study two trials of one batch of which are cut off."""


def run(folder, watcher=None, **changes):
    """What it cost, and the trials."""
    return searched(changed(folder, **changes), watcher)


@pytest.fixture(scope="module")
def cutting(make_studies):
    """A study in batches, trials cut off, run with one job: its folder, what it cost and its trials."""
    folder = ordered_study(make_studies, "whole", **KEYS)
    return folder, *run(folder)


@pytest.mark.slow
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
def test_each_trial_of_a_batch_is_held_against_the_trials_before_the_batch_by_its_own_agents(cutting):
    folder, _, trials = cutting
    study = open_study(folder)
    with Store.open(folder) as store:
        for trial in (trial for trial in trials if trial.state == "cut"):
            base = 5 + (trial.number - 6) // BATCH * BATCH
            against = pruning_rule(StudyRun(study, store), trials[:base])
            assert trial.decided == against.order[: len(trial.decided)]
            StudyRun(study, store).evaluate(trial.theta, "")
            assert StudyRun(study, store).evaluation(trial.theta).prpv >= trial.bound > against.limit


@pytest.mark.slow
@pytest.mark.parametrize("first", [1, 4, 6, 9])
def test_a_budget_raised_within_a_batch_gives_the_trials_of_one_that_was_so_from_the_start(make_study, cutting, first):
    folder = ordered_study(make_study, "raised", **KEYS)
    assert len(run(folder, budget=first)[1]) == first
    assert run(folder)[1] == cutting[2]


@pytest.mark.slow
def test_a_budget_lowered_within_an_open_batch_and_raised_again_changes_nothing(make_study, cutting):
    folder = ordered_study(make_study, "lowered", **KEYS)
    with pytest.raises(KeyboardInterrupt):
        run(folder, Stopping(5 * 24 + 7))
    _, trials = run(folder, budget=6)
    assert [trial.state == "open" for trial in trials] == [False] * 6 + [True] * 2
    assert run(folder)[1] == cutting[2]


def test_interrupted_within_batches_it_goes_on_to_the_same_trials_and_runs_no_episode_twice(make_study, cutting):
    folder = ordered_study(make_study, "stopped", **KEYS)
    run_before = 0
    for moment, open_ones in ((30, 3), (50, 2), (60, 3), (8, 3)):
        with pytest.raises(KeyboardInterrupt):
            run(folder, Stopping(moment))
        run_before += moment
        with Store.read(folder) as store:
            assert sum(trial.state == "open" for trial in store.trials()) == open_ones
    spent, trials = run(folder)
    assert trials == cutting[2]
    assert spent.episodes <= cutting[1].episodes - run_before
    assert len(stored_episodes(folder)) == spent.episodes + run_before


@pytest.mark.parametrize(
    "engine", [name if name == "outcomes" else pytest.param(name, marks=pytest.mark.slow) for name in ENGINE_NAMES]
)
def test_with_every_engine_an_interrupted_batch_goes_on_to_the_same_trials(make_study, engine):
    if engine == "tpe":
        pytest.importorskip("optuna")
    keys = {"engine": f'"{engine}"', "batch": "2", "initial": "3"}
    _, whole = run(make_study("whole", **keys))
    for episodes in (60, 20):
        with pytest.raises(KeyboardInterrupt):
            run(make_study("stopped", **keys), Stopping(episodes))
    assert run(make_study("stopped", **keys))[1] == whole


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


def test_what_is_told_of_the_progress_names_the_trials_of_a_batch(make_study):
    telling = Telling()
    run(make_study(batch="4", budget="10"), telling)
    expected = ["trials 1 to 4 of 10", "trial 5 of 10", "trials 6 to 9 of 10", "trial 10 of 10"]
    assert list(dict.fromkeys(telling.begun)) == expected


def test_a_study_from_before_there_were_batches_goes_on_one_trial_at_a_time_and_no_other_way(finished, make_study):
    """Its study.db says nothing of a batch, and neither does one of today with a batch of one."""
    assert "batch" not in study_facts(open_study(finished))
    with sqlite3.connect(finished / "study.db") as plain:
        assert plain.execute("SELECT count(*) FROM facts WHERE key = 'batch'").fetchone() == (0,)
    make_study(batch="1", budget="8")
    assert [trial.number for trial in run(finished)[1]] == list(range(1, 9))
    make_study(batch="2", budget="8")
    with pytest.raises(SettingsError, match=r"changed since the first trial: batch \(was 1\)"):
        run(finished)


THETA = {"trim": 0.05, "delay": 0.1}


def simulated(folder, theta=THETA):
    with running(folder) as run:
        run.evaluate(theta, "")
        return run.spent, StudyRun(run.study, run.store).evaluation(theta)


def test_every_agent_drives_from_every_start_under_common_random_numbers_the_longest_first(make_study):
    study = open_study(make_study())
    here, there = (plan_episodes(study.settings, theta, 1) for theta in (THETA, {"trim": 0.2, "delay": 0.0}))
    assert {(e.agent, e.start) for e in here} == {(a, s) for a in study.settings.agents for s in range(3)}
    assert [(e.agent, e.start, e.seed) for e in here] == [(e.agent, e.start, e.seed) for e in there]
    assert {e.seed for e in here if e.start == 2} == {episode_seed(1, 2)}
    assert len({e.seed for e in here}) == 3
    planned = plan_episodes(open_study(make_study()).settings, THETA, 1)[:3]
    seconds = {(planned[0].agent, planned[0].start): 1.0, (planned[2].agent, planned[2].start): 2.0}
    assert longest_first(planned, seconds) == [planned[1], planned[2], planned[0]]


def test_the_score_is_what_the_usefulness_room_says_of_the_tables_in_any_order_of_outcomes(make_study):
    folder = make_study()
    study = open_study(folder)
    _, found = simulated(folder)
    sides = {"proxy": found.proxy, "target": study.target, "metrics": study.settings.metrics}
    assert found.prpv == prpv(compare(**sides)).value > 0
    assert found.measures["ppv"] == ppv(compare(**sides)).value
    assert found.failures == ()
    outcomes = [Outcome(e, study.family.run(e), "", 0.0) for e in plan_episodes(study.settings, THETA, 1)]
    forth, back = evaluate_outcomes(study, THETA, outcomes), evaluate_outcomes(study, THETA, outcomes[::-1])
    assert (forth.prpv, forth.measures["ppv"]) == (back.prpv, pytest.approx(back.measures["ppv"], abs=1e-12))


def test_a_failure_is_left_out_and_an_agent_without_any_episode_that_worked_fails_the_trial_by_name(make_study):
    _, found = simulated(make_study(domain={"faults": '["agent3:1:raises", "agent4:0:nan"]'}))
    assert [(f.episode.agent, f.episode.start) for f in found.failures] == [("agent3", 1), ("agent4", 0)]
    assert found.prpv is not None
    assert found.proxy.counts[found.proxy.agents.index("agent3")] == 2
    _, found = simulated(make_study("other", domain={"faults": '["agent3:*:raises"]'}))
    assert (found.prpv, found.score, found.proxy) == (None, None, None)
    assert found.failure.startswith("agent 'agent3' failed from every start, first with: agent 'agent3' raised")


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_after_enough_no_further_episode_begins_and_those_under_way_are_kept(make_study, jobs):
    with running(make_study(jobs=str(jobs))) as study_run:
        planned = plan_episodes(study_run.settings, THETA, 1)
        known = study_run.outcomes(planned, "", lambda _, known: len(known) >= 5)
        assert known == study_run.known(planned)
        assert study_run.spent.episodes == len(known)
        assert len(known) == 5 if jobs == 1 else len(known) >= 5
        study_run.outcomes(planned, "", lambda _, known: len(known) >= 5)
        assert study_run.spent.episodes == len(known)
        assert list(study_run.outcomes(planned, "")) == planned
        assert study_run.spent.episodes == len(planned)


def test_where_it_may_be_enough_agents_are_driven_in_their_order(make_study, tmp_path):
    journal = tmp_path / "journal"
    with running(make_study(domain={"journal": f'"{journal}"'})) as study_run:
        planned = plan_episodes(study_run.settings, THETA, 1)[::-1]
        study_run.evaluate({"trim": 0.0, "delay": 0.0}, "")  # tells which episodes take longest
        journal.unlink()
        study_run.outcomes(planned, "", lambda _, known: False)
    driven = [line.split()[0] for line in journal.read_text().splitlines()]
    assert driven == [episode.agent for episode in planned]


def test_where_one_instance_has_enough_the_others_go_on_and_agents_begin_in_all_of_them(make_study, tmp_path):
    journal = tmp_path / "journal"
    study = open_study(make_study(domain={"journal": f'"{journal}"'}))
    plans = [plan_episodes(study.settings, {"trim": trim, "delay": 0.1}, 1) for trim in (0.0, 0.1, 0.2)]
    planned, short = [episode for one in plans for episode in one], plans[1][0].theta

    def enough(instance, known):
        return instance == short and sum(episode.theta == short for episode in known) >= 7

    with running(study) as study_run:
        known = study_run.outcomes(planned, "", enough)
    assert study_run.spent.episodes == 18 + 7 + 18
    assert [sum(episode in known for episode in one) for one in plans] == [18, 7, 18]
    driven = [line.split()[0] for line in journal.read_text().splitlines()]
    assert driven == sorted(driven), "agent after agent, each in all instances"


def test_where_failures_stop_the_study_an_old_failure_is_not_enough(make_study):
    folder = make_study(domain={"faults": '["agent3:1:raises"]'})
    with running(folder) as study_run:
        planned = plan_episodes(study_run.settings, THETA, 1)
        study_run.outcomes(planned, "")
        with pytest.raises(EpisodeError, match="agent 'agent3'"):
            StudyRun(changed(folder, stop_on_failure=True), study_run.store).outcomes(
                planned, "", lambda _, known: len(known) == len(planned)
            )


def test_where_failures_stop_the_study_the_first_does_and_is_tried_again_later(make_study, tmp_path):
    domain = {"faults": '["agent3:1:raises"]', "journal": f'"{tmp_path / "journal"}"'}
    folder = make_study(domain=domain, on_failure='"stop"')
    for _ in range(2):
        with pytest.raises(EpisodeError, match="agent 'agent3' failed from start 1: .*lost its way"):
            simulated(folder)
    lines = (tmp_path / "journal").read_text().splitlines()
    assert sum(line.startswith("agent3 1") for line in lines) == 2
    assert max(lines.count(line) for line in lines if not line.startswith("agent3 1")) == 1


@pytest.fixture
def model(write_file):
    return write_file("trim = 0.2\n", "model.toml")


def test_a_table_has_every_agent_start_and_metric_without_a_target_and_each_agent_is_told_of(make_study, model):
    settings = read_study_settings(make_study(metrics='["distance:max"]'))
    table = measure_agents(settings, model, 1001, Silent())
    assert table.agents == settings.agents
    assert table.episodes == ("0", "1", "2")
    assert table.metrics == ("distance", "survival_time")
    assert table.complete
    watcher = Telling()
    measure_agents(read_study_settings(make_study(agents='["agent1", "agent0"]')), model, 1001, watcher)
    assert sorted(watcher.lines) == ["agent agent0 measured", "agent agent1 measured"]
    folder = make_study()
    (folder / "target.csv").unlink()
    assert measure_agents(read_study_settings(folder), model, 1, Silent()).complete


@pytest.mark.slow
def test_the_number_of_jobs_changes_nothing_and_the_seed_and_the_model_do(make_study, model):
    lingering = {"faults": '["agent0:0:lingers"]'}
    one, two = (read_study_settings(make_study(f"jobs{jobs}", jobs=jobs, domain=lingering)) for jobs in ("1", "2"))
    table = measure_agents(one, model, 1001, Silent())
    same = measure_agents(two, model, 1001, Silent())
    assert (same.agents, same.episodes) == (table.agents, table.episodes)
    assert (same.values == table.values).all()
    assert (measure_agents(one, model, 1002, Silent()).values != table.values).all()
    model.write_text("trim = 0.1\n")
    assert (measure_agents(one, model, 1001, Silent()).values != table.values).any()


def test_a_target_of_repeats_has_a_floor_and_a_failing_episode_leaves_no_table(make_study, model):
    settings = read_study_settings(make_study())
    once, twice = (measure_agents(settings, model, 1001, Silent(), repeats) for repeats in (1, 2))
    assert assess(proxy=once, target=twice, metrics=settings.metrics).noise_floor.kind == "same starts"
    assert assess(proxy=once, target=once, metrics=settings.metrics).noise_floor.kind == "halves"
    settings = read_study_settings(make_study(domain={"faults": '["agent3:1:raises"]'}))
    with pytest.raises(EpisodeError, match="agent 'agent3' failed from start 1"):
        measure_agents(settings, model, 1, Silent())


@pytest.mark.parametrize("metrics", ['["survival_time:max"]', '["survival_time:max", "distance:min"]'])
def test_an_outcome_has_the_study_s_metrics_in_their_order_and_the_target_s_agents(make_study, metrics):
    agents = '["agent5", "agent0", "agent3", "agent1", "agent2", "agent4"]'
    study = open_study(make_study(agents=agents, metrics=metrics, budget="6", engine='"sobol"'))
    _, trials = searched(study)
    with Store.read(study.settings.folder) as store:
        told = [StudyRun(study, store).search_trial(trial) for trial in trials]
        composed = goal_of(StudyRun(study, store)).compose(np.array([trial.outcome for trial in told]))
    assert [trial.score for trial in told] == [trial.prpv for trial in trials] == composed.tolist()
    assert [trial.values for trial in told] == [study.settings.space.values(trial.theta) for trial in trials]
    assert len(set(composed)) > 1


def test_outputs_of_agents_without_an_episode_are_lacking_and_without_any_there_is_no_outcome(make_study):
    with running(make_study(domain={"faults": '["agent3:*:raises"]'})) as study_run:
        study_run.evaluate(THETA, "")
        told = study_run.search_trial(TrialRecord(1, THETA, "failed"))
    known = ~np.isnan(told.outcome).reshape(6, 2)
    assert told.score is None
    assert known.all(axis=1).tolist() == [True, True, True, False, True, True]
    with running(make_study("other", domain={"faults": str([f"agent{n}:*:raises" for n in range(6)])})) as study_run:
        study_run.evaluate(THETA, "")
        assert study_run.search_trial(TrialRecord(1, THETA, "failed")).outcome is None


def test_the_search_is_told_every_metric_that_both_sides_have_and_prpv_counts_the_study_s_own(finished):
    """A metric beside those compared is an output too; one with a hole in the target is none."""
    folder = finished
    lines = (folder / "target.csv").read_text().splitlines()
    (folder / "study.toml").write_text(
        (folder / "study.toml").read_text().replace('["distance:max", "survival_time:max"]', '["survival_time:max"]')
    )
    study = open_study(folder)
    assert study.target.metrics == ("survival_time", "distance")
    with Store.read(folder) as store:
        goal, done = goal_of(StudyRun(study, store)), store.trials()
        told = [StudyRun(study, store).search_trial(trial) for trial in done]
        alone = [StudyRun(study, store).evaluation(trial.theta).prpv for trial in done]
    assert goal.outputs[:2] == (("agent0", "survival_time"), ("agent0", "distance"))
    assert goal.compose(np.array([trial.outcome for trial in told])).tolist() == alone
    (folder / "target.csv").write_text("\n".join([*lines[:-1], ",".join(["agent5", "2", "", "7.0"])]) + "\n")
    assert open_study(folder).target.metrics == ("survival_time",)


def test_budget_and_jobs_alone_change_and_learning_value_has_its_budget_elsewhere(make_study):
    study = open_study(make_study())
    assert with_spending(study) == study
    other = with_spending(study, budget=40, jobs=3)
    assert (other.settings.budget, other.settings.jobs) == (40, 3)
    assert replace(other.settings, budget=7, jobs=1) == study.settings
    assert study_facts(other) == study_facts(study)
    study = open_study(make_taught(make_study, objective='"plv"', engine='"gp"'))
    with pytest.raises(InputError, match=r"study.toml: budget: .*set teaching.budget in this file instead"):
        with_spending(study, budget=4)
    assert with_spending(study, jobs=4).settings.jobs == 4


def test_one_trial_is_spent_as_one():
    run = SimpleNamespace(settings=SimpleNamespace(budget=1, stop=None))
    assert stopped(run, [None]) == "the budget of 1 trial is spent"
    assert stopped(run, [None, None]) == "the budget of 1 trial is spent; all 2 that are finished count"


def test_what_watches_episodes_writes_as_it_ends_and_nothing_where_python_ends_what_was_left_open(make_study):
    with running(make_study()) as study_run:
        episode = study_run.episodes_of(TrialRecord(1, {"trim": 0.1, "delay": 0.2}))[0]
        study_run.store.begin_episode(study_run.study.identity, episode)
        left = study_run.watched()
        left.__enter__()
        del left
        assert study_run.store.under_way(study_run.study.identity) == [episode]
        with study_run.watched():
            pass
        assert study_run.store.under_way(study_run.study.identity) == []
