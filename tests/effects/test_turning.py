"""Driving and turning mix as the formulas say."""

import numpy as np
import pytest

from proxytune.effects import Setting
from proxytune.effects.body.turning import CrossCoupling, Understeer, YawLag

RATE_HZ = 60.0


def run(effect, signal, rest=(0.0, 0.0, 0.0)):
    memory = effect.begin(Setting(RATE_HZ, np.array(rest), {}))
    return effect.apply(np.asarray(signal, dtype=float), memory)[0]


@pytest.mark.parametrize("yaw", [2.0, -2.0])
@pytest.mark.parametrize("forward", [0.5, -0.5])
def test_coupling_does_not_ask_which_way_the_robot_turns_or_drives(forward, yaw):
    (moved,) = run(CrossCoupling(0.01, 0.4), [[forward, 0.1, yaw]])
    np.testing.assert_allclose(moved, (forward + 0.04, 0.1, yaw + 0.2))


def test_a_fast_robot_turns_less_and_a_robot_that_spins_turns_as_asked():
    moved = run(Understeer(0.5), [[0.4, 0.1, 1.2], [-0.4, 0.1, 1.2], [0.0, 0.0, 1.2]])
    np.testing.assert_allclose(moved, [[0.4, 0.1, 1.0], [-0.4, 0.1, 1.0], [0.0, 0.0, 1.2]])


def test_the_yaw_rate_comes_late_and_the_forward_speed_does_not():
    moved = run(YawLag(0.2), np.tile((0.3, 0.0, 1.0), (60, 1)))
    np.testing.assert_array_equal(moved[:, :2], np.tile((0.3, 0.0), (60, 1)))
    assert moved[:12, 2].sum() / RATE_HZ == pytest.approx(0.2 * np.exp(-1.0), rel=1e-6)
    assert moved[-1, 2] == pytest.approx(1.0, abs=0.01)


def test_a_robot_that_turns_already_goes_on_turning():
    np.testing.assert_allclose(run(YawLag(0.2), np.tile((0.0, 0.0, 1.0), (5, 1)), rest=(0.0, 0.0, 1.0))[:, 2], 1.0)
