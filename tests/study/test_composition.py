import numpy as np
import pytest

from proxytune.search.engines import make_proposer
from proxytune.study.composition import compose_of, trial_of
from proxytune.study.evaluate import simulate
from proxytune.study.progress import Silent
from proxytune.study.run import run_study
from proxytune.study.store import Store, TrialRecord
from proxytune.study.study import open_study


def test_a_trial_s_outcome_composes_to_its_prpv(finished):
    study = open_study(finished)
    with Store.read(finished) as store:
        done = store.trials()
        told = [trial_of(study, store, trial) for trial in done]
    assert [trial.score for trial in told] == [trial.prpv for trial in done]
    assert [trial.values for trial in told] == [study.settings.space.values(trial.theta) for trial in done]
    composed = compose_of(study)(np.array([trial.outcome for trial in told]))
    assert np.array_equal(composed, [trial.prpv for trial in done])
    assert len(set(composed)) > 1


@pytest.mark.parametrize("metrics", ['["survival_time:max"]', '["survival_time:max", "distance:min"]'])
def test_an_outcome_has_the_study_s_metrics_in_their_order_and_the_target_s_agents(make_study, metrics):
    agents = '["agent5", "agent0", "agent3", "agent1", "agent2", "agent4"]'
    folder = make_study(agents=agents, metrics=metrics, budget="6")
    study = open_study(folder)
    with Store.open(folder) as store:
        run_study(study, store, make_proposer("sobol", 5), Silent())
        told = [trial_of(study, store, trial) for trial in store.trials()]
    composed = compose_of(study)(np.array([trial.outcome for trial in told]))
    assert np.array_equal(composed, [trial.score for trial in told])


def test_a_trial_whose_agent_has_no_episode_has_no_outcome(make_study):
    folder = make_study(domain={"faults": '["agent3:*:raises"]'}, budget="6")
    study = open_study(folder)
    with Store.open(folder) as store:
        theta = {"delay": 0.1, "trim": 0.1}
        simulate(study, store, theta, Silent(), "")
        told = trial_of(study, store, TrialRecord(1, theta, "failed"))
    assert (told.score, told.outcome) == (None, None)
