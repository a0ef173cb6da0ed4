from dataclasses import replace

import pytest

from proxytune.errors import InputError, RunError
from proxytune.scores import Metric
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.rescoring import rescored, with_metrics
from proxytune.study.result import result_of
from proxytune.study.stop_rules import StopRules
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun

COARSE = (Metric.parse("distance:max:20%"), Metric.parse("survival_time:max"))
OWN = (Metric.parse("distance:max"), Metric.parse("survival_time:max"))


def found(folder, metrics):
    with Store.read(folder) as store:
        return rescored(StudyRun(open_study(folder), store), metrics)


def scores(result):
    return [trial.prpv for trial in result.trials]


def test_by_its_own_metrics_a_study_comes_to_its_own_result(finished):
    with Store.read(finished) as store:
        own = result_of(StudyRun(open_study(finished), store))
    again = found(finished, OWN)
    assert again.trials == own.trials
    assert again.best.trial == own.best.trial
    assert again.stopped == own.stopped


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
def test_a_metric_may_be_taken_out_or_turned_round(finished):
    assert scores(found(finished, OWN[:1])) != scores(found(finished, OWN))
    turned = (Metric.parse("distance:min"), Metric.parse("survival_time:min"))
    assert scores(found(finished, turned)) == scores(found(finished, OWN)), "both domains turn round alike"


def test_why_a_study_has_stopped_is_not_judged_by_the_other_metrics(finished):
    study = open_study(finished)
    study = replace(study, settings=replace(study.settings, budget=9, stop=StopRules(no_improvement=1e9)))
    with Store.read(finished) as store:
        assert rescored(StudyRun(study, store), COARSE).stopped == result_of(StudyRun(study, store)).stopped != ""


REFUSED = {
    "unknown": (("distanse:max",), "--metric distanse: no such metric; did you mean 'distance'?"),
    "twice": (("distance:max", "distance:max:5%"), "--metric distance: is given twice; give each metric once"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_metric_that_cannot_be_used_is_refused(finished, case):
    texts, line = REFUSED[case]
    with pytest.raises(InputError) as told:
        with_metrics(open_study(finished), [Metric.parse(text) for text in texts])
    assert str(told.value) == line


def test_a_metric_that_the_target_was_not_measured_in_is_refused_by_file(finished):
    rows = [line.rsplit(",", 1)[0] for line in (finished / "target.csv").read_text().splitlines()]
    (finished / "other.csv").write_text("\n".join(rows) + "\n")
    study = open_study(finished)
    study = replace(study, settings=replace(study.settings, target=finished / "other.csv"))
    with pytest.raises(InputError, match=r"other\.csv.*survival_time"):
        with_metrics(study, OWN)


def test_a_trial_that_lacks_episodes_is_told(finished):
    with Store.open(finished) as store:
        store.save_trial(
            open_study(finished).identity, TrialRecord(7, {"trim": 0.0, "delay": 0.1}, "finished", 3.0, {"prpv": 3.0})
        )
    with pytest.raises(RunError, match=r"study\.db: lacks episodes of trial 7"):
        found(finished, COARSE)
