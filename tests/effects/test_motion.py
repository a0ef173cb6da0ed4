"""Effects on the body's motion and on the measured pose against what they should do by hand."""

import numpy as np
import pytest

from proxytune.effects import Setting
from proxytune.effects.body.floor import FloorSlope
from proxytune.effects.body.measurement import HeadingOffset, MarkerOffset
from proxytune.effects.body.motion import LateralSlip, TurnSlip, YawScrub

NOMINAL = {"effective_baseline": 0.16}
RATE_HZ = 10.0


def run(effect, signal, headings=(0.0,), cut=None):
    signal = np.asarray(signal, dtype=float)
    rest = np.zeros((*signal.shape[:-2], 3))
    memory = effect.begin(Setting(RATE_HZ, rest, NOMINAL, 0, np.asarray(headings, dtype=float)))
    first, memory = effect.apply(signal[..., :cut, :], memory)
    return first if cut is None else np.concatenate((first, effect.apply(signal[..., cut:, :], memory)[0]), axis=-2)


def test_a_baseline_twice_as_wide_halves_the_yaw_rate():
    np.testing.assert_allclose(run(YawScrub(0.32), [[0.5, 0.1, 2.0]]), [[0.5, 0.1, 1.0]])


@pytest.mark.parametrize(("yaw", "forward"), [(0.0, 0.5), (2.0, 0.3), (-2.0, 0.3), (9.0, 0.0)])
def test_turning_costs_forward_speed_at_most_all_of_it(yaw, forward):
    np.testing.assert_allclose(run(TurnSlip(0.2), [[0.5, 0.1, yaw]]), [[forward, 0.1, yaw]])


@pytest.mark.parametrize(("forward", "yaw", "sideways"), [(0.5, 2.0, -0.1), (0.5, -2.0, 0.1), (0.0, 2.0, 0.0)])
def test_a_robot_slides_outwards_in_a_bend(forward, yaw, sideways):
    np.testing.assert_allclose(run(LateralSlip(0.1), [[forward, 0.0, yaw]]), [[forward, sideways, yaw]])


@pytest.mark.parametrize(
    ("heading", "forward", "slowed"),
    [
        (0.0, 0.3, 0.2),  # uphill
        (np.pi, 0.3, 0.4),  # downhill
        (np.pi / 2, 0.3, 0.35),  # along y, where it falls
        (0.0, -0.3, -0.4),  # backing downhill
        (0.0, 0.01, -0.04),  # half of the slope is taken up by friction
        (0.0, 0.0, 0.0),
    ],
)
def test_uphill_is_slower_and_a_robot_at_rest_stays(heading, forward, slowed):
    twist = run(FloorSlope(0.1, -0.05, 0.0), [[forward, 0.2, 0.3]], headings=(heading,))
    np.testing.assert_allclose(twist, [[slowed, 0.2, 0.3]], atol=1e-12)


TURNING = np.tile((0.3, 0.0, 5.0), (6, 1))  # half a radian each sample
LOST = {"start": [1.0, 1.5, 2.0, 2.5, 3.0, 3.5], "some": [1.0, 1.1, 1.2, 1.7, 2.2, 2.7], "all": [0.1] * 6}


@pytest.mark.parametrize("cut", [None, 1, 2, 3, 4, 5])
@pytest.mark.parametrize(
    ("headings", "used"), [([1.0], "start"), ([1.0, 1.1, 1.2], "some"), ([0.1] * 6, "all"), ([0.1] * 9, "all")]
)
def test_headings_known_beforehand_are_used_and_beyond_them_the_robot_turns_on(headings, used, cut):
    slowed = run(FloorSlope(0.1, 0.0, 0.0), TURNING, headings=headings, cut=cut)[:, 0]
    np.testing.assert_allclose(slowed, 0.3 - 0.1 * np.cos(LOST[used]), atol=1e-12)


def test_each_member_of_a_batch_has_headings_of_its_own():
    batch = np.stack((TURNING, TURNING))
    slowed = run(FloorSlope(0.1, 0.0, 0.0), batch, headings=[[1.0, 1.1, 1.2], [0.0, 0.0, 0.0]])[..., 0]
    expected = [LOST["some"], [0.0, 0.0, 0.0, 0.5, 1.0, 1.5]]
    np.testing.assert_allclose(slowed, 0.3 - 0.1 * np.cos(expected), atol=1e-12)


@pytest.mark.parametrize(("heading", "x", "y"), [(0.0, 1.1, 2.02), (np.pi / 2, 0.98, 2.1), (np.pi, 0.9, 1.98)])
def test_the_tracked_point_lies_ahead_of_the_axle_and_to_its_left(heading, x, y):
    np.testing.assert_allclose(run(MarkerOffset(0.1, 0.02), [[1.0, 2.0, heading]]), [[x, y, heading]])


def test_a_turned_marker_adds_to_the_heading_alone():
    np.testing.assert_allclose(run(HeadingOffset(-30.0), [[1.0, 2.0, 0.5]]), [[1.0, 2.0, 0.5 - np.pi / 6]])
