"""Effects on the body's motion and on the measured pose against what they should do by hand."""

import numpy as np
import pytest
from filtered import filtered

from proxytune.effects import motion
from proxytune.effects.motion import FloorSlope

RATE_HZ = 60.0
PATCH = motion.SlipperyPatch(0.5, 1.0, 0.0, 0.3)


def test_a_robot_across_a_slope_slides_downhill_by_the_push_and_one_at_rest_nowhere():
    (along,) = filtered(FloorSlope(0.1, 0.0, 0.5), [[0.4, 0.0, 0.0]])
    np.testing.assert_allclose(along, (0.3, 0.0, 0.0), atol=1e-12)
    (across,) = filtered(FloorSlope(0.1, 0.0, 0.5), [[0.4, 0.0, 0.0]], headings=(np.pi / 2,))
    np.testing.assert_allclose(across, (0.4, 0.05, 0.0), atol=1e-12)
    np.testing.assert_array_equal(filtered(FloorSlope(0.1, 0.1, 1.0), [[0.0, 0.0, 1.0]]), [[0.0, 0.0, 1.0]])


@pytest.mark.parametrize(("place", "kept"), [((1.0, 0.0), 0.5), ((1.0, 0.3), 0.75), ((0.5, 0.0), 1.0)])
def test_all_motion_shrinks_within_a_patch_and_half_as_much_at_its_edge(place, kept):
    np.testing.assert_allclose(filtered(PATCH, [[0.4, 0.1, 1.0]], places=(place,)), [[0.4 * kept, 0.1 * kept, kept]])


@pytest.mark.parametrize("cut", [None, 7, 100])
def test_a_robot_that_drives_over_a_patch_finds_it_by_its_own_motion(cut):
    moved = filtered(PATCH, np.tile((0.5, 0.0, 0.0), (300, 1)), cut=cut)[:, 0]
    way = np.cumsum(moved) / RATE_HZ
    np.testing.assert_allclose(moved[way < 0.6], 0.5)
    np.testing.assert_allclose(moved[(way > 0.8) & (way < 1.2)], 0.25)
    assert moved[-1] == 0.5


def test_a_robot_finds_its_place_and_heading_by_what_is_known_beforehand():
    places = [(0.0, 0.0)] * 3 + [(1.0, 0.0)] * 3
    moved = filtered(PATCH, np.tile((0.1, 0.0, 0.0), (6, 1)), places=places, headings=[0.0] * 6, cut=4)
    np.testing.assert_allclose(moved[:, 0], [0.1] * 3 + [0.05] * 3)
    batch = np.stack((TURNING, TURNING))
    slowed = driven(FloorSlope(0.1, 0.0, 0.0), batch, headings=[[1.0, 1.1, 1.2], [0.0, 0.0, 0.0]])[..., 0]
    np.testing.assert_allclose(slowed, 0.3 - 0.1 * np.cos([LOST["some"], [0.0, 0.0, 0.0, 0.5, 1.0, 1.5]]), atol=1e-12)


NOMINAL = {"effective_baseline": 0.16}


def driven(effect, signal, **known):
    return filtered(effect, signal, rate_hz=10.0, nominal=NOMINAL, **known)


def test_baselines_and_markers_turn_what_they_say_alone_and_a_fast_robot_turns_less_and_late():
    np.testing.assert_allclose(driven(motion.YawScrub(0.32), [[0.5, 0.1, 2.0]]), [[0.5, 0.1, 1.0]])
    np.testing.assert_allclose(driven(motion.HeadingOffset(-30.0), [[1.0, 2.0, 0.5]]), [[1.0, 2.0, 0.5 - np.pi / 6]])
    moved = filtered(motion.Understeer(0.5), [[0.4, 0.1, 1.2], [-0.4, 0.1, 1.2], [0.0, 0.0, 1.2]])
    np.testing.assert_allclose(moved, [[0.4, 0.1, 1.0], [-0.4, 0.1, 1.0], [0.0, 0.0, 1.2]])
    moved = filtered(motion.YawLag(0.2), np.tile((0.3, 0.0, 1.0), (60, 1)))
    np.testing.assert_array_equal(moved[:, :2], np.tile((0.3, 0.0), (60, 1)))
    assert moved[:12, 2].sum() / RATE_HZ == pytest.approx(0.2 * np.exp(-1.0), rel=1e-6)
    assert moved[-1, 2] == pytest.approx(1.0, abs=0.01)
    turning = np.tile((0.0, 0.0, 1.0), (5, 1))
    np.testing.assert_allclose(filtered(motion.YawLag(0.2), turning, rest=turning[0]), turning)


