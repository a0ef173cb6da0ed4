"""Robots stepped as masses, torques and tyres: the plain one does what its model says, each other one does not.

The loop is compiled when it first runs, which takes some seconds.
"""

from dataclasses import replace

import numpy as np
import pytest
import third_hidden_cases as third
from second_hidden_cases import Course, plan

PLAIN = third.Case("plain", seed=5, delay=0.1)


def driven(case, duties, seconds=3.0):
    held = np.tile(np.asarray(duties, dtype=float), (1, round(seconds / third.ROW_S) + 1, 1))
    return third.driven(case, Course(held, np.zeros((1, 3))))[0]


def lagging_way(duty, seconds, delay=0.1):
    """The way of a robot with a lag of 0.2 s after a step of its duty."""
    since = np.maximum(np.arange(0.0, seconds + 1e-9, third.ROW_S) - delay, 0.0)
    return third.FULL_SPEED * duty * (since - third.LAG_S * (1.0 - np.exp(-since / third.LAG_S)))


@pytest.mark.slow
def test_the_plain_robot_lags_by_a_fifth_of_a_second_ahead_and_in_turns_alike():
    np.testing.assert_allclose(driven(PLAIN, (0.5, 0.5))[:, 0], lagging_way(0.5, 3.0), atol=2e-3)
    turned = driven(PLAIN, (-0.2, 0.2))[:, 2]
    np.testing.assert_allclose(turned, 2.0 / third.BASELINE * lagging_way(0.2, 3.0), atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("case", third.PHYSICS, ids=lambda case: case.name)
def test_every_other_robot_drives_or_is_seen_otherwise(case):
    course = plan(case.seed, 2, 300)
    one, other = (third.seen(own, third.driven(own, course), course) for own in (case, replace(case, changes={})))
    assert np.isfinite(one).all()
    assert np.hypot(*(one - other)[..., :2].reshape(-1, 2).T).max() > 2e-3


@pytest.mark.slow
def test_a_castor_slows_a_robot_that_turns_and_never_drives_it():
    free, stiff = (driven(replace(PLAIN, changes={"castor_friction": own}), (-0.2, 0.2)) for own in (0.0, 0.3))
    assert 0.2 < stiff[-1, 2] / free[-1, 2] < 0.98
    assert not driven(replace(PLAIN, changes={"castor_friction": 0.3, "castor_rolling": 0.2}), (0.0, 0.0)).any()


@pytest.mark.slow
def test_a_weak_motor_a_tired_battery_and_a_clock_do_what_they_say():
    assert driven(replace(PLAIN, changes={"weak_motor": 0.2}), (0.5, 0.5))[-1, 2] != 0.0
    tired = replace(PLAIN, changes={"battery_fade": 0.2})
    full, faded = (driven(one, (0.5, 0.5), 60.0)[-1, 0] for one in (PLAIN, tired))
    assert faded == pytest.approx(0.9 * full, rel=0.02)
    poses = np.zeros((1, 1200, 3))
    poses[0, :, 0] = np.arange(1200) * third.ROW_S
    seen = third.seen(replace(PLAIN, changes={"clock_rate": 0.004}), poses, plan(1, 1, 1200))
    assert poses[0, 1000, 0] - seen[0, 1000, 0] == pytest.approx(0.004 * 50.0)


def test_the_plain_figures_are_in_every_robots_order_and_no_change_is_of_another():
    assert third.FIGURES[:3] == ("mass", "yaw_inertia", "wheel_mass")
    assert all(set(changes) <= set(third.PLAIN) for both in third.CHANGES.values() for changes in both)
    assert len({case.name for case in (*third.CLEAN, *third.PHYSICS)}) == 48
