"""The trials of a search, read back by Optuna and scikit-optimize themselves."""

import sys

import numpy as np
import pytest
import skopt
from matplotlib.figure import Figure
from one_line import complaint_of

from proxytune.search import History, PastTrial, optimize_result, write_optuna, write_skopt
from proxytune.space import Interval, Space

SPACE = Space((Interval("delay", 0.0, 0.3), Interval("trim", -0.3, 0.3)))


def history(maximise=False):
    trials = (
        PastTrial({"delay": 0.1, "trim": 0.0}, "finished", 4.0, {"trial": 1, "prpv": 4.0, "ppv": 0.5}),
        PastTrial({"delay": 0.2, "trim": 0.1}, "cut", None, {"trial": 2, "at_least": 9.0, "expected": 12.0}),
        PastTrial({"delay": 0.0, "trim": -0.3}, "failed", None, {"trial": 3, "failure": "agent 'a' failed"}),
        PastTrial({"delay": 0.3, "trim": 0.2}, "finished", 6.0, {"trial": 4, "prpv": 6.0}),
    )
    return History("mine", SPACE, trials, maximise, answer=3)


@pytest.mark.slow
@pytest.mark.parametrize("maximise", [False, True])
def test_an_optuna_storage_has_every_trial_with_its_state_value_and_what_else_is_known(tmp_path, maximise):
    optuna = pytest.importorskip("optuna")
    path = tmp_path / "100% mine?.sqlite3"
    write_optuna(history(maximise), path)
    (tmp_path / "plain.sqlite3").write_bytes(path.read_bytes())
    study = optuna.load_study(study_name="mine", storage=f"sqlite:///{tmp_path}/plain.sqlite3")
    assert study.direction.name == ("MAXIMIZE" if maximise else "MINIMIZE")
    assert [trial.state.name for trial in study.trials] == ["COMPLETE", "PRUNED", "FAIL", "COMPLETE"]
    assert [trial.value for trial in study.trials] == [4.0, None, None, 6.0]
    assert [trial.params for trial in study.trials] == [dict(trial.theta) for trial in history().trials]
    assert [trial.user_attrs for trial in study.trials] == [dict(trial.facts) for trial in history().trials]
    assert study.trials[0].distributions["delay"] == optuna.distributions.FloatDistribution(0.0, 0.3)
    assert study.user_attrs == {"best_trial": 3}
    assert study.best_trial.number == (3 if maximise else 0)


def test_without_optuna_there_is_one_line_on_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    assert 'pip install ".[tpe]" in the checkout' in complaint_of(write_optuna, history(), tmp_path / "a.sqlite3")


def test_an_optimize_result_has_the_measured_trials_the_searchs_answer_and_signs_of_what_is_to_be_small():
    found = optimize_result(history())
    assert found.x == [0.3, 0.2]
    assert found.fun == 6.0
    assert found.x_iters == [[0.1, 0.0], [0.3, 0.2]]
    np.testing.assert_array_equal(found.func_vals, [4.0, 6.0])
    assert [(one.name, one.low, one.high) for one in found.space] == [("delay", 0.0, 0.3), ("trim", -0.3, 0.3)]
    found = optimize_result(history(maximise=True))
    np.testing.assert_array_equal(found.func_vals, [-4.0, -6.0])
    assert found.fun == -6.0


def test_scikit_optimize_draws_it_after_it_was_written_and_read(tmp_path):
    from skopt.plots import plot_convergence, plot_evaluations

    path = tmp_path / "mine.pkl"
    write_skopt(history(), path)
    found = skopt.load(path)
    np.testing.assert_array_equal(plot_convergence(found, ax=Figure().subplots()).lines[0].get_ydata(), [4.0, 4.0])
    assert {"delay", "trim"} <= {one.get_xlabel() for one in plot_evaluations(found).figure.axes}
