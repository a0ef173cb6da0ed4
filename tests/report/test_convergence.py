from dataclasses import replace

import pytest

from proxytune.report.convergence import convergence
from proxytune.study.result import result_of
from proxytune.study.store import Store, TrialRecord
from proxytune.study.study import open_study


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return result_of(open_study(finished), store)


def lines(figure):
    return {line.get_label(): line for line in figure.axes[0].get_lines()}


def test_it_shows_every_trial_the_lowest_so_far_the_noise_floor_and_chance(result):
    drawn = lines(convergence(result))
    scores = [trial.prpv for trial in result.trials]
    assert list(drawn["design"].get_ydata()) == scores[:5]
    assert list(drawn["proposed"].get_ydata()) == scores[5:]
    assert list(drawn["lowest so far"].get_ydata())[:7] == [min(scores[: n + 1]) for n in range(7)]
    floor, chance = result.best.assessment.noise_floor, result.best.assessment.chance
    assert drawn[f"noise floor {floor.value:.1f}"].get_ydata()[0] == floor.value
    assert drawn[f"chance {chance.mean:.1f}"].get_ydata()[0] == chance.mean
    assert list(drawn["best θ"].get_xdata()) == [result.best.trial.number]


def test_axes_are_named_with_units(result):
    (axes,) = convergence(result).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("trial", "PRPV [ordered pairs of agents]")


def test_failed_trials_are_crosses(result):
    failed = replace(result, trials=(*result.trials, TrialRecord(8, result.trials[0].theta, "failed")))
    assert list(lines(convergence(failed))["failed"].get_xdata()) == [8]
    assert "failed" not in lines(convergence(result))


def test_trials_that_were_cut_off_are_shown_at_what_they_cannot_be_below(result):
    cut = TrialRecord(8, result.trials[0].theta, "cut", decided=("agent0", "agent1"), bound=14.0, estimate=20.0)
    drawn = lines(convergence(replace(result, trials=(*result.trials, cut))))
    assert drawn["cut off, at least"].get_xydata().tolist() == [[8.0, 14.0]]
    assert "failed" not in drawn
    assert "cut off, at least" not in lines(convergence(result))


def test_without_a_noise_floor_none_is_drawn(result):
    assessment = result.best.assessment
    silent = replace(assessment, noise_floor=replace(assessment.noise_floor, value=None, low=None, high=None))
    drawn = lines(convergence(replace(result, best=replace(result.best, assessment=silent))))
    assert not [label for label in drawn if label.startswith("noise floor")]
