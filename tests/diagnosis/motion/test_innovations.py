"""The whitener is the factor of the errors' covariance, and a model's increments walk as the planar plant does."""

from dataclasses import replace

import numpy as np
import pytest
from planted import NOISE, TRUTH, planted_drives

from proxytune.diagnosis import HUBER, disturbed_increments, increments, wheel_speeds
from proxytune.diagnosis.motion import innovations
from proxytune.diagnosis.motion.drives import relative
from proxytune.diagnosis.motion.innovations import Noise, fit_noise, integrate_twists, paths, whitener, window_paths
from proxytune.driving.plants import integrate


@pytest.fixture(scope="module")
def drives():
    return planted_drives({}, episodes=3, seconds=20.0, noise=None)


@pytest.fixture(scope="module")
def few(drives):
    """Twelve increments of two episodes, one of them apart."""
    places = np.flatnonzero(drives.travel[:, 0] > 0.005)
    first, second = places[places < 300][40:47], places[places > 500][30:36]
    chosen = np.zeros(len(drives.episode), dtype=bool)
    chosen[[*first[:4], *first[5:], *second]] = True
    return drives.only(chosen)


def dense(drives, noise):
    """The covariance by definition: Jacobians of the increments in the noise of every pose, and drive noise."""
    count = len(drives.episode)
    sample = np.cumsum(~drives.linked) + np.arange(count) - 1
    ends = np.stack((sample, sample + 1), axis=1)
    poses = np.zeros((ends.max() + 1, 3))
    poses[ends[:, 0]], poses[ends[:, 1]] = drives.poses[:, 0], drives.poses[:, 1]
    jacobian = np.zeros((3 * count, poses.size))
    for column in range(poses.size):
        moved = np.zeros(poses.size)
        moved[column] = 1e-6
        there, back = (
            relative(poses[ends[:, 0]] + step[ends[:, 0]], poses[ends[:, 1]] + step[ends[:, 1]])
            for step in (moved.reshape(-1, 3), -moved.reshape(-1, 3))
        )
        jacobian[:, column] = (there - back).ravel() / 2e-6
    white = np.tile(np.square((noise.pose[0], noise.pose[0], noise.pose[1])), len(poses))
    way = drives.travel[:, 0] + innovations.TURN_WEIGHT * drives.travel[:, 1]
    drive = np.square(noise.drive) * way[:, None] + innovations.JITTER
    return jacobian @ np.diag(white) @ jacobian.T + np.diag(drive.ravel())


def factor(whiten, size):
    return np.stack([whiten.colour(unit).ravel() for unit in np.eye(size)], axis=1)


@pytest.mark.parametrize("noise", [NOISE, Noise((0.1, 0.02, 0.5), (0.02, 0.1))])
def test_the_banded_covariance_is_that_of_noisy_poses_and_noisy_driving(few, noise):
    lower = factor(whitener(few, noise), 3 * len(few.episode))
    wanted = dense(few, noise)
    np.testing.assert_allclose(lower @ lower.T, wanted, atol=1e-7 * np.abs(wanted).max())
    assert np.abs(wanted[3:6, :3]).max() > 0.1 * noise.pose[0] ** 2


def test_innovations_of_a_right_model_are_white_gaussian_and_outliers_count_linearly(few):
    whiten, covariance = whitener(few, NOISE), dense(few, NOISE)
    errors = 0.3 * whiten.colour(np.random.default_rng(2).standard_normal(3 * len(few.episode)))
    flat = errors.ravel()
    wanted = -0.5 * flat @ np.linalg.solve(covariance, flat) - 0.5 * np.linalg.slogdet(covariance)[1]
    assert innovations.log_likelihood(errors, whiten) == pytest.approx(wanted, rel=1e-5)

    drives = planted_drives({"trim": 0.03}, episodes=6, seconds=20.0)
    z = whitener(drives, NOISE).whiten(drives.measured - increments(drives, {"trim": 0.03})).reshape(-1, 3)
    np.testing.assert_allclose(z.std(axis=0), 1.0, atol=0.1)
    assert np.abs(np.mean(z[1:] * z[:-1], axis=0)).max() < 0.08

    z = np.linspace(-8.0, 8.0, 1601)
    slope = np.gradient(innovations.huber(z), z)
    np.testing.assert_allclose(slope[1:-1], innovations.clip_outliers(z)[1:-1], atol=0.01)
    assert np.diff(innovations.huber(np.array([HUBER, 5.0, 6.0, 7.0])))[1:].tolist() == [HUBER, HUBER]


