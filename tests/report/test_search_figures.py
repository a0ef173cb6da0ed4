from dataclasses import replace

import numpy as np
import pytest

from proxytune.report.search_figures import evaluations_figure, profiles_figure
from proxytune.report.study_document import study_document
from proxytune.report.study_table import best_theta, identity_lines
from proxytune.study.result import result_of
from proxytune.study.store import Store, TrialRecord
from proxytune.study.study import open_study


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return result_of(open_study(finished), store)


def flat(profile):
    level = np.full_like(profile.lowest, profile.incumbent)
    return replace(profile, lowest=level, low=level)


def steep(profile):
    far = np.abs(profile.values - profile.best) > 0.05
    lowest = profile.incumbent + 1000.0 * far
    return replace(profile, lowest=lowest, deviation=np.ones_like(lowest), low=lowest - 2.0)


def test_every_parameter_has_its_profile_and_partial_dependence_with_units(result):
    figure = profiles_figure(result)
    assert [axes.get_xlabel() for axes in figure.axes] == ["delay [s]", "trim"]
    for axes, profile in zip(figure.axes, result.profiles, strict=True):
        drawn = {line.get_label(): line for line in axes.get_lines()}
        assert np.array_equal(drawn["others at their best"].get_ydata(), profile.lowest)
        assert np.array_equal(drawn["others averaged"].get_ydata(), profile.average)
        assert list(drawn["best θ"].get_xdata()) == [profile.best]


def test_the_best_of_the_profiles_is_the_best_of_the_study(result):
    for profile in result.profiles:
        assert profile.best == pytest.approx(result.best.trial.theta[profile.name])
        assert profile.incumbent == pytest.approx(result.best.posterior_mean)


def test_a_flat_profile_is_called_unidentified_everywhere(result):
    delay, trim = result.profiles
    told = replace(result, profiles=(flat(delay), steep(trim)))
    assert [axes.get_title() for axes in profiles_figure(told).axes] == ["unidentified", ""]
    document = study_document(told)["best"]
    assert document["unidentified"] == ["delay"]
    assert document["theta_interval"]["delay"] == pytest.approx([0.0, 0.3])
    low, high = document["theta_interval"]["trim"]
    assert low <= document["theta"]["trim"] <= high
    assert high - low <= 0.1
    assert [row[2] for row in best_theta(told)] == ["unidentified", f"{low:.3g} to {high:.3g}"]
    assert identity_lines(told)[0].startswith("unidentified: delay; ")


def test_where_every_parameter_is_seen_none_is_called_unidentified(result):
    told = replace(result, profiles=tuple(steep(profile) for profile in result.profiles))
    assert study_document(told)["best"]["unidentified"] == []
    assert identity_lines(told) == ["stopped: the budget of 7 trials is spent"]


def test_how_a_study_came_to_its_end_is_said_and_a_study_under_way_says_nothing(result):
    assert study_document(result)["stopped"] == "the budget of 7 trials is spent"
    under_way = replace(result, stopped="")
    assert study_document(under_way)["stopped"] is None
    assert not [line for line in identity_lines(under_way) if line.startswith("stopped")]


def test_the_matrix_has_every_trial_the_best_and_the_failed_ones(result):
    failed = replace(result, trials=(*result.trials, TrialRecord(8, {"trim": 0.3, "delay": 0.3}, "failed")))
    figure = evaluations_figure(failed)
    pair = figure.axes[2]
    assert (pair.get_xlabel(), pair.get_ylabel()) == ("delay [s]", "trim")
    scored, crosses = pair.collections
    expected = [(trial.theta["delay"], trial.theta["trim"]) for trial in result.trials]
    assert np.allclose(scored.get_offsets(), expected)
    assert np.allclose(scored.get_array(), [trial.prpv for trial in result.trials])
    assert np.allclose(crosses.get_offsets(), [(0.3, 0.3)])
    (ring,) = pair.get_lines()
    theta = result.best.trial.theta
    assert (list(ring.get_xdata()), list(ring.get_ydata())) == ([theta["delay"]], [theta["trim"]])
    assert sum(bar.get_height() for bar in figure.axes[0].patches) == 8


def test_one_parameter_alone_can_be_drawn(result):
    settings = result.study.settings
    space = replace(settings.space, intervals=settings.space.intervals[:1])
    study = replace(result.study, settings=replace(settings, space=space))
    alone = replace(result, study=study, profiles=result.profiles[:1])
    assert len(profiles_figure(alone).axes) == 1
    assert len(evaluations_figure(alone).axes) == 2
