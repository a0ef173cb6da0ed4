"""Both plants drive as the reference model says, and like each other."""

import numpy as np
import pytest

from proxytune.driving.bullet import worlds
from proxytune.driving.bullet.plant import BulletPlant
from proxytune.driving.drivetrain import drivetrain
from proxytune.driving.planar import PlanarPlant, integrate
from proxytune.driving.robot import read_robot
from proxytune.effects import CATALOGUE, Setting, Stage, effects_from, theta_names

ROBOT = read_robot("duckiebot")
TICK_S = 1 / 60
START = np.array([0.3, -0.2, 0.7])
PLANTS = {
    "bullet": lambda: BulletPlant(ROBOT, START, TICK_S),
    "planar": lambda: PlanarPlant(START, TICK_S),
}
ON_THE_MOVE = {
    name: effect for name, effect in CATALOGUE.items() if effect.stage in (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION)
}


def values_to_agree_on():
    """Each parameter by itself at its last probe but one, and each wheel effect with either wheel the worse."""
    for name, effect in ON_THE_MOVE.items():
        main = effect.parameters[0]
        there = {} if isinstance(main.neutral, str) else {theta_names(effect)[0]: main.probes[len(main.probes) // 2]}
        for theta_name, parameter in zip(theta_names(effect), effect.parameters, strict=True):
            shape = parameter.shape
            for probe in parameter.probes[1:3] if shape else parameter.probes[-2:-1]:
                yield pytest.param(name, {**(there if shape else {}), theta_name: probe}, id=f"{theta_name}={probe}")


def twists_for(duties, **theta):
    train = drivetrain(ROBOT, effects_from({**ROBOT.theta, "delay": 0.0, **theta}, ROBOT.figures))
    return train.apply(duties, train.begin(Setting(60.0, np.zeros(2), ROBOT.figures, 3, START[2:], START[None, :2])))[0]


def poses_for(plant, duties, **theta):
    with PLANTS[plant]() as robot:
        poses, crashed = robot.move(twists_for(duties, **theta))
    assert not crashed
    return np.vstack((START, poses))


def held(left, right, seconds=5.0):
    return np.tile((left, right), (round(seconds * 60), 1))


def speeds(poses):
    return np.hypot(*np.diff(poses[:, :2], axis=0).T) * 60


@pytest.mark.parametrize("plant", PLANTS)
def test_full_duty_drives_at_0_6_metres_per_second_within_3_percent(plant):
    assert speeds(poses_for(plant, held(1, 1)))[-1] == pytest.approx(0.6, rel=0.03)


@pytest.mark.parametrize("plant", PLANTS)
def test_speed_follows_a_step_with_a_time_constant_of_0_2_seconds_within_3_percent(plant):
    speed = speeds(poses_for(plant, held(1, 1)))
    gap = np.log(1 - speed[5:40] / speed[-1])
    assert -1 / np.polyfit(np.arange(5, 40) / 60, gap, 1)[0] == pytest.approx(0.2, rel=0.03)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(("left", "right", "yaw"), [(0, 1, 3.75), (1, 0, -3.75)])
def test_one_wheel_at_full_duty_turns_at_3_75_radians_per_second_within_3_percent(plant, left, right, yaw):
    poses = poses_for(plant, held(left, right))
    assert (poses[-1, 2] - poses[-121, 2]) / 2.0 == pytest.approx(yaw, rel=0.03)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(("duty", "trim"), [(0.5, 0.1), (1.0, 0.1), (0.5, 0.3), (0.3, -0.2), (0.6, -0.05)])
def test_trim_curves_the_path_by_12_5_per_metre_within_3_percent(plant, duty, trim):
    last = poses_for(plant, held(duty, duty), trim=trim)[-121:]
    curvature = (last[-1, 2] - last[0, 2]) / (speeds(last).sum() * TICK_S)
    assert curvature == pytest.approx(12.5 * trim, rel=0.03)


def mixed_driving(seed):
    random = np.random.default_rng(seed)
    steps = random.uniform(-0.2, 1.0, (10, 1)) + random.normal(0.0, 0.3, (10, 2))
    return np.repeat(np.clip(steps, -1.0, 1.0), 30, axis=0)


@pytest.mark.parametrize("seed", range(4))
def test_bullet_and_planar_agree_within_2_cm_and_3_degrees_after_5_seconds_of_mixed_driving(seed):
    apart = poses_for("bullet", mixed_driving(seed))[-1] - poses_for("planar", mixed_driving(seed))[-1]
    assert np.hypot(*apart[:2]) < 0.02
    assert abs(np.degrees(apart[2])) < 3.0


@pytest.mark.slow
@pytest.mark.parametrize(("name", "theta"), list(values_to_agree_on()))
def test_bullet_and_planar_agree_with_every_effect_on_how_the_robot_moves(name, theta):
    """Within 2 cm and 3°; with backlash within 7 cm and 4°.

    A gear that has crossed its gap takes the wheel along at once; a tyre slips until it has caught up.
    """
    metres, degrees = (0.07, 4.0) if name == "backlash" else (0.02, 3.0)
    moved = []
    for duties in (mixed_driving(0), mixed_driving(1)):
        planar = poses_for("planar", duties, **theta)
        apart = poses_for("bullet", duties, **theta)[-1] - planar[-1]
        assert np.hypot(*apart[:2]) < metres
        assert abs(np.degrees(apart[2])) < degrees
        moved.append(np.abs(planar - poses_for("planar", duties)).max())
    assert max(moved) > 0.005


@pytest.mark.parametrize("plant", PLANTS)
def test_the_same_twists_give_the_same_poses_to_the_last_bit(plant):
    np.testing.assert_array_equal(poses_for(plant, held(0.6, 0.4, 1)), poses_for(plant, held(0.6, 0.4, 1)))


@pytest.mark.parametrize("plant", PLANTS)
def test_moving_in_chunks_changes_nothing(plant):
    twists = twists_for(held(0.7, 0.5, 1.0))
    with PLANTS[plant]() as whole, PLANTS[plant]() as cut:
        together, _ = whole.move(twists)
        pieces = np.concatenate([cut.move(twists[i : i + 3])[0] for i in range(0, len(twists), 3)])
    np.testing.assert_allclose(pieces, together, rtol=0, atol=1e-12)


@pytest.mark.parametrize("plant", PLANTS)
def test_sideways_motion_slides_the_body_to_its_left(plant):
    twists = np.tile((0.2, 0.05, 0.0), (120, 1))
    with PLANTS[plant]() as robot:
        end = robot.move(twists)[0][-1]
    across = np.array((-np.sin(START[2]), np.cos(START[2]))) @ (end[:2] - START[:2])
    assert across == pytest.approx(0.1, abs=0.005)


def test_a_robot_on_its_back_has_crashed():
    robot = BulletPlant(ROBOT, START, TICK_S)
    import pybullet

    with robot:
        upside_down = pybullet.getQuaternionFromEuler((np.pi, 0.0, 0.0))
        pybullet.resetBasePositionAndOrientation(robot._body, (0, 0, 0.12), upside_down, physicsClientId=robot._world)
        _, crashed = robot.move(np.zeros((60, 3)))
    assert crashed


def test_planar_integration_is_exact_on_a_circle():
    twists = np.tile((0.5, 0.0, 1.25), (2, 240, 1))
    poses = integrate(np.zeros((2, 3)), twists, TICK_S)
    angle = 1.25 * np.arange(1, 241) * TICK_S
    np.testing.assert_allclose(poses[0, :, 0], 0.4 * np.sin(angle), atol=1e-12)
    np.testing.assert_allclose(poses[1, :, 1], 0.4 * (1 - np.cos(angle)), atol=1e-12)


def test_in_a_world_that_others_have_left_a_robot_drives_to_the_bit_as_in_a_new_one(monkeypatch):
    duties = held(0.6, 0.5, 2.0)
    for twist in ((0.3, 0.2, 2.0), (-0.5, 0.0, -9.0)):  # one slides sideways, one spins
        with BulletPlant(ROBOT, START, TICK_S) as robot:
            robot.move(np.tile(twist, (40, 1)))
    before = len(worlds._empty)
    used = poses_for("bullet", duties)
    assert len(worlds._empty) == before > 0
    monkeypatch.setattr(worlds, "_empty", [])
    np.testing.assert_array_equal(poses_for("bullet", duties), used)


def test_two_robots_at_once_do_not_disturb_each_other():
    alone = poses_for("bullet", held(0.5, 0.6, 1.0))[1:]
    with PLANTS["bullet"]() as one, PLANTS["bullet"]() as two:
        twists = twists_for(held(0.5, 0.6, 1.0))
        both = [(one.move(twists[i : i + 3])[0], two.move(-twists[i : i + 3])[0]) for i in range(0, len(twists), 3)]
    np.testing.assert_array_equal(np.concatenate([first for first, _ in both]), alone)


LEARNT = {
    **{"learnt.range.forward@low": -0.6, "learnt.range.forward@high": 0.6},
    **{"learnt.range.yaw@low": -4.0, "learnt.range.yaw@high": 4.0},
    **{"learnt.turn_rate.yaw@-2.0": 0.4, "learnt.turn_rate.yaw@2.0": -0.4, "learnt.time.left@3.0": -0.2},
}


def test_both_plants_drive_what_was_learnt():
    duties = held(0.3, 0.5, seconds=4.0)
    moved = [np.hypot(*(poses_for(plant, duties, **LEARNT) - poses_for(plant, duties))[-1, :2]) for plant in PLANTS]
    assert min(moved) > 0.05
    bullet, planar = (poses_for(plant, duties, **LEARNT)[-1] for plant in PLANTS)
    np.testing.assert_allclose(bullet, planar, atol=0.04)
