"""A car drives as its figures and effects say, on both plants; what does not go with a car is refused in a line."""

import tomllib

import numpy as np
import pytest
from one_line import complaint_of

from proxytune.domain import make_episode
from proxytune.driving import BulletPlant, drivetrain, has_pybullet, lane_following, read_robot, shipped_map
from proxytune.driving.agents import AGENTS, AtTheWheel, throttle_and_steering
from proxytune.driving.episode import driving_score
from proxytune.driving.expert import lesson_driver
from proxytune.driving.lane import lane_pose
from proxytune.driving.plants import PlanarPlant, check_body
from proxytune.driving.road import Arc
from proxytune.driving.robot import catalogue_of, read_model_of
from proxytune.effects import Catalogue, FilterContext, effects_from, parameter_hint
from proxytune.errors import SettingsError
from proxytune.files import shipped
from proxytune.settings import Section

CAR, DART = read_robot("car"), read_robot("dart")


def family(folder, **domain):
    keys = {"robot": "car", "plant": "planar", "map": "car_loop", "seconds": 10.0, **domain}
    return lane_following(Section(folder / "study.toml", "domain.", keys), model=None)


def twists(robot, commands, rate_hz=60.0, **theta):
    values = {name.replace("__", "."): value for name, value in theta.items()}
    train = drivetrain(robot, effects_from(values, robot.figures, robot.catalogue))
    commands = np.asarray(commands, dtype=float)
    return train.apply(commands, train.begin(FilterContext(rate_hz, np.zeros(2), robot.figures)))[0]


def held(throttle, steering, ticks=300):
    return np.tile((throttle, steering), (ticks, 1))


def test_a_car_drives_as_its_figures_say_and_its_loop_bends_one_and_a_half_times_as_wide():
    np.testing.assert_allclose(twists(CAR, held(1.0, 0.0))[-1], (3.0, 0.0, 0.0))
    forward, _, yaw = twists(CAR, held(0.5, 1.0))[-1]
    assert forward / yaw == pytest.approx(CAR.least_radius)
    assert CAR.least_radius == pytest.approx(0.33 / np.tan(np.radians(24.0)))
    assert twists(CAR, held(-0.5, 1.0))[-1, 2] == pytest.approx(-yaw)
    assert twists(DART, held(-1.0, 0.3))[-1, 0] == 0.0
    assert twists(CAR, held(-1.0, 0.3))[-1, 0] == -3.0
    road, small = shipped_map("car_loop"), shipped_map("small_loop")
    assert min(arc.radius for arc in road.segments if isinstance(arc, Arc)) - road.lane_offset >= 1.5 * CAR.least_radius
    scale = CAR.figures["lane_width"] / small.lane_width
    for one, other in ((road.width, small.width), (road.lane_offset, small.lane_offset),
                       (road.paint.white_width, small.paint.white_width)):  # fmt: skip
        assert one == pytest.approx(scale * other, rel=1e-3)
    assert len(road.starts) == 10
    poses = np.array(road.starts)
    ways = lane_pose(road, poses[:, :2], np.radians(poses[:, 2])).counter_clockwise
    assert {bool(way) for way in ways} == {True, False}


@pytest.mark.skipif(not has_pybullet(), reason="PyBullet is not installed")
@pytest.mark.parametrize("command", [(0.3, 0.0), (0.3, 0.6), (-0.2, -0.5)])
def test_bullet_drives_a_car_as_the_planar_plant_does(command):
    check_body(CAR)
    asked, start = twists(CAR, held(*command, 180), motor_lag=0.2), np.array((0.3, -0.2, 0.5))
    with BulletPlant(CAR, start, 1 / 60) as plant, PlanarPlant(start, 1 / 60) as plain:
        (poses, hit), (expected, _) = plant.move(asked), plain.move(asked)
    assert not hit
    assert np.hypot(*(poses[-1] - expected[-1])[:2]) < 0.05
    assert poses[-1, 2] == pytest.approx(expected[-1, 2], abs=0.03)


