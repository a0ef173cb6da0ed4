"""gym-duckietown's vehicle steps as its equations say, and each variant of it drives otherwise."""

from dataclasses import replace

import gym_dynamics_cases as gym
import numpy as np
import pytest

OWN = gym.Case("own", seed=5, delay=0.1)


def driven(case, duty, seconds=4.0):
    held = np.tile(np.asarray(duty, dtype=float), (1, round(seconds / gym.ROW_S) + 1, 1))
    return gym._driven(case, held, np.zeros((1, 3)))[0]


def lagging(rate, lag, seconds=4.0, delay=0.1):
    """The way to a row under a constant rate that is reached with a lag."""
    since = np.maximum(np.arange(0.0, seconds + 1e-9, gym.ROW_S) - delay, 0.0)
    return rate * (since - lag * (1.0 - np.exp(-since / lag)))


def test_the_vehicle_itself_lags_by_a_fifth_of_a_second_ahead_and_a_quarter_in_turns():
    np.testing.assert_allclose(driven(OWN, (0.5, 0.5))[:, 0], lagging(0.3, 0.2), atol=2e-3)
    np.testing.assert_allclose(driven(OWN, (-0.2, 0.2))[:, 2], lagging(1.5, 0.25), atol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("case", gym.PHYSICS[3:], ids=lambda case: case.name)
def test_every_variant_drives_otherwise(case):
    short = {"episodes": 2, "seconds": 15.0, "noiseless": True}
    one, other = (gym.make_log(own, **short) for own in (case, replace(case, changes={})))
    away = [a.poses[:, :2] - b.poses[:, :2] for a, b in zip(one.episodes, other.episodes, strict=True)]
    assert np.isfinite(away).all()
    assert np.hypot(*np.concatenate(away).T).max() > 2e-3


def test_a_driver_adds_a_step_that_turns_no_wheel_against_its_duty_and_changes_are_of_figures_there_are():
    told = gym._voltages(np.array([-0.5, -0.02, 0.0, 0.02, 0.5]), 0.9, 0.1)
    np.testing.assert_allclose(told, [-0.55, -0.118, 0.0, 0.118, 0.55])
    np.testing.assert_allclose(gym._voltages(np.array([-0.5, 0.02]), 1.0, -0.05), [-0.45, 0.0])
    assert all(set(changes) <= {*gym.OWN, *gym.DRIVER} for both in gym.CHANGES.values() for changes in both)
    assert len({case.name for case in gym.PHYSICS}) == len(gym.PHYSICS) == 19
