"""A model's pictures are those of its camera, and the slopes of its residuals those of finite differences."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from pictured import ROAD, ROBOT, lane_poses, pictures
from viewed import NEUTRAL, OPTICS, at_truth, drive, driven, still, stood

from proxytune.diagnosis import project
from proxytune.diagnosis.camera.edges import MOVING, Tape
from proxytune.diagnosis.camera.model import camera_slopes, draw_pictures, map_slopes, pose_slopes, tape_slopes
from proxytune.domain import make_episode
from proxytune.driving import LINES, LaneFollowing, read_robot

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


def test_pictures_are_those_of_the_domain_s_camera_in_the_order_asked_for_from_where_it_was(tmp_path):
    """Of LaneFollowing, at exact poses, in the robot's own size."""
    family = LaneFollowing("duckiebot", "planar", "ground_plane", ROAD, 4.0, 0.0, 0.0, (), tmp_path)
    robot = read_robot("duckiebot")
    poses = lane_poses(4)
    theta = {"camera_roll": 3.0, "camera_pitch": 21.0}
    instance = family.instance(theta)
    figures = robot.camera_figures()
    optics = replace(scenes()[0].optics, rows=figures.rows, columns=figures.columns)
    views = replace(scenes()[0], tracks=still(poses), optics=optics)
    mine = draw_pictures(views, at_truth(views, theta), {}, FRAMES)
    np.testing.assert_array_equal(mine, instance.camera.render(poses))
    assert make_episode(theta, agent="none", start=0, seed=1).theta
    views, by = scenes()[0], np.array((0.01, -0.02, 0.05))
    state = replace(at_truth(views), poses=np.tile(by, (4, 1)))
    np.testing.assert_array_equal(draw_pictures(views, state, {}, FRAMES), pictures({}, lane_poses(4) + by))
    np.testing.assert_array_equal(drawn(frames=np.array([2, 0])), drawn()[[2, 0]])
    np.testing.assert_array_equal(drawn(look={"blur": 0.1, "rolling_shutter": 0.03}), drawn())


def test_a_latency_shows_what_was_there_before_and_blur_shifts_nothing():
    views = scenes()[True]
    before = replace(views, tracks=replace(views.tracks, instants=views.tracks.instants - 0.2))
    late = drawn(True, theta={"camera_latency": 0.2})
    np.testing.assert_array_equal(late, draw_pictures(before, at_truth(before), {}, FRAMES))
    assert np.abs(late - drawn(True)).mean() > 1.0
    sharp, soft, softer = (drawn(True, {"blur": seconds}) for seconds in (0.0, 0.05, 0.15))
    assert sharpness(sharp) > sharpness(soft) > sharpness(softer)
    assert soft.mean() == pytest.approx(sharp.mean(), rel=0.01)
    offsets = [np.abs(softer - drawn(True, theta={"camera_latency": late})).mean() for late in (-0.05, 0.0, 0.05)]
    assert offsets[1] == min(offsets)


def test_each_row_is_shown_at_its_own_time_by_the_readout_of_camera_or_look():
    """The middle row is on time; the last is half the readout late, the first as early."""
    rolled = drawn(True, {"rolling_shutter": 0.1})
    late, now = (drawn(True, theta={"camera_latency": by}) for by in (-0.05, 0.0))
    last, middle = slice(116, 120), slice(59, 61)
    assert np.abs(rolled - late)[:, last].mean() < 0.3 * np.abs(rolled - now)[:, last].mean()
    assert np.abs(rolled - now)[:, middle].mean() < 0.2 * np.abs(now - late)[:, middle].mean()
    slow, at_once = {"rolling_shutter": 0.1}, {"rolling_shutter": 0.0}
    np.testing.assert_array_equal(drawn(True, theta=slow), drawn(True, slow))
    np.testing.assert_array_equal(drawn(True, at_once, slow), drawn(True, at_once))


def test_effects_on_pictures_change_sharpness_corners_and_brightness_within_0_and_255():
    sharp, soft = drawn(), drawn(look={"defocus": 0.02})
    assert sharpness(soft) < 0.7 * sharpness(sharp)
    assert soft.mean() == pytest.approx(sharp.mean(), rel=0.02)

    ratio = (drawn(look={"vignetting": 0.4}) / np.maximum(drawn(), 1.0)).mean(axis=(0, 3))
    assert ratio[-1, 0] == pytest.approx(0.6, abs=0.02)
    assert ratio[59:61, 79:81].mean() == pytest.approx(1.0, abs=0.01)

    before = drawn()
    after = drawn(look={"exposure.gain": 1.2, "exposure.gamma": 1.5})
    np.testing.assert_allclose(after, np.clip(255.0 * 1.2 * (before / 255.0) ** 1.5, 0.0, 255.0), atol=0.01)

    np.testing.assert_array_equal(drawn(look={"image_noise": 10.0}), drawn())

    bright = drawn(look={"exposure.gain": 4.0, "exposure.gamma": 1.0})
    assert bright.max() == 255.0
    assert bright.dtype == np.float32
    assert set(NEUTRAL) >= set(ROBOT.catalogue.theta_names("lens_centre"))


FAULTS = {"camera_roll": 3.0, "lens_distortion": -0.1, "camera_yaw": 2.0}