def test_the_same_effect_bends_throttle_or_steering_with_a_delay_on_top_and_a_curve_of_its_own():
    drive = held(0.5, 0.5)
    plain = twists(DART, drive)[-1]
    assert twists(DART, drive, dead_band=0.1)[-1, 0] == pytest.approx(plain[0] * 0.8)
    both = twists(DART, drive, steering_dead_band=0.1)[-1]
    assert both[0] == plain[0]
    assert np.arctan(both[2] / both[0] * 0.1735) == pytest.approx(np.radians(25.0) * 0.4)
    step = twists(DART, drive, steering_lag=0.1, motor_lag=0.2)
    reached = 1.0 - np.exp(-0.1 * np.arange(1, 31) / 6.0 / 0.1)
    angle = np.arctan(step[:30, 2] / step[:30, 0] * 0.1735) / np.radians(25.0) / 0.5
    assert np.abs(angle - reached).max() < 0.1
    assert step[11, 0] == pytest.approx(plain[0] * (1.0 - np.exp(-1.0)), rel=0.05)
    moved = twists(CAR, held(0.2, 1.0), delay=0.1, steering_delay=0.2)
    assert np.flatnonzero(moved[:, 0])[0] == 6
    assert np.flatnonzero(moved[:, 2])[0] == 18
    theta = {"steering_curve__left": 20.0, "steering_curve__right": 30.0, "steering_curve__left_bend": 1.4}
    for steering, angle in ((1.0, 20.0), (-1.0, -30.0), (0.5, 20.0 * np.tanh(0.7) / np.tanh(1.4)), (-0.5, -15.0)):
        forward, _, yaw = twists(DART, held(0.5, steering), **theta)[-1]
        assert np.degrees(np.arctan(yaw / forward * 0.1735)) == pytest.approx(angle)


def test_a_car_with_mass_does_what_its_equation_says_and_slides_beyond_its_tyres():
    theta = {"rolling__inertia": 0.35, "rolling__freewheel": 1.0, "rolling__friction": 0.74, "rolling__drag": 0.2}
    throttle = np.repeat((0.0, 0.4, 0.1, 0.0), 200)
    moved = twists(DART, np.stack((throttle, 0.0 * throttle), axis=1), rate_hz=60.0, **theta)[:, 0] / 4.5
    speed, steps = 0.0, []
    for u in np.repeat(throttle, 40):
        push = (u - u * speed) / 0.35 - 0.2 * speed - 0.74 / 4.5 * (speed > 0.0 or u > 0.35 * 0.74 / 4.5)
        speed = max(0.0, speed + push / 2400.0)
        steps.append(speed)
    np.testing.assert_allclose(moved, np.mean(np.reshape(steps, (-1, 40)), axis=1), atol=2e-3)
    assert moved[-1] == 0.0

    forward, sideways, yaw = twists(CAR, held(1.0, 1.0), tyres__slide=0.25, tyres__rear_slip=0.01)[-1]
    assert forward * yaw == pytest.approx(4.0 * np.tanh(3.0**2 / CAR.least_radius * 0.25))
    assert sideways == pytest.approx(-0.01 * forward * forward * yaw)


def test_a_map_too_tight_for_the_car_and_an_effect_of_another_drive_are_refused_in_a_line(tmp_path, write_file):
    with pytest.raises(SettingsError, match=r"small_loop bend at 0\.16 m, robot 'car' turns at 0\.74 m or more"):
        family(tmp_path, map="small_loop")
    told = complaint_of(effects_from, {"trim": 0.1}, CAR.figures, CAR.catalogue)
    assert 'only a robot with drive = "differential" has it, this one is "ackermann"' in told
    told = complaint_of(effects_from, {"dead_band.width": 0.1}, CAR.figures, CAR.catalogue)
    assert "did you mean 'dead_band'" in told

    with pytest.raises(SettingsError, match='only a robot with drive = "ackermann" has it'):
        effects_from({"steering_offset": 0.1}, read_robot("duckiebot").figures)
    model = write_file('format = 1\nrobot = "duckiebot"\n[effects.steering_offset]\noffset = 0.1\n', "model.toml")
    with pytest.raises(SettingsError, match=r"effects.steering_offset: no such effect; only a robot with drive"):
        read_model_of(model, tmp_path)
    model.write_text(model.read_text(encoding="utf-8").replace("duckiebot", "car"), encoding="utf-8")
    assert read_model_of(model, tmp_path).theta == {"steering_offset": 0.1}
    assert catalogue_of("car", tmp_path) == Catalogue(tmp_path, drive="ackermann")

    assert parameter_hint("trim", family(tmp_path).parameters).startswith('only a robot with drive = "differential"')
    assert parameter_hint("steering_ofset", family(tmp_path).parameters) == "did you mean 'steering_offset'?"