@pytest.mark.parametrize(
    ("drive", "pose"), [((0.03, 0.015, 0.2), (0.003, 0.008)), ((0.01, 0.02, 0.05), (0.0015, 0.004))]
)
@pytest.mark.parametrize("start", [innovations.FIRST_GUESS, Noise((0.2, 0.1, 0.8), (0.02, 0.05))])
def test_planted_noise_is_found_again_from_a_start_ten_times_too_large_as_well(drives, drive, pose, start):
    z = np.random.default_rng(3).standard_normal(3 * len(drives.episode))
    found = fit_noise(drives, whitener(drives, Noise(drive, pose)).colour(z), start)
    np.testing.assert_allclose(found.drive, drive, rtol=0.25)
    np.testing.assert_allclose(found.pose, pose, rtol=0.1)


RICH = {
    **TRUTH,
    "motor_lag.time_constant": 0.3,
    "dead_band.width": 0.05,
    "turn_slip": 0.05,
    "lateral_slip": 0.03,
    "command_quantisation": 0.1,
    "marker_offset.forward": 0.02,
    "heading_offset": 2.0,
}


@pytest.fixture(scope="module")
def replayed():
    return planted_drives(TRUTH, episodes=3, seconds=8.0, noise=None)


BODIES = {
    "inertia": {"inertia.forward": 0.2, "inertia.turn": 0.3, "inertia.linear": 1.5, "inertia.square": 1.0},
    "inertia with slip": {"inertia.turn": 0.3, "inertia.linear": -1.0, "turn_slip": 0.05, "lateral_slip": 0.03},
    "lag with scrub": {"yaw_lag": 0.4, "yaw_scrub": 0.2, "understeer": 0.5, "turn_slip": 0.05},
}


@pytest.mark.parametrize(
    "theta",
    [TRUTH, RICH, *({**TRUTH, **body} for body in BODIES.values())],
    ids=["declared", "rich", *BODIES],
)
def test_increments_are_differences_of_paths_of_which_windows_at_the_start_or_amid_them_are_parts(replayed, theta):
    walked = paths(replayed, theta)
    assert walked.shape == (3, replayed.duties.shape[1] + 1, 3)
    for index in (0, 7, 40, len(replayed.episode) - 1):
        episode, first, last = (int(row[index]) for row in (replayed.episode, replayed.first, replayed.last))
        step = relative(walked[episode, first], walked[episode, last])
        np.testing.assert_array_equal(increments(replayed, theta)[index], step)
    np.testing.assert_array_equal(increments(replayed, theta), innovations.increments_along(replayed, walked))
    begins = np.unique(replayed.episode, return_index=True)[1]
    assert replayed.first[begins].tolist() == [0, 0, 0]
    walked = window_paths(replayed, theta, begins, 300)
    np.testing.assert_allclose(walked, paths(replayed, theta)[replayed.episode[begins], :301], atol=1e-9)
    walked = window_paths(replayed, theta, np.array([50]), 60)[0]
    whole = paths(replayed, theta)[replayed.episode[50], replayed.first[50] : replayed.first[50] + 61]
    np.testing.assert_allclose(relative(walked[0], walked), relative(whole[0], whole), atol=1e-9)