def scene(moving=False):
    """Views, and a state that is off in every respect."""
    views = driven(count=12) if moving else stood(count=12, noisy=False)
    random = np.random.default_rng(5)
    state = at_truth(views, {**FAULTS, "camera_latency": 0.08, "rolling_shutter": 0.02} if moving else FAULTS)
    # Slopes leave out that a line askew lies elsewhere farther on: a hundredth of them
    tape = random.normal(0.0, 0.003, state.tape.shape)
    tape[len(LINES) * views.markings.stretches :] = 0.0
    poses = random.normal(0.0, 1.0, state.poses.shape) * (0.003, 0.003, 0.01)
    return views, replace(state, tape=tape, offset=np.array((0.01, -0.02, 0.01)), poses=poses)


def check(views, state, one, other, step, slope):
    """The change of the distance [m] in pixels of the middle state, where the nearest edge stays the same."""
    here, after, before = project(views, state), project(views, one), project(views, other)
    same = here.valid.copy()
    for there in (after, before):
        same &= there.near & (there.marks.stretch == here.marks.stretch) & (there.marks.line == here.marks.line)
        same &= there.marks.side == here.marks.side
    same &= here.marks.line != 3  # The way to a dash's end is measured along the centre line
    change = (after.residual * after.metres - before.residual * before.metres) / here.metres / (2.0 * step)
    scale = np.abs(slope[same]).max()
    off = np.abs(change - slope)[same]
    assert same.sum() > 500
    assert scale > 0.0
    assert np.quantile(off, 0.99) < 2e-3 * scale


@pytest.mark.parametrize("name", OPTICS.mounting)
def test_slopes_by_the_camera_are_true(name):
    views, state = scene()
    step = OPTICS.step(name, state.theta[name])
    moved = [replace(state, theta={**state.theta, name: state.theta[name] + way * step}) for way in (1.0, -1.0)]
    check(views, state, *moved, step, camera_slopes(views, state, project(views, state), [name])[:, 0])


@pytest.mark.parametrize("name", MOVING)
def test_slopes_by_latency_and_readout_are_true(name):
    """Nearly: rates are the tracker's, and poses between two of its samples lie on a line."""
    views, state = scene(moving=True)
    there, step = project(views, state), 1e-4
    moved = [replace(state, theta={**state.theta, name: state.theta[name] + way * step}) for way in (1.0, -1.0)]
    one, other = (project(views, each) for each in moved)
    same = there.valid & (one.marks.line == other.marks.line) & (one.marks.side == other.marks.side)
    same &= (there.marks.line != 3) & (one.marks.stretch == other.marks.stretch)
    change = (one.residual * one.metres - other.residual * other.metres) / there.metres / (2.0 * step)
    slope = camera_slopes(views, state, there, [name])[:, 0]
    assert np.quantile(np.abs(change - slope)[same], 0.95) < 0.1 * np.abs(slope[same]).max()
    assert np.corrcoef(change[same], slope[same])[0, 1] > 0.98


@pytest.mark.parametrize("of", ["poses", "offset"])
@pytest.mark.parametrize("column", range(3))
def test_slopes_by_the_pose_and_by_the_whole_map_are_true(of, column):
    views, state = scene()
    by, there = 1e-6 * np.eye(3)[column], project(views, state)
    moved = [replace(state, **{of: getattr(state, of) + way * by}) for way in (1.0, -1.0)]
    slope = pose_slopes(there) if of == "poses" else map_slopes(views, state, there)
    check(views, state, *moved, 1e-6, slope[:, column])


def test_slopes_by_the_tape_are_exact():
    views, state = scene()
    there = project(views, state)
    dense = np.zeros((len(there.residual), Tape(views.markings.stretches).size))
    for place, slope in tape_slopes(views, there):
        dense[np.arange(len(place)), place] += slope
    by = np.random.default_rng(1).normal(0.0, 0.002, state.tape.shape)
    change = project(views, replace(state, tape=state.tape + by)).residual - there.residual
    np.testing.assert_allclose(change, dense @ by, atol=1e-9)


@pytest.mark.parametrize("theta", [{}, FAULTS], ids=["nominal", "faulty"])
def test_residuals_vanish_at_the_truth_and_not_beside_it(theta):
    views = stood(theta, count=30, noisy=False)
    there, wrong = (project(views, at_truth(views, told)) for told in (theta, {**theta, "camera_pitch": 17.0}))
    assert there.valid.sum() > 0.5 * there.near.sum()
    assert np.median(np.abs(there.residual[there.valid])) < 0.15
    assert abs(np.median(there.residual[there.valid & views.edges.white])) < 0.1
    assert np.median(np.abs(wrong.residual[wrong.valid])) > 1.0


def test_a_drive_s_residuals_vanish_at_its_latency_and_edges_of_other_polarity_do_not_count():
    truth = {"camera_latency": 0.12, "rolling_shutter": 0.04}
    views = driven(truth, count=12)
    medians = [
        np.median(np.abs(there.residual[there.valid]))
        for there in (project(views, at_truth(views, told)) for told in (truth, {}, {**truth, "rolling_shutter": 0.0}))
    ]
    assert medians[0] < 0.2
    assert medians[1] > 3.0 * medians[0]
    assert medians[2] > 1.05 * medians[0]
    views = stood(count=6, noisy=False)
    there = project(replace(views, edges=views.edges._replace(row=np.full_like(views.edges.row, 5.0))), at_truth(views))
    assert not there.near.any()
    assert np.isfinite(there.residual).all()
    assert np.isfinite(there.slope).all()
    flipped = replace(views, edges=views.edges._replace(normal=-views.edges.normal))
    right, wrong = project(views, at_truth(views)), project(flipped, at_truth(views))
    close = right.valid & (np.abs(right.residual) < 0.5)
    assert close.sum() > 300
    assert not wrong.valid[close].any()
