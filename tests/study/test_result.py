from dataclasses import replace

import pytest

from proxytune.errors import RunError
from proxytune.search.engines.registry import make_proposer
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.result import result_of
from proxytune.study.run import run_study
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun
from proxytune.usefulness import assess


def result(folder):
    with Store.read(folder) as store:
        return result_of(StudyRun(open_study(folder), store))


def run(folder):
    study = open_study(folder)
    with Store.open(folder) as store:
        study_run = StudyRun(study, store)
        run_study(study_run, make_proposer("gp", study.settings.initial))
    return result(folder)


def test_the_best_theta_is_a_visited_one_and_its_measures_are_those_of_its_episodes(finished):
    found = result(finished)
    assert found.best.trial in found.trials
    assert found.best.assessment.prpv.value == found.best.trial.prpv
    assert found.best.assessment.ppv.value == found.best.trial.ppv
    assert (found.episodes, found.failed_episodes, found.failures) == (7 * 18, 0, ())


def test_the_best_is_the_surrogate_s_and_not_the_lowest_score(finished):
    """A trial that is told to have scored 0 amid bad neighbours is not the best for that."""
    study = open_study(finished)
    with Store.open(finished) as store:
        worst = max(store.trials(), key=lambda trial: trial.prpv)
        near = {name: value + 1e-4 for name, value in worst.theta.items()}
        lucky = TrialRecord(8, near, "finished", 0.0, {"prpv": 0.0})
        StudyRun(study, store).evaluate(near, "")
        store.save_trial(study.identity, lucky)
    assert result(finished).best.trial.number not in (8, worst.number)


def test_noise_floor_and_chance_are_those_of_the_target(finished):
    found = result(finished)
    study = found.study
    table = found.best.assessment.inputs.proxy
    again = assess(proxy=table, target=study.target, metrics=study.settings.metrics)
    assert found.best.assessment.noise_floor.value == again.noise_floor.value
    assert found.best.assessment.chance.mean == again.chance.mean


def test_failures_are_counted_and_the_first_are_told(make_study):
    found = run(make_study(domain={"faults": '["agent3:1:raises", "agent2:0:nan"]'}))
    assert found.failed_episodes == 14
    assert len(found.failures) == 10
    assert found.failures[0].startswith("trial 1: agent 'agent2' failed from start 0: ")


def test_an_open_trial_does_not_count(finished):
    study = open_study(finished)
    with Store.open(finished) as store:
        store.save_trial(study.identity, TrialRecord(8, {"trim": 0.0, "delay": 0.0}))
    assert len(result(finished).trials) == 7


def test_without_a_scored_trial_it_says_so(make_study):
    folder = make_study()
    with Store.open(folder) as store:
        study = open_study(folder)
        with pytest.raises(RunError, match="no trial is finished yet"):
            result_of(StudyRun(study, store))
        store.save_trial(
            study.identity, TrialRecord(1, {"trim": 0.0, "delay": 0.0}, "failed", failure="agent 'x' fell")
        )
        with pytest.raises(RunError, match="all trials failed, the first because agent 'x' fell"):
            result_of(StudyRun(study, store))


def test_episodes_that_have_gone_missing_are_told(finished):
    study = open_study(finished)
    with Store.read(finished) as store, pytest.raises(RunError, match="lacks episodes of trial"):
        result_of(StudyRun(replace(study, identity="another"), store))


def test_a_study_can_be_summed_up_from_its_first_trial_on(make_study):
    for budget in ("1", "2"):
        found = run(make_study(budget=budget, initial="1"))
        assert len(found.trials) == int(budget)
        assert found.knowledge.misfit.fits is None
        assert 0.0 < found.knowledge.posterior.share <= 1.0
        assert found.knowledge.as_good[0] >= 0.0