def test_motion_is_replayed_as_driven_with_what_is_added_and_windows_go_on_with_the_last_command(replayed):
    np.testing.assert_allclose(increments(replayed, TRUTH), replayed.measured, atol=1e-9)
    extra = np.zeros((*replayed.duties.shape[:2], 3))
    np.testing.assert_allclose(disturbed_increments(replayed, TRUTH, extra), increments(replayed, TRUTH), atol=1e-12)
    extra[..., 2] = 0.6
    turned = disturbed_increments(replayed, TRUTH, extra)[:, 2] - increments(replayed, TRUTH)[:, 2]
    np.testing.assert_allclose(turned, 0.6 * (replayed.last - replayed.first) / 60.0, atol=1e-9)
    arrived, late = (innovations.arrived_commands(replayed, theta) for theta in (RICH, {"delay": 0.2}))
    assert wheel_speeds(replayed, RICH).shape == arrived.shape == replayed.duties.shape
    np.testing.assert_allclose(late[:, 12:], replayed.duties[:, :-12], atol=1e-9)
    walked = window_paths(replayed, TRUTH, np.array([np.flatnonzero(replayed.episode == 0)[-1]]), 200)
    steps = np.diff(walked[0], axis=0)
    np.testing.assert_allclose(np.hypot(*steps[-1, :2]), np.hypot(*steps[-50, :2]), rtol=0.2)
    assert np.isfinite(walked).all()
    poses = replayed.poses.copy()
    poses[60:] += 5.0
    sloped = {**TRUTH, "floor_slope.x": 0.05}
    moved, plain = (window_paths(e, sloped, np.array([50]), 90) for e in (replace(replayed, poses=poses), replayed))
    np.testing.assert_array_equal(moved, plain)


def test_windows_start_from_measured_wheel_speeds_where_there_are_any_and_are_told_where_they_point(replayed):
    turning = replace(replayed, wheels=np.ones_like(replayed.duties))
    begin = np.array([50])
    moved = [window_paths(one, TRUTH, begin, 1)[0, 1, 0] for one in (replayed, turning)]
    assert moved[1] > moved[0]
    assert moved[1] == pytest.approx(0.6 / 60.0, rel=0.1)
    theta = {**TRUTH, "floor_slope.x": 0.05, "floor_slope.y": 0.02}
    begin = np.flatnonzero(replayed.first % 60 == 0)[2:9]
    assert len(begin) != len(replayed.duties)
    measured = replace(replayed, wheels=wheel_speeds(replayed, theta))
    plain, known = (window_paths(one, theta, begin, 60) for one in (replayed, measured))
    np.testing.assert_allclose(known, plain, atol=0.02)
    assert np.abs(window_paths(measured, TRUTH, begin, 60) - known).max() > 0.02


@pytest.mark.parametrize("body", [{"inertia.forward": 0.5, "inertia.turn": 0.5}, {"yaw_lag": 0.8}])
def test_the_body_of_a_robot_that_is_met_in_motion_moves_as_its_wheels_ask_from_the_first_tick_on(replayed, body):
    held = np.broadcast_to((0.3, 0.5), replayed.duties.shape)
    met = replace(replayed, duties=held.copy(), rest=held[:, 0].copy())
    moved = innovations.twists_of(met, body)
    np.testing.assert_allclose(moved, np.broadcast_to(moved[:, -1:], moved.shape), atol=1e-9)
    assert (moved[..., 2] > 0.2).all()
    stood = innovations.twists_of(replace(met, rest=np.zeros_like(met.rest)), body)
    assert (stood[:, 0, 2] < 0.1).all()


@pytest.mark.parametrize("effect", ["battery_sag.fade", "thermal_fade.loss", "backlash.gap"])
def test_a_window_from_measured_wheel_speeds_recalls_what_its_drive_did_to_battery_motors_and_gears(effect):
    theta = {"thermal_fade.time_constant": 5.0, effect: 0.4}
    drives = planted_drives({}, episodes=2, seconds=30.0, noise=None)
    begin = np.flatnonzero((drives.first % 300 == 0) & (drives.first > 0))
    measured = replace(drives, wheels=wheel_speeds(drives, theta))
    plain, known = (window_paths(one, theta, begin, 120) for one in (drives, measured))
    np.testing.assert_allclose(known, plain, atol=0.01)


