"""Curves over signals: the signal that something depends on leads, and nothing leads where nothing is missing."""

from dataclasses import replace

import hidden_cases as hidden
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from planted import ROBOT, TRUTH, drives_of, fitted, planted_drives

from proxytune.diagnosis import RULES
from proxytune.diagnosis.motion.drives import gather
from proxytune.diagnosis.motion.signals import fit_curves, hats, signal_groups
from proxytune.effects import Cue

SHORT = {"episodes": 3, "seconds": 30.0}


@settings(max_examples=50)
@given(
    signal=arrays(float, st.tuples(st.integers(1, 3), st.integers(2, 30)), elements=st.floats(-1e3, 1e3)),
    knots=st.integers(2, 9),
)
def test_hats_sum_to_one_and_are_never_negative(signal, knots):
    columns = hats(signal, knots)
    np.testing.assert_allclose(columns.sum(axis=-1), 1.0, atol=1e-9)
    assert columns.min() >= 0.0
    assert columns.shape[:-1] == signal.shape
    assert columns.shape[-1] <= knots


def test_hats_reach_from_least_to_greatest_and_are_one_where_a_signal_stands_still():
    np.testing.assert_allclose(hats(np.linspace(-2.0, 3.0, 101), 6)[[0, 20, 100]], np.eye(6)[[0, 1, 5]], atol=1e-9)
    np.testing.assert_array_equal(hats(np.full((2, 5), 3.0)), np.ones((2, 5, 1)))


@pytest.fixture(scope="module")
def clean():
    return fitted(planted_drives(TRUTH, **SHORT))


def test_every_signal_of_two_wheels_has_motion_and_no_curve_gains_much_where_nothing_is_missing(clean):
    groups = [group for group, _ in signal_groups(clean)]
    assert {group.name for group in groups} == set(Cue) - {Cue.STEERING}
    for group in groups:
        assert group.twists.shape[:3] == (*clean.drives.duties.shape[:2], 3)
        assert np.isfinite(group.twists).all()
        assert group.signal.shape == clean.drives.duties.shape[:2]
    assert fit_curves(clean)[0].gain < RULES.least_gain_nats
    gains = [curve.gain for curve in fit_curves(clean)]
    assert gains == sorted(gains, reverse=True)


SLOW = {"marks": pytest.mark.slow}


@pytest.mark.parametrize(
    ("effect", "figures", "signals"),
    [
        ("carpet", {"factor": 0.8, "beyond": 0.0}, {"position"}),
        pytest.param("eccentric_wheel", {"ripple": 0.25}, {"left wheel angle"}, **SLOW),
        pytest.param("weak_reverse", {"factor": 0.8}, {"direction of travel", "wheel command"}, **SLOW),
        pytest.param("slipping_hub", {"factor": 0.85, "after": 15.0}, {"time in the episode", "cumulated use"}, **SLOW),
    ],
)
def test_the_signal_that_the_motion_depends_on_leads(effect, figures, signals):
    case = hidden.Case(effect, ((effect, figures),), "normal", 8, 0.02, 0.12)
    found = fit_curves(fitted(drives_of(hidden.make_log(case, **SHORT))))
    assert found[0].group.name in signals
    assert found[0].gain > RULES.least_gain_nats
    assert found[0].weights.shape == (found[0].group.twists.shape[-1],)


def test_a_wheel_has_turned_as_far_as_it_rolled():
    log = hidden.make_log(hidden.Case("plain", (), "normal", 5, 0.0, 0.0), episodes=2, seconds=10.0, noiseless=True)
    angles = gather(log, ROBOT, log.episodes).angles
    way = np.stack([np.hypot(*np.diff(e.poses[:, :2], axis=0).T).sum() for e in log.episodes])
    rolled = np.abs(np.diff(angles, axis=1)).sum(axis=1).mean(axis=-1) * 0.0318
    assert (rolled > 0.9 * way).all()
    np.testing.assert_array_equal(angles[0, 0], 0.0)
    spun = tuple(replace(e, wheels=np.full_like(e.poses[:, :2], 3.0)) for e in log.episodes)
    seconds = np.arange(angles.shape[1]) / gather(log, ROBOT, spun).tick_hz
    np.testing.assert_allclose(gather(log, ROBOT, spun).angles[0, :, 0], 3.0 * seconds)
