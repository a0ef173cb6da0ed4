"""Pictures of a model are those of its camera, and each effect changes them as it should."""

import functools
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from pictured import ROAD, ROBOT, lane_poses, pictures
from viewed import NEUTRAL, at_truth, drive, still, stood

from proxytune.diagnosis.camera.model.drawing import draw_pictures
from proxytune.domain import make_episode
from proxytune.driving.lane_following import LaneFollowing
from proxytune.driving.robot import read_robot

FRAMES = np.arange(4)


@functools.cache
def scenes():
    """Exact views standing still, and of a drive."""
    still_ = stood(count=4, noisy=False)
    return still_, replace(still_, tracks=drive(4))


def drawn(moving=False, look=None, theta=None, frames=FRAMES):
    views = scenes()[moving]
    return draw_pictures(views, at_truth(views, theta), look or {}, frames)


def sharpness(shown):
    return (np.diff(shown[:, 70:], axis=2) ** 2).mean()


def test_without_effects_pictures_are_those_of_the_domain_s_camera(tmp_path):
    """Of LaneFollowing, at exact poses, in the robot's own size."""
    family = LaneFollowing("duckiebot", "planar", "ground_plane", ROAD, 4.0, 0.0, 0.0, (), tmp_path)
    robot = read_robot("duckiebot")
    poses = lane_poses(4)
    theta = {"camera_roll": 3.0, "camera_pitch": 21.0}
    instance = family.instance(theta)
    figures = robot.camera_figures()
    views = replace(
        scenes()[0], tracks=still(poses), optics=replace(scenes()[0].optics, rows=figures.rows, columns=figures.columns)
    )
    mine = draw_pictures(views, at_truth(views, theta), {}, FRAMES)
    np.testing.assert_array_equal(mine, instance.camera.render(poses))
    assert make_episode(theta, agent="none", start=0, seed=1).theta


def test_what_is_added_to_a_tracked_pose_moves_the_camera():
    views, by = scenes()[0], np.array((0.01, -0.02, 0.05))
    state = replace(at_truth(views), poses=np.tile(by, (4, 1)))
    np.testing.assert_array_equal(draw_pictures(views, state, {}, FRAMES), pictures({}, lane_poses(4) + by))


def test_frames_are_drawn_in_the_order_asked_for():
    np.testing.assert_array_equal(drawn(frames=np.array([2, 0])), drawn()[[2, 0]])


def test_effects_of_time_leave_frames_standing_still_alone():
    np.testing.assert_array_equal(drawn(look={"blur": 0.1, "rolling_shutter": 0.03}), drawn())


def test_a_latency_shows_what_was_there_so_long_before():
    views = scenes()[True]
    tracks = views.tracks
    before = replace(views, tracks=replace(tracks, instants=tracks.instants - 0.2))
    np.testing.assert_array_equal(
        drawn(True, theta={"camera_latency": 0.2}), draw_pictures(before, at_truth(before), {}, FRAMES)
    )
    assert np.abs(drawn(True, theta={"camera_latency": 0.2}) - drawn(True)).mean() > 1.0


def test_blur_softens_a_drive_s_pictures_and_does_not_shift_them():
    sharp, soft, softer = (drawn(True, {"blur": seconds}) for seconds in (0.0, 0.05, 0.15))
    assert sharpness(sharp) > sharpness(soft) > sharpness(softer)
    assert soft.mean() == pytest.approx(sharp.mean(), rel=0.01)
    offsets = [np.abs(softer - drawn(True, theta={"camera_latency": late})).mean() for late in (-0.05, 0.0, 0.05)]
    assert offsets[1] == min(offsets)


def test_a_rolling_shutter_shows_each_row_at_its_own_time():
    """The middle row is on time; the last is half the readout late, the first as early."""
    rolled = drawn(True, {"rolling_shutter": 0.1})
    late, now = (drawn(True, theta={"camera_latency": by}) for by in (-0.05, 0.0))
    last, middle = slice(116, 120), slice(59, 61)
    assert np.abs(rolled - late)[:, last].mean() < 0.3 * np.abs(rolled - now)[:, last].mean()
    assert np.abs(rolled - now)[:, middle].mean() < 0.2 * np.abs(now - late)[:, middle].mean()


def test_a_readout_of_the_camera_counts_where_the_look_has_none():
    np.testing.assert_array_equal(
        drawn(True, theta={"rolling_shutter": 0.1}), drawn(True, look={"rolling_shutter": 0.1})
    )
    np.testing.assert_array_equal(
        drawn(True, {"rolling_shutter": 0.0}, {"rolling_shutter": 0.1}), drawn(True, {"rolling_shutter": 0.0})
    )


def test_defocus_softens_all_over_and_keeps_the_brightness():
    sharp, soft = drawn(), drawn(look={"defocus": 0.02})
    assert sharpness(soft) < 0.7 * sharpness(sharp)
    assert soft.mean() == pytest.approx(sharp.mean(), rel=0.02)


def test_vignetting_darkens_the_corners_by_its_strength_and_not_the_middle():
    ratio = (drawn(look={"vignetting": 0.4}) / np.maximum(drawn(), 1.0)).mean(axis=(0, 3))
    assert ratio[-1, 0] == pytest.approx(0.6, abs=0.02)
    assert ratio[59:61, 79:81].mean() == pytest.approx(1.0, abs=0.01)


def test_exposure_brightens_by_gain_and_bends_by_gamma():
    before = drawn()
    after = drawn(look={"exposure.gain": 1.2, "exposure.gamma": 1.5})
    np.testing.assert_allclose(after, np.clip(255.0 * 1.2 * (before / 255.0) ** 1.5, 0.0, 255.0), atol=0.01)


def test_noise_is_left_out():
    np.testing.assert_array_equal(drawn(look={"image_noise": 10.0}), drawn())


def test_pictures_stay_within_0_and_255():
    bright = drawn(look={"exposure.gain": 4.0, "exposure.gamma": 1.0})
    assert bright.max() == 255.0
    assert bright.dtype == np.float32
    assert set(NEUTRAL) >= set(ROBOT.catalogue.theta_names("lens_centre"))
