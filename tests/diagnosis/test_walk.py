"""A diagnosis walks as the planar plant does."""

import numpy as np
import pytest

from proxytune.diagnosis.model.walk import walk
from proxytune.driving.planar import integrate

TICK_S = 1.0 / 60.0


def twists(turn, sideways=0.3):
    """Three drives of 400 ticks, straight ahead for a while, and standing at last."""
    drawn = np.random.default_rng(1).standard_normal((3, 400, 3)) * (0.5, sideways, turn)
    drawn[:, 100:150, 2], drawn[:, -50:] = 0.0, 0.0
    return drawn


@pytest.mark.parametrize("turn", [0.0, 1e-9, 3.0, 150.0])
@pytest.mark.parametrize("sideways", [0.0, 0.3])
def test_the_poses_are_those_of_the_planar_plant(turn, sideways):
    asked = twists(turn, sideways)
    walked = walk(asked, TICK_S)
    np.testing.assert_allclose(walked[:, 1:], integrate(np.zeros((3, 3)), asked, TICK_S), rtol=0.0, atol=1e-12)


def test_it_begins_at_the_origin_and_changes_no_twist():
    asked = twists(3.0)
    before = asked.copy()
    np.testing.assert_array_equal(walk(asked, TICK_S)[:, 0], 0.0)
    np.testing.assert_array_equal(asked, before)