@pytest.mark.parametrize(("v", "square", "damping"), [(0.4, 2.0, 1.72), (-0.4, 2.0, 0.92), (-9.0, 0.0, 0.05)])
def test_a_body_lags_behind_its_wheels_and_turns_less_and_sooner_where_the_floor_resists(v, square, damping):
    twist = np.tile((v, 0.1, 2.0), (600, 1))
    moved = filtered(motion.Inertia(0.2, 0.3, 1.0, square), twist, rest=(v, 0.1, 0.0))
    late = 0.3 / damping * (1.0 - np.exp(-10.0 * damping / 0.3))
    np.testing.assert_allclose(moved.mean(axis=0), (v, 0.1, 2.0 / damping * (1.0 - late / 10.0)), rtol=1e-9)
    yaw, pushed = (filtered(motion.YawLag(lag), signal)[:, 2] for lag, signal in ((0.3, twist), (0.2, twist[:, ::-1])))
    np.testing.assert_allclose(
        filtered(motion.Inertia(0.2, 0.3, 0.0, 0.0), twist)[:, ::2], np.c_[pushed, yaw], atol=1e-12
    )


@pytest.mark.parametrize(("yaw", "forward"), [(0.0, 0.5), (2.0, 0.3), (-2.0, 0.3), (9.0, 0.0)])
def test_turning_costs_forward_speed_at_most_all_of_it(yaw, forward):
    np.testing.assert_allclose(driven(motion.TurnSlip(0.2), [[0.5, 0.1, yaw]]), [[forward, 0.1, yaw]])


@pytest.mark.parametrize(("forward", "yaw", "sideways"), [(0.5, 2.0, -0.1), (0.5, -2.0, 0.1), (0.0, 2.0, 0.0)])
def test_a_robot_slides_outwards_in_a_bend(forward, yaw, sideways):
    np.testing.assert_allclose(driven(motion.LateralSlip(0.1), [[forward, 0.0, yaw]]), [[forward, sideways, yaw]])


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
    twist = driven(FloorSlope(0.1, -0.05, 0.0), [[forward, 0.2, 0.3]], headings=(heading,))
    np.testing.assert_allclose(twist, [[slowed, 0.2, 0.3]], atol=1e-12)


TURNING = np.tile((0.3, 0.0, 5.0), (6, 1))  # half a radian each sample
LOST = {"start": [1.0, 1.5, 2.0, 2.5, 3.0, 3.5], "some": [1.0, 1.1, 1.2, 1.7, 2.2, 2.7], "all": [0.1] * 6}


@pytest.mark.parametrize("cut", [None, 1, 2, 3, 4, 5])
@pytest.mark.parametrize(
    ("headings", "used"), [([1.0], "start"), ([1.0, 1.1, 1.2], "some"), ([0.1] * 6, "all"), ([0.1] * 9, "all")]
)
def test_headings_known_beforehand_are_used_and_beyond_them_the_robot_turns_on(headings, used, cut):
    slowed = driven(FloorSlope(0.1, 0.0, 0.0), TURNING, headings=headings, cut=cut)[:, 0]
    np.testing.assert_allclose(slowed, 0.3 - 0.1 * np.cos(LOST[used]), atol=1e-12)


@pytest.mark.parametrize(("heading", "x", "y"), [(0.0, 1.1, 2.02), (np.pi / 2, 0.98, 2.1), (np.pi, 0.9, 1.98)])
def test_the_tracked_point_lies_ahead_of_the_axle_and_to_its_left(heading, x, y):
    np.testing.assert_allclose(driven(motion.MarkerOffset(0.1, 0.02), [[1.0, 2.0, heading]]), [[x, y, heading]])


@pytest.mark.parametrize("yaw", [2.0, -2.0])
@pytest.mark.parametrize("forward", [0.5, -0.5])
def test_coupling_does_not_ask_which_way_the_robot_turns_or_drives(forward, yaw):
    (moved,) = filtered(motion.CrossCoupling(0.01, 0.4), [[forward, 0.1, yaw]])
    np.testing.assert_allclose(moved, (forward + 0.04, 0.1, yaw + 0.2))