def test_what_models_share_is_kept_what_differs_is_not_and_learnt_commands_are_replayed_each(replayed, drives):
    kept = {"delay": 0.05, "trim": 0.05, "motor_lag.time_constant": 0.2}
    thetas = [kept, {**kept, "delay": 0.1}, {**kept, "trim": -0.05}, {**kept, "yaw_lag": 0.2}, kept]
    found = [(increments(replayed, theta), wheel_speeds(replayed, theta)) for theta in thetas]
    for theta, (moved, wheels) in zip(thetas, found, strict=True):
        np.testing.assert_array_equal(moved, increments(replace(replayed), theta))
        np.testing.assert_array_equal(wheels, wheel_speeds(replace(replayed), theta))
    assert found[3][1] is found[0][1]
    with pytest.raises(ValueError, match="read-only"):
        found[0][1][:] = 0.0
    seen = {f"learnt.range.{of}@{end}": by for of in ("forward", "yaw") for end, by in (("low", -9.0), ("high", 9.0))}
    weak, strong = ({**TRUTH, **seen, "learnt.duty.duty@1.0": weight} for weight in (-0.1, -0.3))
    first, second = (wheel_speeds(drives, theta) for theta in (weak, strong))
    np.testing.assert_allclose(second - first, 2.0 * (first - wheel_speeds(drives, TRUTH)), atol=1e-9)
    assert np.abs(second - first).max() > 0.01


@pytest.mark.parametrize(
    ("theta", "late"),
    [
        ({}, 0.0),
        ({"delay_jitter": 0.1}, 0.05),
        ({"dropped_commands": 0.2}, 0.25 / 20.0),
        ({"dropped_commands": 0.5, "delay_jitter": 0.02}, 1.0 / 20.0 + 0.01),
    ],
)
def test_random_effects_make_commands_late_by_their_mean(theta, late):
    assert innovations.lateness(theta, 20.0) == pytest.approx(late)
    calm = innovations.expected_theta({"trim": 0.02, "delay": 0.1, **theta}, 20.0)
    assert calm == pytest.approx({"trim": 0.02, "delay": 0.1 + late})


def test_random_effects_are_late_by_their_mean_beside_a_declared_delay():
    drawn = planted_drives({**TRUTH, "dropped_commands": 0.3}, episodes=6, seconds=30.0, noise=None)

    def strays(delay):
        return np.square(drawn.measured - increments(drawn, {"trim": TRUTH["trim"], "delay": delay}))[:, 0].sum()

    best = min(np.arange(0.1, 0.18, 0.004), key=strays)
    assert best == pytest.approx(TRUTH["delay"] + innovations.lateness({"dropped_commands": 0.3}, 20.0), abs=0.012)
    assert innovations.expected_theta({"delay_jitter": 0.1}, 20.0) == {"delay": 0.05}


TICK_S = 1.0 / 60.0


@pytest.mark.parametrize("turn", [0.0, 1e-9, 3.0, 150.0])
@pytest.mark.parametrize("sideways", [0.0, 0.3])
def test_the_poses_are_those_of_the_planar_plant(turn, sideways):
    """Of three drives of 400 ticks, straight ahead for a while, and standing at last."""
    asked = np.random.default_rng(1).standard_normal((3, 400, 3)) * (0.5, sideways, turn)
    asked[:, 100:150, 2], asked[:, -50:] = 0.0, 0.0
    walked = integrate_twists(asked, TICK_S)
    np.testing.assert_allclose(walked[:, 1:], integrate(np.zeros((3, 3)), asked, TICK_S), rtol=0.0, atol=1e-12)
