"""A study from Python runs, resumes, and is looked at without simulating."""

import json
import re
import warnings
from contextlib import nullcontext
from unittest.mock import Mock

import numpy as np
import pytest
from matplotlib.figure import Figure
from one_line import complaint_of

from proxytune.api import read_study
from proxytune.api.study import run_study
from proxytune.running import Silent


@pytest.fixture(scope="module")
def folder(make_studies):
    return make_studies("ran", budget="6", preflight="true", confirm="1")


@pytest.fixture(scope="module")
def report(folder):
    return run_study(folder)


def test_the_trials_are_a_table_and_an_optimize_result_and_theta_is_drawn_from_the_posterior(report):
    trials = report.trials()
    assert list(trials.index) == [1, 2, 3, 4, 5, 6]
    assert trials.index.name == "trial"
    assert list(trials.columns) == ["delay", "trim", "state", "score", "prpv", "ppv"]
    assert set(trials.state) == {"finished"}
    assert (trials.score == trials.prpv).all()
    assert trials.delay.between(0.0, 0.3).all()
    visited = report.trials()[["delay", "trim"]].to_dict("index")
    number = report.document()["best"]["index"]
    assert [trial for trial, theta in visited.items() if theta == report.theta] == ([number] if number else [])
    found, trials = report.optimize_result(), report.trials()
    assert [one.name for one in found.space] == ["delay", "trim"]
    assert found.func_vals.tolist() == trials.score.tolist()
    assert found.x_iters == trials[["delay", "trim"]].to_numpy().tolist()
    assert found.fun == trials.score[trials[["delay", "trim"]].to_numpy().tolist().index(list(found.x)) + 1]
    # Rows are whole θ: their margins are the answer's intervals, and their correlation is the posterior's own.
    drawn, learnt = report.posterior(draws=20_000, seed=3), report.result.knowledge
    assert list(drawn.columns) == list(learnt.space.names)
    assert drawn.equals(report.posterior(draws=20_000, seed=3))
    assert not drawn.equals(report.posterior(draws=20_000, seed=4))
    assert complaint_of(lambda: report.posterior(seed="a")) == "seed must be a whole number, got 'a'"
    for box in learnt.space.intervals:
        ends = drawn[box.name].quantile([0.025, 0.975])
        np.testing.assert_allclose(ends, learnt.intervals[box.name], atol=0.02 * (box.high - box.low))
        assert drawn[box.name].between(box.low, box.high).all()
    exact = np.cov(learnt.values.T, aweights=learnt.posterior.weights, ddof=0)
    np.testing.assert_allclose(np.cov(drawn.to_numpy().T), exact, atol=0.05 * np.abs(exact).max())
    assert "draws must be at least 1, got 0" in complaint_of(report.posterior, draws=0)


def test_a_report_has_the_document_and_words_of_the_command_and_reading_simulates_nothing(report, folder, answered):
    assert repr(report) == f"StudyReport of 'wobbly': {report.document()['sentence']}"
    printed = answered("study", folder)
    document = json.loads(json.dumps(report.document()))
    assert {key: printed[key] for key in document} == document
    seen = read_study(folder)
    assert seen.spent.episodes == 0
    assert seen.document() == report.document()


@pytest.mark.slow
def test_every_figure_is_drawn_and_written_where_asked(report, folder, tmp_path):
    assert set(report.figures()) == {"convergence", "profiles", "evaluations", "importance"}
    assert all(isinstance(figure, Figure) for figure in report.figures().values())
    files = report.write(tmp_path / "elsewhere")
    assert {path.name for path in files.figures} == {f"{name}.png" for name in report.figures()}
    assert all(path.stat().st_size for path in (*files.figures, files.page))
    assert files.page.parent == tmp_path / "elsewhere"
    assert report.write().page.parent == folder


@pytest.mark.slow
def test_a_parameter_without_effect_is_a_warning_at_the_line_that_runs_the_study(make_study):
    family, box = '"partly_dead:partly_dead"', {"matters": "[-1, 1]", "dead": "[0, 1]"}
    folder = make_study("dead", parameters=box, family=family, budget="5", preflight="true")
    with pytest.warns(UserWarning, match="'dead' changes nothing at all") as heard:
        run_study(folder)
    assert {one.filename for one in heard} == {__file__}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run_study(folder)


def test_of_a_study_of_plv_it_says_where_the_answer_is_also_where_prpv_narrowed_its_box(make_study):
    folder = make_study()
    run_study(folder, budget=5)
    make_study(objective='"plv"')
    problem = "is a study of 'plv', which tells its best teacher in report.html and no best θ; where a θ is needed"
    assert complaint_of(read_study, folder).startswith(f"{folder}: {problem}")


def test_progress_is_shown_only_when_asked_for(make_study, monkeypatch):
    bars = Mock(side_effect=lambda total, unit: nullcontext(Silent()))
    monkeypatch.setattr("proxytune.running.progress.Bars", bars)
    folder = make_study("shown", budget="2", initial="2")
    run_study(folder)
    bars.assert_not_called()
    run_study(folder, progress=True)
    assert [one.args[0] for one in bars.mock_calls] == [(2 + 1) * 6 * 3], "two trials and the nominal θ"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"engine": '"gpp"'}, "study.toml: engine: unknown engine 'gpp'.*did you mean 'gp'"),
        ({"metrics": '["distanc:max"]'}, "no column 'distanc'; did you mean 'distance'|unknown metric 'distanc'"),
        ({"objective": '"plv"'}, "objective: run_study has no search for 'plv'; run it with: python -m proxytune"),
    ],
)
def test_what_cannot_be_used_is_one_line_with_the_key_and_what_to_do(make_study, changes, words):
    assert re.search(words, complaint_of(run_study, make_study("wrong", **changes)))
