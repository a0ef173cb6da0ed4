"""Planted cameras come back within their own standard deviations, with tape, map and poses as nuisances."""

from dataclasses import replace

import numpy as np
import pytest
from pictured import lane_poses, pictures
from viewed import NEUTRAL, OPTICS, SCATTER, at_truth, driven, everything, still, stood, tracked, views_of

from proxytune.diagnosis.camera.edges import MOVING
from proxytune.diagnosis.camera.fitting import Normal, fit_camera, pose_scatter
from proxytune.diagnosis.camera.selection import FAR, NEAR, fit_everything

SINGLE = {
    "camera_pitch": (21.0, 0.3),
    "camera_roll": (4.0, 0.3),
    "camera_yaw": (3.0, 0.4),
    "camera_height": (0.12, 0.002),
    "camera_forward": (0.09, 0.004),
    "field_of_view": (70.0, 0.8),
    "lens_distortion": (-0.2, 0.02),
    "lens_centre.right": (0.06, 0.01),
    "lens_centre.down": (-0.05, 0.01),
    "pixel_aspect": (1.1, 0.02),
}
"""A planted value of each, and how far from it the fit may end."""


@pytest.mark.slow
@pytest.mark.parametrize("name", SINGLE)
def test_a_planted_figure_comes_back(name):
    truth, most = SINGLE[name]
    views = stood({name: truth})
    fit = fit_camera(views, at_truth(views), [name], (*FAR, *NEAR))
    assert abs(fit.theta[name] - truth) < most
    assert abs(fit.theta[name] - truth) < 3.0 * fit.sd[0]


@pytest.mark.slow
def test_three_figures_together_come_back_from_far_away():
    truth = {"camera_pitch": 23.0, "camera_roll": -5.0, "camera_height": 0.12}
    views = stood(truth)
    fit = fit_camera(views, at_truth(views), tuple(truth), (*FAR, *NEAR))
    off = np.array([fit.theta[name] - truth[name] for name in fit.names])
    assert (np.abs(off) < (0.3, 0.3, 0.002)).all()
    assert (np.abs(off) < 3.0 * fit.sd).all()


def test_all_figures_free_lie_within_three_deviations_of_the_truth():
    truth = {"camera_roll": 4.0, "lens_distortion": -0.15}
    fit = everything(truth)
    assert (np.abs(np.array([fit.theta[name] - {**NEUTRAL, **truth}[name] for name in fit.names])) < 3.0 * fit.sd).all()
    assert abs(fit.theta["camera_roll"] - 4.0) < 0.5
    assert abs(fit.theta["lens_distortion"] + 0.15) < 0.03


@pytest.mark.slow
@pytest.mark.parametrize(("name", "truth", "most"), [("camera_latency", 0.12, 0.006), ("rolling_shutter", 0.06, 0.012)])
def test_figures_of_time_come_back_from_a_drive(name, truth, most):
    views = driven({name: truth})
    fit = fit_camera(views, at_truth(views), MOVING, (*FAR, *NEAR))
    place = fit.names.index(name)
    assert abs(fit.theta[name] - truth) < most
    assert abs(fit.theta[name] - truth) < 3.0 * fit.sd[place]


@pytest.mark.slow
def test_poses_are_told_better_than_the_tracker_has_them():
    views = stood({"camera_roll": 4.0})
    fit = fit_camera(views, at_truth(views), ["camera_roll"], (*FAR, *NEAR))
    exact = stood({"camera_roll": 4.0}, noisy=False).tracks.poses
    before, after = views.tracks.poses - exact, views.tracks.poses + fit.state.poses - exact
    assert (after.std(axis=0) < 0.85 * before.std(axis=0)).all()
    assert (fit.pose_sd < (SCATTER[0], *SCATTER)).all()


@pytest.mark.slow
def test_one_colour_s_lines_that_lie_beside_their_places_are_taken_up_by_the_tape():
    """Not by the camera: a line shifted on every tile is a shift of every tile."""
    views = stood(noisy=False)
    moved = views.edges.row + np.where(views.edges.white, 1.5, 0.0)
    shifted = replace(views, edges=views.edges._replace(row=moved), tape_m=0.01)
    fit = fit_camera(shifted, at_truth(shifted), ["camera_pitch"], NEAR)
    none = fit_camera(replace(shifted, tape_m=0.0), at_truth(shifted), ["camera_pitch"], NEAR)
    assert abs(fit.theta["camera_pitch"] - 19.15) < abs(none.theta["camera_pitch"] - 19.15)
    assert np.abs(fit.state.tape).max() > 0.001


