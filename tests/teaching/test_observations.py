"""The paper's observations are said to hold only where intervals show it."""

from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from proxytune.learning.curves import Curve
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import mean_score, sample_needs, teaching
from proxytune.report.teaching.observations import observation_lines
from proxytune.teaching.experiment import Experiment, TeacherResult
from proxytune.teaching.observations import observe

GRID = (0, 100, 200, 400, 800)
MEANS = {
    "none": (np.nan, 5.0, 10.0, 30.0, 50.0),
    "slow starter": (0.0, 48.0, 50.0, 50.0, 50.0),
    "early bird": (30.0, 30.0, 35.0, 48.0, 50.0),
    "twin": (50.0, 50.0, 50.0, 50.0, 50.0),
}


def curve(means):
    return Curve(GRID, np.array(means) + 0.5 * np.random.default_rng(1).normal(size=(5, len(GRID))))


def experiment(settled=True, names=()):
    needs = sample_needs(
        {name: curve(means) for name, means in MEANS.items()}, none="none", best_score=60.0, tolerance=5.0
    )
    needs = replace(needs, gain=0.0 if settled else 5.1)
    teachers = [
        TeacherResult(
            name,
            Distribution(MappingProxyType({})),
            needs.curves[name],
            mean_score(needs, name, 0),
            teaching(needs, none="none", proxy=name),
            None,
        )
        for name in names or list(MEANS)[1:]
    ]
    return Experiment(SimpleNamespace(), 60.0, needs, tuple(teachers))


def predicting(values, poor=()):
    """PRPV of each proxy, a little uncertain; by chance for those named."""
    noise = np.random.default_rng(2).normal(size=(3, 2000))
    return {
        name: SimpleNamespace(prpv=value, resampled=value + row, chance=SimpleNamespace(explains=name in poor))
        for (name, value), row in zip(values.items(), noise, strict=True)
    }


GOOD = {"slow starter": 60.0, "early bird": 30.0, "twin": 5.0}


def test_a_proxy_that_starts_lower_and_saves_more_shows_that_a_zero_shot_score_does_not_measure_plv():
    found = observe(experiment(), predicting(GOOD, poor=("slow starter",)))
    assert found.zero_shot.reversed == (("slow starter", "early bird"),)
    first, _ = observation_lines(found, experiment())
    assert "shown here, since slow starter saves more than early bird though it starts lower (0.2 for 30.0)" in first


def test_a_proxy_that_saves_though_chance_predicts_as_well_shows_that_a_bad_predictor_can_teach():
    found = observe(experiment(), predicting(GOOD, poor=("slow starter",)))
    assert found.poor_predictors == ("slow starter",)
    assert found.prpv.tau == pytest.approx(1.0 / 3.0)
    _, second = observation_lines(found, experiment())
    assert "slow starter saves samples though a random ranking would predict as well" in second
    assert "Kendall's τ between PRPV and PLV is 0.33" in second


def test_where_no_proxy_shows_it_that_is_said():
    found = observe(experiment(), predicting(GOOD))
    assert "none of these proxies shows it" in observation_lines(found, experiment())[1]


def test_a_single_proxy_is_not_ranked_but_may_teach_though_it_predicts_badly():
    alone = experiment(names=["slow starter"])
    found = observe(alone, predicting(GOOD, poor=("slow starter",)))
    assert (found.zero_shot, found.prpv, found.poor_predictors) == (None, None, ("slow starter",))
    (only,) = observation_lines(found, alone)
    assert only.startswith("A proxy that predicts badly can still teach")
    assert "shown here, since slow starter saves samples" in only


def test_where_plv_is_unknown_nothing_is_observed():
    assert observe(experiment(settled=False), predicting(GOOD)) is None
    assert observation_lines(None, experiment()) == ()
