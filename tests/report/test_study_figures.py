"""Figures of a study."""

from dataclasses import replace

import numpy as np
import pytest
from confirmations import confirmed, planted
from readable import assert_readable

from proxytune.report.study.document import study_document
from proxytune.report.study.figures import (
    convergence_figure,
    density_of,
    evaluations_figure,
    importance_figure,
    profiles_figure,
)
from proxytune.report.study.page import search_table, study_view
from proxytune.report.wording import span
from proxytune.search import Importance, Trial, learn_theta
from proxytune.storage import TrialRecord
from proxytune.study import PRPV


def lines(figure):
    return {line.get_label(): line for line in figure.axes[0].get_lines()}


def test_it_shows_every_trial_the_floor_by_its_kind_chance_and_the_answer_s_fresh_score_after_the_last(result):
    drawn = lines(convergence_figure(result))
    scores = [trial.prpv for trial in result.trials]
    assert list(drawn["design"].get_ydata()) == scores[:5]
    assert list(drawn["proposed"].get_ydata()) == scores[5:]
    floor, chance = result.floor, result.judged.chance
    assert drawn[f"target's halves {floor.value:.1f}"].get_ydata()[0] == floor.value
    assert drawn[f"chance {chance.mean:.1f}"].get_ydata()[0] == chance.mean
    assert not convergence_figure(result).axes[0].containers
    (bar,) = convergence_figure(confirmed(result)).axes[0].containers
    marker, _, (reach,) = bar.lines
    assert marker.get_xydata().tolist() == [[8.0, 12.0]]
    assert np.allclose(reach.get_segments(), [[[8.0, 8.0], [8.0, 20.0]]])
    assert bar.get_label() == "answer, fresh episodes"


def test_the_convergence_names_its_axes_its_floor_by_its_kind_and_its_lines_at_their_ends(result):
    (axes,) = convergence_figure(result).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("trial", "PRPV [ordered pairs]")
    figure = convergence_figure(confirmed(result, kind="same starts", value=5.0, low=1.0, high=9.0))
    assert lines(figure)["noise floor 5.0"].get_ydata()[0] == 5.0
    (band,) = [patch for patch in figure.axes[0].patches if patch.get_height() == 8.0]
    assert band.get_y() == 1.0
    (axes,) = figure.axes
    chance = f"chance\n{result.judged.chance.mean:.1f}"
    assert [text.get_text() for text in axes.texts] == ["answer\nso far", chance, "noise floor\n5.0"]
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert told == ["design", "proposed", "answer, fresh episodes"]


def test_failed_trials_are_crosses_those_cut_off_at_their_bounds_and_the_line_is_the_answer_so_far(result):
    failed = replace(
        result,
        trials=(*result.trials, TrialRecord(8, result.trials[0].theta, "failed")),
        answers=(*result.answers, result.answers[-1]),
    )
    assert list(lines(convergence_figure(failed))["failed"].get_xdata()) == [8]
    assert "failed" not in lines(convergence_figure(result))

    cut = TrialRecord(8, result.trials[0].theta, "cut", decided=("agent0", "agent1"), bound=14.0, score=20.0)
    told = replace(result, trials=(*result.trials, cut), answers=(*result.answers, result.answers[-1]))
    drawn = lines(convergence_figure(told))
    assert drawn["stopped early, at least"].get_xydata().tolist() == [[8.0, 14.0]]
    assert "failed" not in drawn
    assert "stopped early, at least" not in lines(convergence_figure(result))
    assessment = result.best.assessment
    silent = replace(assessment, noise_floor=replace(assessment.noise_floor, value=None, low=None, high=None))
    drawn = lines(convergence_figure(replace(result, best=replace(result.best, assessment=silent))))
    assert not [label for label in drawn if label.startswith(("noise floor", "target's halves"))]
    first, second, third, *rest = result.trials
    answers = (None, second, second, third, third, third, second)
    told = replace(result, answers=answers, best=replace(result.best, trial=third))
    line = lines(convergence_figure(told))["answer so far"]
    assert list(line.get_xdata()) == [2, 3, 4, 5, 6, 7, 8]
    assert list(line.get_ydata()) == [answer.prpv for answer in (*answers[1:], third)]
    assert {first.prpv, *(one.prpv for one in rest)} != set(line.get_ydata())


