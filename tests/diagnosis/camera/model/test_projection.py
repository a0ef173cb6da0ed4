"""Residuals vanish at the truth, and every slope agrees with finite differences."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from viewed import NEUTRAL, OPTICS, at_truth, driven, stood

from proxytune.diagnosis.camera.model.optics import MOVING
from proxytune.diagnosis.camera.model.projection import camera_slopes, map_slopes, pose_slopes, project, tape_slopes
from proxytune.diagnosis.camera.model.views import Tape
from proxytune.driving.road.markings import LINES

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


@pytest.mark.parametrize("column", range(3))
def test_slopes_by_the_pose_are_true(column):
    views, state = scene()
    by = 1e-6 * np.eye(3)[column]
    moved = [replace(state, poses=state.poses + way * by) for way in (1.0, -1.0)]
    check(views, state, *moved, 1e-6, pose_slopes(project(views, state))[:, column])


@pytest.mark.parametrize("column", range(3))
def test_slopes_by_the_whole_map_are_true(column):
    views, state = scene()
    by = 1e-6 * np.eye(3)[column]
    moved = [replace(state, offset=state.offset + way * by) for way in (1.0, -1.0)]
    check(views, state, *moved, 1e-6, map_slopes(views, state, project(views, state))[:, column])


def test_slopes_by_the_tape_are_exact():
    views, state = scene()
    there = project(views, state)
    dense = np.zeros((len(there.residual), Tape(views.markings.stretches).size))
    for place, slope in tape_slopes(views, there):
        dense[np.arange(len(place)), place] += slope
    by = np.random.default_rng(1).normal(0.0, 0.002, state.tape.shape)
    change = project(views, replace(state, tape=state.tape + by)).residual - there.residual
    np.testing.assert_allclose(change, dense @ by, atol=1e-9)


def test_no_parameter_has_no_slope():
    views, state = scene()
    assert camera_slopes(views, state, project(views, state), []).shape == (len(views.edges.row), 0)


@pytest.mark.parametrize("theta", [{}, FAULTS], ids=["nominal", "faulty"])
def test_residuals_vanish_at_the_truth_and_not_beside_it(theta):
    views = stood(theta, count=30, noisy=False)
    there, wrong = (project(views, at_truth(views, told)) for told in (theta, {**theta, "camera_pitch": 17.0}))
    assert there.valid.sum() > 0.5 * there.near.sum()
    assert np.median(np.abs(there.residual[there.valid])) < 0.15
    assert abs(np.median(there.residual[there.valid & views.edges.white])) < 0.1
    assert np.median(np.abs(wrong.residual[wrong.valid])) > 1.0


def test_a_drive_s_residuals_vanish_at_its_latency_and_readout():
    truth = {"camera_latency": 0.12, "rolling_shutter": 0.04}
    views = driven(truth, count=12)
    medians = [
        np.median(np.abs(there.residual[there.valid]))
        for there in (project(views, at_truth(views, told)) for told in (truth, {}, {**truth, "rolling_shutter": 0.0}))
    ]
    assert medians[0] < 0.2
    assert medians[1] > 3.0 * medians[0]
    assert medians[2] > 1.05 * medians[0]


def test_what_lies_above_the_horizon_is_never_near():
    views = stood(count=6, noisy=False)
    sky = views.edges._replace(row=np.full_like(views.edges.row, 5.0))
    there = project(replace(views, edges=sky), at_truth(views))
    assert not there.near.any()
    assert np.isfinite(there.residual).all()
    assert np.isfinite(there.slope).all()


def test_an_edge_of_the_other_polarity_is_not_valid():
    views = stood(count=6, noisy=False)
    flipped = replace(views, edges=views.edges._replace(normal=-views.edges.normal))
    right, wrong = project(views, at_truth(views)), project(flipped, at_truth(views))
    close = right.valid & (np.abs(right.residual) < 0.5)
    assert close.sum() > 300
    assert not wrong.valid[close].any()


def test_the_neutral_camera_is_not_moved_by_names_that_are_not_its_own():
    views = stood(count=6, noisy=False)
    there = project(views, at_truth(views))
    again = project(views, at_truth(views, {"blur": 0.05}))
    np.testing.assert_array_equal(there.residual, again.residual)
    assert set(NEUTRAL) >= {"camera_pitch", "camera_latency"}
