from dataclasses import replace

import pytest

from proxytune.domain import Outcome
from proxytune.errors import EpisodeError
from proxytune.seeds import episode_seed
from proxytune.storage.store import Store
from proxytune.study.evaluation import (
    longest_first,
    plan,
    score,
)
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun
from proxytune.usefulness import ppv, prpv

THETA = {"trim": 0.05, "delay": 0.1}


def simulated(folder, theta=THETA):
    study = open_study(folder)
    with Store.open(folder) as store:
        study_run = StudyRun(study, store)
        study_run.evaluate(theta, "")
        spent = study_run.spent
        return spent, StudyRun(study, store).evaluation(theta)


def test_every_agent_drives_from_every_start_under_common_random_numbers(make_study):
    study = open_study(make_study())
    here, there = (plan(study.settings, theta, 1) for theta in (THETA, {"trim": 0.2, "delay": 0.0}))
    assert {(e.agent, e.start) for e in here} == {(a, s) for a in study.settings.agents for s in range(3)}
    assert [(e.agent, e.start, e.seed) for e in here] == [(e.agent, e.start, e.seed) for e in there]
    assert {e.seed for e in here if e.start == 2} == {episode_seed(1, 2)}
    assert len({e.seed for e in here}) == 3


def test_seeds_differ_between_studies_and_starts():
    seeds = {episode_seed(study, start) for study in range(20) for start in range(10)}
    assert len(seeds) == 200


def test_the_score_is_what_the_usefulness_room_says_of_the_tables(make_study):
    folder = make_study()
    study = open_study(folder)
    _, found = simulated(folder)
    sides = {"proxy": found.proxy, "target": study.target, "metrics": study.settings.metrics}
    assert found.prpv == prpv(**sides).value > 0
    assert found.measures["ppv"] == ppv(**sides).value
    assert found.failures == ()


def test_an_episode_that_is_known_is_not_run_again(make_study, tmp_path):
    folder = make_study(domain={"journal": f'"{tmp_path / "journal"}"'})
    first, found = simulated(folder)
    again, same = simulated(folder)
    assert (first.episodes, again.episodes) == (18, 0)
    assert (found.prpv, found.measures["ppv"]) == (same.prpv, same.measures["ppv"])
    assert len((tmp_path / "journal").read_text().splitlines()) == 18


def test_an_instance_that_lacks_an_episode_has_no_evaluation_yet(make_study):
    folder = make_study()
    simulated(folder)
    with Store.open(folder) as store:
        assert StudyRun(open_study(folder), store).evaluation({"trim": 0.0, "delay": 0.0}) is None


def test_a_failed_episode_is_left_out_and_none_is_made_up_for_it(make_study):
    _, found = simulated(make_study(domain={"faults": '["agent3:1:raises", "agent4:0:nan"]'}))
    assert [(f.episode.agent, f.episode.start) for f in found.failures] == [("agent3", 1), ("agent4", 0)]
    assert found.prpv is not None
    row = found.proxy.agents.index("agent3")
    assert found.proxy.counts[row] == 2


def test_an_agent_without_any_episode_that_worked_fails_the_trial_by_name(make_study):
    _, found = simulated(make_study(domain={"faults": '["agent3:*:raises"]'}))
    assert (found.prpv, found.score, found.proxy) == (None, None, None)
    assert found.failure.startswith("agent 'agent3' failed from every start, first with: agent 'agent3' raised")


def test_where_failures_stop_the_study_the_first_does_and_is_tried_again_later(make_study, tmp_path):
    domain = {"faults": '["agent3:1:raises"]', "journal": f'"{tmp_path / "journal"}"'}
    folder = make_study(domain=domain, on_failure='"stop"')
    for _ in range(2):
        with pytest.raises(EpisodeError, match="agent 'agent3' failed from start 1: .*lost its way"):
            simulated(folder)
    lines = (tmp_path / "journal").read_text().splitlines()
    assert sum(line.startswith("agent3 1") for line in lines) == 2
    assert max(lines.count(line) for line in lines if not line.startswith("agent3 1")) == 1


def test_where_they_do_not_a_failure_is_final(make_study, tmp_path):
    domain = {"faults": '["agent3:1:raises"]', "journal": f'"{tmp_path / "journal"}"'}
    folder = make_study(domain=domain)
    simulated(folder)
    assert simulated(folder)[0].episodes == 0


def test_the_longest_episodes_begin_first_and_unknown_ones_before_them(make_study):
    planned = plan(open_study(make_study()).settings, THETA, 1)[:3]
    seconds = {(planned[0].agent, planned[0].start): 1.0, (planned[2].agent, planned[2].start): 2.0}
    assert longest_first(planned, seconds) == [planned[1], planned[2], planned[0]]


def test_scoring_does_not_depend_on_the_order_of_the_outcomes(make_study):
    folder = make_study()
    study = open_study(folder)
    outcomes = [Outcome(e, study.family.run(e), "", 0.0) for e in plan(study.settings, THETA, 1)]
    forth, back = score(study, THETA, outcomes), score(study, THETA, outcomes[::-1])
    assert (forth.prpv, forth.measures["ppv"]) == (back.prpv, pytest.approx(back.measures["ppv"], abs=1e-12))


@pytest.mark.parametrize("jobs", [1, 2])
def test_after_enough_no_further_episode_begins_and_those_under_way_are_kept(make_study, jobs):
    study = open_study(make_study(jobs=str(jobs)))
    planned = plan(study.settings, THETA, 1)
    with Store.open(study.settings.folder) as store:
        study_run = StudyRun(study, store)
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
    study = open_study(make_study(domain={"journal": f'"{journal}"'}))
    planned = plan(study.settings, THETA, 1)[::-1]
    with Store.open(study.settings.folder) as store:
        StudyRun(study, store).evaluate({"trim": 0.0, "delay": 0.0}, "")  # tells which episodes take longest
        journal.unlink()
        StudyRun(study, store).outcomes(planned, "", lambda _, known: False)
    driven = [line.split()[0] for line in journal.read_text().splitlines()]
    assert driven == [episode.agent for episode in planned]


def test_where_one_instance_has_enough_the_others_go_on_and_agents_begin_in_all_of_them(make_study, tmp_path):
    journal = tmp_path / "journal"
    study = open_study(make_study(domain={"journal": f'"{journal}"'}))
    plans = [plan(study.settings, {"trim": trim, "delay": 0.1}, 1) for trim in (0.0, 0.1, 0.2)]
    planned, short = [episode for one in plans for episode in one], plans[1][0].theta

    def enough(instance, known):
        return instance == short and sum(episode.theta == short for episode in known) >= 7

    with Store.open(study.settings.folder) as store:
        study_run = StudyRun(study, store)
        known = study_run.outcomes(planned, "", enough)
    assert study_run.spent.episodes == 18 + 7 + 18
    assert [sum(episode in known for episode in one) for one in plans] == [18, 7, 18]
    driven = [line.split()[0] for line in journal.read_text().splitlines()]
    assert driven == sorted(driven), "agent after agent, each in all instances"


def test_where_failures_stop_the_study_an_old_failure_is_not_enough(make_study):
    folder = make_study(domain={"faults": '["agent3:1:raises"]'})
    study = open_study(folder)
    planned = plan(study.settings, THETA, 1)
    with Store.open(folder) as store:
        StudyRun(study, store).outcomes(planned, "")
        stopping = replace(study, settings=replace(study.settings, stop_on_failure=True))
        with pytest.raises(EpisodeError, match="agent 'agent3'"):
            StudyRun(stopping, store).outcomes(planned, "", lambda _, known: len(known) == len(planned))