@pytest.fixture(scope="module")
def learnt(result):
    """θ is known to be delay 0.12 and trim 0.1."""
    return planted(result)


def test_the_density_is_highest_where_theta_is_known_to_be_adds_up_to_one_and_stays_in_the_box(learnt):
    for place, centre in enumerate((0.12, 0.1)):
        values, density = density_of(learnt, place)
        assert values[np.argmax(density)] == pytest.approx(centre, abs=0.01)
        assert np.trapezoid(density, values) == pytest.approx(1.0, abs=0.02)
    values, density = density_of(planted(learnt, centre=(0.0, 0.5), deviation=(0.05, 0.05)), 0)
    assert values[0] == 0.0
    assert density[1] > 0.9 * density.max()
    assert np.trapezoid(density, values) == pytest.approx(1.0, abs=0.02)


def test_what_the_interval_leaves_out_is_grey_the_answer_a_line_and_the_truth_a_mark_where_it_is_known(learnt):
    figure = profiles_figure(learnt)
    assert [axes.get_xlabel() for axes in figure.axes] == ["delay [s]", "trim"]
    for axes, box in zip(figure.axes, learnt.study.settings.space.intervals, strict=True):
        low, high = learnt.knowledge.intervals[box.name]
        spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]
        assert np.allclose(spans, [(box.low, low), (high, box.high)])
        assert axes.get_xlim() == (box.low, box.high)
    vague = planted(learnt, deviation=(3.0, 0.02))
    ends = [span(vague.knowledge.intervals[name]) for name in ("delay", "trim")]
    titles = [axes.get_title() for axes in profiles_figure(vague).axes]
    assert titles == [f"unidentified: {ends[0]}", f"{ends[1]} remain"]
    known = profiles_figure(replace(learnt, truth={"trim": 0.11})).axes
    marks = [{line.get_label(): line.get_xdata()[0] for line in axes.get_lines()} for axes in known]
    theta = learnt.best.trial.theta
    assert [mark["answer"] for mark in marks] == [theta["delay"], theta["trim"]]
    assert ["truth" in mark for mark in marks] == [False, True]
    assert marks[1]["truth"] == 0.11


@pytest.mark.parametrize("draw", [convergence_figure, profiles_figure, evaluations_figure])
def test_a_figure_can_be_read_in_one_column_of_a_paper(learnt, draw):
    assert_readable(draw(confirmed(learnt)), points=7.0)


def shadow(learnt):
    """Whether the shadow of delay and trim holds points of the box."""
    (region,) = [one for one in evaluations_figure(learnt).axes[0].collections if one.get_zorder() == 0]
    return lambda *points: [any(path.contains_point(point) for path in region.get_paths()) for point in points]


def test_the_pair_has_a_point_for_every_trial_open_where_it_was_cut_off_and_its_key_the_region_and_the_answer(learnt):
    failed = replace(learnt, trials=(*learnt.trials, TrialRecord(8, {"trim": 0.3, "delay": 0.3}, "failed")))
    pair = evaluations_figure(replace(failed, truth={"trim": 0.1, "delay": 0.12})).axes[0]
    assert (pair.get_xlabel(), pair.get_ylabel()) == ("delay [s]", "trim")
    scored = next(one for one in pair.collections if one.get_array() is not None and one.get_zorder() == 2)
    expected = [(trial.theta["delay"], trial.theta["trim"]) for trial in learnt.trials]
    assert np.allclose(scored.get_offsets(), expected)
    assert np.allclose(scored.get_array(), [trial.prpv for trial in learnt.trials])
    (crosses,) = [one for one in pair.collections if one.get_label() == "failed"]
    assert np.allclose(crosses.get_offsets(), [(0.3, 0.3)])
    marks = {line.get_label(): (line.get_xdata()[0], line.get_ydata()[0]) for line in pair.get_lines()}
    theta = learnt.best.trial.theta
    assert marks == {"answer": (theta["delay"], theta["trim"]), "truth": (0.12, 0.1)}
    assert "truth" not in [line.get_label() for line in evaluations_figure(learnt).axes[0].get_lines()]

    key = evaluations_figure(learnt).axes[1]
    assert [text.get_text() for text in key.get_legend().get_texts()] == ["95 % region", "answer"]
    cut = TrialRecord(8, {"trim": 0.2, "delay": 0.25}, "cut", bound=14.0, score=20.0)
    pair = evaluations_figure(replace(learnt, trials=(*learnt.trials, cut))).axes[0]
    (holes,) = [one for one in pair.collections if one.get_zorder() == 3]
    assert np.allclose(holes.get_offsets(), [(0.25, 0.2)])
    assert [one.get_label() for one in pair.collections].count("stopped early") == 1
    assert "stopped early" not in [one.get_label() for one in evaluations_figure(learnt).axes[0].collections]