@pytest.mark.slow
@pytest.mark.parametrize("agent", ["steady", "wary"])
def test_our_agents_keep_a_car_in_its_lane_and_repeat_themselves(tmp_path, agent):
    one, again = (family(tmp_path).record(make_episode({}, agent=agent, start=1, seed=3)) for _ in range(2))
    assert one.metrics["time_out_of_lane"] == 0.0
    assert one.metrics["survival_time"] == pytest.approx(10.0)
    assert one.metrics["distance"] > 3.0
    assert list(one.commands) == ["time", "throttle", "steering"]
    for name, column in one.poses.items():
        np.testing.assert_array_equal(column, again.poses[name])


def test_the_agent_at_the_wheel_asks_for_the_curvature_that_it_wants_of_two_wheels():
    _, scale, memory = AtTheWheel(AGENTS["steady"]).begin(CAR)
    assert scale == pytest.approx(2.25)
    assert memory.full_speed == pytest.approx(3.0 / 2.25)
    assert throttle_and_steering(CAR, 0.6, 1.0 / CAR.least_radius) == pytest.approx((0.2, 1.0))
    assert throttle_and_steering(CAR, 9.0, -9.0) == (1.0, -1.0)


@pytest.mark.slow
def test_the_expert_keeps_all_wheels_of_a_car_in_its_lane(tmp_path):
    domain = family(tmp_path)
    sample, steps = domain.demonstrate(make_episode({}, agent="-", start=2, seed=1), 6.0)
    assert len(sample.commands) == steps == 120
    assert np.abs(sample.commands).max() <= 1.0
    assert lesson_driver(domain.map, CAR, 1, None).begin(CAR).robot.drive == "ackermann"
    rows = np.array([domain.map.starts[0]] * 60) * (1.0, 1.0, np.pi / 180.0)
    whole = driving_score(domain.map, rows, wheel_distance=CAR.wheel_distance(), tick_s=0.1, seconds=6.0)
    assert whole == pytest.approx(5.9)


BAD = {
    "no wheelbase": ("wheelbase =", "wheelbases =", "figures.wheelbase"),
    "two wheels' figures": ('drive = "ackermann"', "", "drive = "),
    "another drive": ('"ackermann"', '"ackerman"', "drive: unknown value 'ackerman'"),
    "wheels that turn too far": ("value = 25.0", "value = 85.0", "wheel_angle.value: must be"),
}


@pytest.mark.parametrize(("before", "after", "says"), BAD.values(), ids=BAD)
def test_a_mistake_in_a_car_s_robot_toml_is_one_line(tmp_path, before, after, says):
    text = (shipped("robots") / "dart" / "robot.toml").read_text(encoding="utf-8")
    assert before in text
    text = text.replace(before, after).replace('name = "dart"', 'name = "mine"')
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "robot.toml").write_text(text, encoding="utf-8")
    assert says in complaint_of(read_robot, "mine", tmp_path)
    assert tomllib.loads(text)


def test_a_body_whose_front_wheels_do_not_steer_is_refused_in_a_line(tmp_path):
    for file in ("robot.toml", "car.urdf"):
        text = (shipped("robots") / "car" / file).read_text(encoding="utf-8").replace('name = "car"', 'name = "mine"')
        (tmp_path / "mine").mkdir(exist_ok=True)
        (tmp_path / "mine" / file).write_text(text.replace("steer_left", "turn_left"), encoding="utf-8")
    with pytest.raises(SettingsError, match="has no joint steer_left; the front wheels of a car hang on two revolute"):
        check_body(read_robot("mine", tmp_path))
