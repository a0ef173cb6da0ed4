from dataclasses import replace

import numpy as np
import pytest
from confirmations import confirmed

from proxytune.report.study.convergence import convergence
from proxytune.storage import Store, TrialRecord
from proxytune.study import StudyRun, open_study, result_of


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return result_of(StudyRun(open_study(finished), store))


def lines(figure):
    return {line.get_label(): line for line in figure.axes[0].get_lines()}


def test_it_shows_every_trial_the_floor_by_its_kind_and_chance(result):
    drawn = lines(convergence(result))
    scores = [trial.prpv for trial in result.trials]
    assert list(drawn["design"].get_ydata()) == scores[:5]
    assert list(drawn["proposed"].get_ydata()) == scores[5:]
    floor, chance = result.floor, result.judged.chance
    assert drawn[f"target's halves {floor.value:.1f}"].get_ydata()[0] == floor.value
    assert drawn[f"chance {chance.mean:.1f}"].get_ydata()[0] == chance.mean


def test_a_floor_of_the_same_starts_is_called_so_and_is_that_of_the_fresh_episodes(result):
    figure = convergence(confirmed(result, kind="same starts", value=5.0, low=1.0, high=9.0))
    assert lines(figure)["noise floor 5.0"].get_ydata()[0] == 5.0
    (band,) = [patch for patch in figure.axes[0].patches if patch.get_height() == 8.0]
    assert band.get_y() == 1.0


def test_the_line_is_the_answer_so_far_and_not_the_luckiest_trial(result):
    first, second, third, *rest = result.trials
    answers = (None, second, second, third, third, third, second)
    told = replace(result, answers=answers, best=replace(result.best, trial=third))
    line = lines(convergence(told))["answer so far"]
    assert list(line.get_xdata()) == [2, 3, 4, 5, 6, 7, 8]
    assert list(line.get_ydata()) == [answer.prpv for answer in (*answers[1:], third)]
    assert {first.prpv, *(one.prpv for one in rest)} != set(line.get_ydata())


def test_the_answer_s_fresh_score_stands_after_the_last_trial_with_its_interval(result):
    assert not convergence(result).axes[0].containers
    (bar,) = convergence(confirmed(result)).axes[0].containers
    marker, _, (reach,) = bar.lines
    assert marker.get_xydata().tolist() == [[8.0, 12.0]]
    assert np.allclose(reach.get_segments(), [[[8.0, 8.0], [8.0, 20.0]]])
    assert bar.get_label() == "answer, fresh episodes"


def test_lines_are_named_at_their_ends_and_not_in_the_legend(result):
    figure = convergence(confirmed(result, kind="same starts", value=5.0, low=1.0, high=9.0))
    (axes,) = figure.axes
    chance = f"chance\n{result.judged.chance.mean:.1f}"
    assert [text.get_text() for text in axes.texts] == ["answer\nso far", chance, "noise floor\n5.0"]
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert told == ["design", "proposed", "answer, fresh episodes"]


def test_axes_are_named_with_units(result):
    (axes,) = convergence(result).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("trial", "PRPV [ordered pairs]")


def test_failed_trials_are_crosses(result):
    failed = replace(
        result,
        trials=(*result.trials, TrialRecord(8, result.trials[0].theta, "failed")),
        answers=(*result.answers, result.answers[-1]),
    )
    assert list(lines(convergence(failed))["failed"].get_xdata()) == [8]
    assert "failed" not in lines(convergence(result))


def test_trials_that_were_cut_off_are_shown_at_what_they_cannot_be_below(result):
    cut = TrialRecord(8, result.trials[0].theta, "cut", decided=("agent0", "agent1"), bound=14.0, score=20.0)
    told = replace(result, trials=(*result.trials, cut), answers=(*result.answers, result.answers[-1]))
    drawn = lines(convergence(told))
    assert drawn["stopped early, at least"].get_xydata().tolist() == [[8.0, 14.0]]
    assert "failed" not in drawn
    assert "stopped early, at least" not in lines(convergence(result))


def test_without_a_noise_floor_none_is_drawn(result):
    assessment = result.best.assessment
    silent = replace(assessment, noise_floor=replace(assessment.noise_floor, value=None, low=None, high=None))
    drawn = lines(convergence(replace(result, best=replace(result.best, assessment=silent))))
    assert not [label for label in drawn if label.startswith(("noise floor", "target's halves"))]


def test_it_can_be_read_in_one_column_of_a_paper(result):
    figure = convergence(confirmed(result))
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    (axes,) = figure.axes
    texts = [axes.xaxis.label, axes.yaxis.label, *axes.get_xticklabels(), *figure.legends[0].get_texts()]
    assert min(text.get_fontsize() for text in texts) >= 7.0