def test_only_named_values_are_fitted_to_the_frames_that_count():
    views = stood({"camera_roll": 4.0}, count=30)
    first = np.arange(30) < 20
    fit = fit_camera(views, at_truth(views), ["camera_roll"], NEAR, first)
    spoilt = replace(views, edges=views.edges._replace(row=views.edges.row + 3.0 * ~first[views.edges.frame]))
    again = fit_camera(spoilt, at_truth(spoilt), ["camera_roll"], NEAR, first)
    np.testing.assert_array_equal(fit.state.tape, again.state.tape)
    assert fit.theta == again.theta
    assert fit.theta != fit_camera(spoilt, at_truth(spoilt), ["camera_roll"], NEAR).theta
    np.testing.assert_array_equal(fit.state.poses[~first], 0.0)

    views = stood({"camera_roll": 4.0}, count=20)
    fit = fit_camera(views, at_truth(views, {"camera_height": 0.11}), ["camera_roll"], NEAR)
    assert {**fit.theta, "camera_roll": 0.0} == {**NEUTRAL, "camera_height": 0.11, "camera_roll": 0.0}

    views = stood(count=20)
    fit = fit_everything(views, OPTICS.mounting, {}, learn_scatter=False)
    assert (fit.views.position_m, fit.views.heading_rad) == (views.position_m, views.heading_rad)


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_values_end_at_their_bounds_and_not_beyond(way):
    views = stood({"camera_roll": 9.9}, count=20)
    turned = replace(views, tracks=replace(views.tracks, poses=views.tracks.poses - (0.0, 0.0, 0.35 * way)))
    fit = fit_camera(turned, at_truth(turned), ["camera_yaw", "camera_roll"], (*FAR, *FAR))
    for name, value in fit.theta.items():
        parameter = OPTICS.robot.catalogue.parameters[name]
        assert parameter.low <= value <= parameter.high
    assert fit.theta["camera_yaw"] == 15.0 * way


def test_a_fit_with_eliminated_poses_is_the_full_one():
    """The dense problem of 2 common columns and the 3 poses of 5 frames, one of which shows nothing."""
    random, frames, rows = np.random.default_rng(4), 5, 60
    frame = np.sort(random.choice([0, 1, 3, 4], rows))
    columns, poses, residual = random.normal(size=(rows, 2)), random.normal(size=(rows, 3)), random.normal(size=rows)
    weight, scatter = random.uniform(0.1, 1.0, rows), np.array((0.5, 0.7, 1.5))
    corrections = random.normal(size=(frames, 3))
    problem = Normal(columns, poses, residual, weight)
    matrix, right, inverse, coupling, own = problem.marginal(frame, corrections, scatter)
    dense = np.zeros((rows, 2 + 3 * frames))
    dense[:, :2] = columns
    for row, number in enumerate(frame):
        dense[row, 2 + 3 * number : 5 + 3 * number] = poses[row]
    prior = np.concatenate((np.zeros(2), np.tile(scatter**-2.0, frames)))
    full = dense.T @ (dense * weight[:, None]) + np.diag(prior)
    pull = dense.T @ (weight * residual) + prior * np.concatenate((np.zeros(2), corrections.ravel()))
    step, covariance = -np.linalg.solve(full, pull), np.linalg.inv(full)
    common = -np.linalg.solve(matrix, right)
    np.testing.assert_allclose(common, step[:2], rtol=1e-9)
    np.testing.assert_allclose((-own - coupling @ common).ravel(), step[2:], rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(np.linalg.inv(matrix), covariance[:2, :2], rtol=1e-9)
    np.testing.assert_allclose(np.linalg.inv(inverse[2]), np.diag(scatter**-2.0))


@pytest.mark.slow
@pytest.mark.parametrize(("place", "turn"), [(0.002, 0.3), (0.008, 1.5)])
def test_a_scatter_that_nobody_states_is_learnt(place, turn):
    poses, truth = lane_poses(50), (place, np.radians(turn))
    views = views_of(pictures({}, poses), still(tracked(poses, scatter=truth)), (0.005, np.radians(1.0)))
    fit = fit_everything(views, OPTICS.mounting, {}, learn_scatter=True)
    assert pose_scatter(fit) == pytest.approx(truth, rel=0.6)
    assert (fit.views.position_m, fit.views.heading_rad) == pytest.approx(truth, rel=1.0)
