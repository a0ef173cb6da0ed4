"""Slopes push and patches slip where the robot is, by poses known beforehand or by its own motion."""

import numpy as np
import pytest

from proxytune.effects import Setting
from proxytune.effects.body.floor import FloorSlope, SlipperyPatch

RATE_HZ = 60.0
PATCH = SlipperyPatch(0.5, 1.0, 0.0, 0.3)


def run(effect, signal, places=((0.0, 0.0),), headings=(0.0,), cut=None):
    setting = Setting(RATE_HZ, np.zeros(3), {}, 0, np.array(headings), np.array(places))
    signal = np.asarray(signal, dtype=float)
    first, memory = effect.apply(signal[:cut], effect.begin(setting))
    return first if cut is None else np.concatenate((first, effect.apply(signal[cut:], memory)[0]))


def test_a_robot_across_a_slope_slides_downhill_by_the_push():
    (along,) = run(FloorSlope(0.1, 0.0, 0.5), [[0.4, 0.0, 0.0]])
    np.testing.assert_allclose(along, (0.3, 0.0, 0.0), atol=1e-12)
    (across,) = run(FloorSlope(0.1, 0.0, 0.5), [[0.4, 0.0, 0.0]], headings=(np.pi / 2,))
    np.testing.assert_allclose(across, (0.4, 0.05, 0.0), atol=1e-12)


def test_a_robot_at_rest_slides_nowhere():
    np.testing.assert_array_equal(run(FloorSlope(0.1, 0.1, 1.0), [[0.0, 0.0, 1.0]]), [[0.0, 0.0, 1.0]])


@pytest.mark.parametrize(("place", "kept"), [((1.0, 0.0), 0.5), ((1.0, 0.3), 0.75), ((0.5, 0.0), 1.0)])
def test_all_motion_shrinks_within_a_patch_and_half_as_much_at_its_edge(place, kept):
    np.testing.assert_allclose(run(PATCH, [[0.4, 0.1, 1.0]], places=(place,)), [[0.4 * kept, 0.1 * kept, kept]])


@pytest.mark.parametrize("cut", [None, 7, 100])
def test_a_robot_that_drives_over_a_patch_finds_it_by_its_own_motion(cut):
    moved = run(PATCH, np.tile((0.5, 0.0, 0.0), (300, 1)), cut=cut)[:, 0]
    way = np.cumsum(moved) / RATE_HZ
    np.testing.assert_allclose(moved[way < 0.6], 0.5)
    np.testing.assert_allclose(moved[(way > 0.8) & (way < 1.2)], 0.25)
    assert moved[-1] == 0.5


def test_poses_known_beforehand_say_where_the_robot_is_whatever_it_was_asked():
    places = [(0.0, 0.0)] * 3 + [(1.0, 0.0)] * 3
    moved = run(PATCH, np.tile((0.1, 0.0, 0.0), (6, 1)), places=places, headings=[0.0] * 6, cut=4)
    np.testing.assert_allclose(moved[:, 0], [0.1] * 3 + [0.05] * 3)
