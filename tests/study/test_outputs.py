import numpy as np
import pytest

from proxytune.search.engines.registry import make_proposer
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.knowledge import goal_of
from proxytune.study.run import run_study
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun


def test_a_trial_s_outcome_composes_to_its_prpv(finished):
    study = open_study(finished)
    with Store.read(finished) as store:
        done = store.trials()
        told = [StudyRun(study, store).search_trial(trial) for trial in done]
        composed = goal_of(StudyRun(study, store)).compose(np.array([trial.outcome for trial in told]))
    assert [trial.score for trial in told] == [trial.prpv for trial in done]
    assert [trial.values for trial in told] == [study.settings.space.values(trial.theta) for trial in done]
    assert np.array_equal(composed, [trial.prpv for trial in done])
    assert len(set(composed)) > 1


@pytest.mark.parametrize("metrics", ['["survival_time:max"]', '["survival_time:max", "distance:min"]'])
def test_an_outcome_has_the_study_s_metrics_in_their_order_and_the_target_s_agents(make_study, metrics):
    agents = '["agent5", "agent0", "agent3", "agent1", "agent2", "agent4"]'
    folder = make_study(agents=agents, metrics=metrics, budget="6")
    study = open_study(folder)
    with Store.open(folder) as store:
        study_run = StudyRun(study, store)
        run_study(study_run, make_proposer("sobol", 5))
        told = [StudyRun(study, store).search_trial(trial) for trial in store.trials()]
        composed = goal_of(StudyRun(study, store)).compose(np.array([trial.outcome for trial in told]))
    assert np.array_equal(composed, [trial.score for trial in told])


def test_a_trial_whose_agent_has_no_episode_lacks_that_agent_s_outputs_alone(make_study):
    folder = make_study(domain={"faults": '["agent3:*:raises"]'}, budget="6")
    study = open_study(folder)
    with Store.open(folder) as store:
        theta = {"delay": 0.1, "trim": 0.1}
        StudyRun(study, store).evaluate(theta, "")
        told = StudyRun(study, store).search_trial(TrialRecord(1, theta, "failed"))
    known = ~np.isnan(told.outcome).reshape(6, 2)
    assert told.score is None
    assert known.all(axis=1).tolist() == [True, True, True, False, True, True]


def test_a_trial_without_any_episode_that_worked_has_no_outcome(make_study):
    folder = make_study(domain={"faults": str([f"agent{n}:*:raises" for n in range(6)])})
    study = open_study(folder)
    with Store.open(folder) as store:
        StudyRun(study, store).evaluate({"delay": 0.1, "trim": 0.1}, "")
        assert (
            StudyRun(study, store).search_trial(TrialRecord(1, {"delay": 0.1, "trim": 0.1}, "failed")).outcome is None
        )


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