def test_the_shadow_is_the_region_that_slants_where_a_pair_trades_and_one_parameter_is_drawn_alone(learnt):
    holds = shadow(learnt)
    # Two deviations of 0.05 and 0.02 of the box are inside, four are not.
    assert holds((0.12, 0.1), (0.146, 0.1), (0.12, 0.12)) == [True, True, True]
    assert holds((0.18, 0.1), (0.12, 0.15), (0.03, -0.2)) == [False, False, False]
    holds = shadow(planted(learnt, centre=(0.5, 0.5), deviation=(0.15, 0.15), correlation=-0.95))
    assert holds((0.09, 0.12), (0.21, -0.12)) == [True, True]
    assert holds((0.09, -0.12), (0.21, 0.12)) == [False, False]
    settings = learnt.study.settings
    space = replace(settings.space, intervals=settings.space.intervals[:1])
    study = replace(learnt.study, settings=replace(settings, space=space))
    trials = [Trial((one.theta["delay"],), one.prpv, (one.theta["delay"], 1.0)) for one in learnt.trials]
    goal = replace(learnt.knowledge.goal, outputs=(("a", "b"), ("c", "d")), values=np.ones(2), noise=np.ones(2))
    alone = replace(learnt, study=study, knowledge=learn_theta(space, trials, goal))
    assert len(profiles_figure(alone).axes) == 1
    axes = evaluations_figure(alone).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("delay [s]", "PRPV [ordered pairs]")
    other = replace(PRPV, name="grasps", label="grasps won", maximise=True)
    drawn = evaluations_figure(replace(alone, study=replace(study, objective=other)))
    assert drawn.axes[0].get_ylabel() == "grasps won"
    assert [axes.get_title() for axes in drawn.axes[1:] if axes.get_title()] == []


@pytest.fixture(scope="module")
def weighed(result):
    planted = (Importance("delay", 0.25, (0.1, 0.4), 0.125), Importance("trim", 0.75, (0.5, 1.0), 0.5))
    return replace(result, importances=planted)


def test_each_parameter_has_a_dot_for_its_share_a_stroke_for_what_is_alone_and_a_line_for_the_interval(result, weighed):
    assert [importance.name for importance in result.importances] == ["delay", "trim"]
    (axes,) = importance_figure(weighed).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["delay", "trim"]
    drawn = {line.get_label(): line.get_xydata().tolist() for line in axes.get_lines()}
    assert drawn["alone or with others"] == [[0.25, 0.0], [0.75, 1.0]]
    assert drawn["alone"] == [[0.125, 0.0], [0.5, 1.0]]
    ends = [path.vertices[:, 0] for path in axes.collections[0].get_paths()]
    assert np.allclose(ends, [(0.1, 0.4), (0.5, 1.0)])


def test_the_document_the_table_and_the_page_say_the_same(weighed):
    assert study_document(weighed)["importance"] == {
        "delay": {"share": 0.25, "interval": [0.1, 0.4], "alone": 0.125},
        "trim": {"share": 0.75, "interval": [0.5, 1.0], "alone": 0.5},
    }
    table = search_table(weighed)
    label, shares = table.rows[1]
    assert shares.endswith(": trim 0.75 (0.50 to 1.00), delay 0.25 (0.10 to 0.40)")
    assert label == "Sobol index"
    assert table in study_view(weighed, {}).parts
