"""What may be learnt has its knots where the drives have been, and weights that are near have much in common."""

from dataclasses import replace

import numpy as np
import pytest
from manoeuvres import make_drives
from planted import TRUTH, driven_log, drives_of, planted_drives

from proxytune.diagnosis.motion.curve_offer import CORRELATED, offer_curves, prior_root, split_by_curve
from proxytune.diagnosis.motion.innovations import twists_of
from proxytune.effects import GROUPS, LearntCurve, learnt_effect, learnt_theta


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=3, seconds=20.0, noise=None)


def test_groups_are_offered_in_their_order_with_knots_within_what_was_driven(drives):
    offer, asked = offer_curves(drives, TRUTH), twists_of(drives, TRUTH)
    assert {curve.group for curve in offer.curves} == set(GROUPS)
    assert learnt_effect(learnt_theta(offer)) == offer
    assert not any(any(curve.weights) for curve in offer.curves)
    for bounds, signal in zip(offer.seen, (asked[..., 0], asked[..., 2]), strict=True):
        assert signal.min() <= bounds[0] < 0.0 < bounds[1] <= 1.01 * signal.max()
    knots = {curve.group: np.array(curve.knots) for curve in offer.curves}
    assert offer.seen.yaw[0] <= knots["turn_rate"].min() < 0.0 < knots["turn_rate"].max() <= offer.seen.yaw[1]
    assert knots["time"].max() <= 20.1

    ahead = replace(drives, duties=np.abs(drives.duties[..., :1]).repeat(2, axis=-1))
    groups = {curve.group for curve in offer_curves(ahead, {**TRUTH, "trim": 0.0}).curves}
    assert "direction" not in groups
    assert "turn_rate" not in groups
    assert "wheel_speed" in groups


@pytest.mark.parametrize("size_m", [2.0, 20.0, 100.0])
def test_places_are_learnt_on_a_table_in_a_hall_and_outdoors(drives, size_m):
    within = drives.poses[..., :2]
    poses = drives.poses.copy()
    poses[..., :2] = (within - within.min(axis=(0, 1))) / np.ptp(within, axis=(0, 1)) * size_m
    knots = {curve.group: np.array(curve.knots) for curve in offer_curves(replace(drives, poses=poses), TRUTH).curves}
    for axis in "xy":
        assert 3 <= len(knots[axis]) <= 16
        assert np.ptp(knots[axis]) > 0.8 * size_m


def test_knots_over_use_reach_as_far_as_the_drive_that_was_used_most(drives):
    duties = np.full_like(drives.duties, 0.1)
    duties[2] = 0.6
    offered = {curve.group: curve.knots for curve in offer_curves(replace(drives, duties=duties), TRUTH).curves}
    assert max(offered["use"]) == pytest.approx(0.6 * 20.0 / 60.0, rel=0.05)


def test_windows_cut_from_a_drive_each_in_a_frame_of_its_own_get_no_map_of_the_floor():
    drives, moving = make_drives(1, 4, 200), np.full((4, 2), 0.3)
    at_one_place = drives_of(driven_log(TRUTH, drives.duties, np.zeros((4, 3)), noise=None))
    apart = drives_of(driven_log(TRUTH, drives.duties, drives.starts + 0.1 * np.arange(4)[:, None], noise=None))

    def is_mapped(some):
        return any(curve.group == "place" for curve in offer_curves(some, TRUTH).curves)

    assert is_mapped(at_one_place)
    assert is_mapped(replace(apart, rest=moving))
    assert not is_mapped(replace(at_one_place, rest=moving))


def test_weights_that_are_near_are_alike_and_those_of_other_groups_are_on_their_own():
    over = LearntCurve("duty", "duty", (0.2, 0.21, 0.5, 1.2), (0.0,) * 4)
    root = prior_root(over)
    covariance = root @ root.T
    apart = np.abs(np.subtract.outer(over.knots, over.knots))
    np.testing.assert_allclose(covariance, np.exp(-apart / (CORRELATED["duty"] * 1.0)), atol=1e-12)
    corners = LearntCurve("place", "yaw", ((0.0, 0.0), (3.0, 4.0)), (0.0, 0.0))
    assert (prior_root(corners) @ prior_root(corners).T)[0, 1] == pytest.approx(
        np.exp(-5.0 / (CORRELATED["place"] * 4.0))
    )
    np.testing.assert_array_equal(prior_root(over._replace(group="wheel_speed")), np.eye(4))
    np.testing.assert_array_equal(prior_root(over._replace(knots=(0.3,))), np.eye(1))


def test_columns_belong_to_their_curves_and_those_of_the_model_to_none(drives):
    offer = offer_curves(drives, TRUTH)
    count = sum(len(curve.knots) for curve in offer.curves)
    columns = np.zeros((2, count + 3))
    parts = split_by_curve(offer, columns)
    assert [part.shape[-1] for part in parts] == [len(curve.knots) for curve in offer.curves]
    for part in parts:
        part[:] = 1.0
    np.testing.assert_array_equal(columns[0], [1.0] * count + [0.0] * 3)
