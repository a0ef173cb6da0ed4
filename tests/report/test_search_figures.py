from dataclasses import replace

import numpy as np
import pytest
from confirmations import planted

from proxytune.report.study.profiles_figure import profiles_figure
from proxytune.report.study.search_figures import evaluations_figure
from proxytune.search import Trial, learn
from proxytune.storage import Store, TrialRecord
from proxytune.study import StudyRun, open_study, result_of


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return planted(result_of(StudyRun(open_study(finished), store)))


def shadow(result):
    """Whether the shadow of delay and trim holds points of the box."""
    pair = evaluations_figure(result).axes[0]
    (region,) = [one for one in pair.collections if one.get_zorder() == 0]
    return lambda *points: [any(path.contains_point(point) for path in region.get_paths()) for point in points]


def test_the_pair_has_every_trial_the_answer_the_failed_ones_and_the_truth(result):
    failed = replace(result, trials=(*result.trials, TrialRecord(8, {"trim": 0.3, "delay": 0.3}, "failed")))
    pair = evaluations_figure(replace(failed, truth={"trim": 0.1, "delay": 0.12})).axes[0]
    assert (pair.get_xlabel(), pair.get_ylabel()) == ("delay [s]", "trim")
    scored = next(one for one in pair.collections if one.get_array() is not None and one.get_zorder() == 2)
    expected = [(trial.theta["delay"], trial.theta["trim"]) for trial in result.trials]
    assert np.allclose(scored.get_offsets(), expected)
    assert np.allclose(scored.get_array(), [trial.prpv for trial in result.trials])
    (crosses,) = [one for one in pair.collections if one.get_label() == "failed"]
    assert np.allclose(crosses.get_offsets(), [(0.3, 0.3)])
    marks = {line.get_label(): (line.get_xdata()[0], line.get_ydata()[0]) for line in pair.get_lines()}
    theta = result.best.trial.theta
    assert marks == {"answer": (theta["delay"], theta["trim"]), "truth": (0.12, 0.1)}
    assert "truth" not in [line.get_label() for line in evaluations_figure(result).axes[0].get_lines()]


def test_a_trial_that_was_cut_off_is_an_open_point(result):
    cut = TrialRecord(8, {"trim": 0.2, "delay": 0.25}, "cut", bound=14.0, score=20.0)
    pair = evaluations_figure(replace(result, trials=(*result.trials, cut))).axes[0]
    (holes,) = [one for one in pair.collections if one.get_zorder() == 3]
    assert np.allclose(holes.get_offsets(), [(0.25, 0.2)])
    assert [one.get_label() for one in pair.collections].count("stopped early") == 1
    whole = evaluations_figure(result).axes[0]
    assert "stopped early" not in [one.get_label() for one in whole.collections]


def test_the_shadow_is_the_region_and_no_more(result):
    holds = shadow(result)
    # Two deviations of 0.05 and 0.02 of the box are inside, four are not.
    assert holds((0.12, 0.1), (0.146, 0.1), (0.12, 0.12)) == [True, True, True]
    assert holds((0.18, 0.1), (0.12, 0.15), (0.03, -0.2)) == [False, False, False]


def test_a_pair_that_trades_casts_a_slanting_shadow(result):
    holds = shadow(planted(result, centre=(0.5, 0.5), deviation=(0.15, 0.15), correlation=-0.95))
    assert holds((0.09, 0.12), (0.21, -0.12)) == [True, True]
    assert holds((0.09, -0.12), (0.21, 0.12)) == [False, False]


def test_one_parameter_alone_can_be_drawn(result):
    settings = result.study.settings
    space = replace(settings.space, intervals=settings.space.intervals[:1])
    study = replace(result.study, settings=replace(settings, space=space))
    trials = [Trial((one.theta["delay"],), one.prpv, (one.theta["delay"], 1.0)) for one in result.trials]
    goal = replace(result.knowledge.goal, outputs=(("a", "b"), ("c", "d")), values=np.ones(2), noise=np.ones(2))
    alone = replace(result, study=study, knowledge=learn(space, trials, goal))
    assert len(profiles_figure(alone).axes) == 1
    axes = evaluations_figure(alone).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("delay [s]", "PRPV [ordered pairs]")


def test_it_can_be_read_in_one_column_of_a_paper(result):
    figure = evaluations_figure(result)
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    pair, key = figure.axes[:2]
    texts = [pair.xaxis.label, pair.yaxis.label, *pair.get_xticklabels(), *key.get_legend().get_texts()]
    assert min(text.get_fontsize() for text in texts) >= 7.0
    assert [text.get_text() for text in key.get_legend().get_texts()] == ["95 % region", "answer"]
