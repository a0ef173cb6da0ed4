"""An episode is the same for the same seed, drives as the reference model says, is scored, and fails loudly."""

import dataclasses
import functools
import math
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of

from proxytune.domain import make_episode
from proxytune.driving import METRICS, TICK_HZ, BulletPlant, LaneFollowing, bullet as worlds, lane_following, read_robot
from proxytune.driving.episode import driving_score, score_trajectory, start_pose
from proxytune.driving.lane import lane_length, off_map
from proxytune.driving.maps import shipped_map
from proxytune.driving.plants import PlanarPlant, drivetrain, integrate
from proxytune.effects import CATALOGUE, PARAMETERS, FilterContext, Stage, effects_from, theta_names
from proxytune.errors import EpisodeError, SettingsError
from proxytune.settings import Section


def family(folder, *, model=None, **domain) -> LaneFollowing:
    return lane_following(Section(folder / "study.toml", "domain.", {"seconds": 3.0, **domain}), model=model)


def poses(domain, agent="brisk", start=1, seed=5, **theta):
    return domain.drive(make_episode(theta, agent=agent, start=start, seed=seed)).poses


BAD_AGENTS = """
import itertools

import numpy as np
class Bad:
    def __init__(self, answer): self.answer = answer
    def begin(self, robot): return 0
    def act(self, picture, memory):
        if memory < 10: return (0.2, 0.2), memory + 1
        if isinstance(self.answer, Exception): raise self.answer
        return self.answer, memory
raises = Bad(ValueError("lost"))
nan = Bad((float("nan"), 0.1))
three = Bad((0.1, 0.1, 0.1))
word = Bad("left")
class NoBeginning(Bad):
    def begin(self, robot): raise RuntimeError("no map")
beginner = NoBeginning(0)
straight = Bad((1.0, 1.0))
"""


@pytest.mark.parametrize("plant", ["bullet", "planar"])
@pytest.mark.parametrize("camera", ["ground_plane", pytest.param("renderer", marks=pytest.mark.slow)])
def test_the_same_episode_gives_the_same_trajectory_to_the_last_bit(tmp_path, plant, camera):
    domain = family(tmp_path, plant=plant, camera=camera, seconds=1.5)
    np.testing.assert_array_equal(poses(domain), poses(domain))


def test_another_seed_puts_the_robot_down_elsewhere_and_it_drives_until_its_time_or_the_map_ends(tmp_path):
    first, second = (poses(family(tmp_path, plant="planar"), seed=seed) for seed in (1, 2))
    assert 0.0 < np.hypot(*(first - second)[0, :2]) < 0.08
    assert len(first) == 3 * TICK_HZ + 1
    (tmp_path / "bad_agents.py").write_text(BAD_AGENTS, encoding="utf-8")
    metrics = family(tmp_path, seconds=20.0).run(make_episode({}, agent="bad_agents:straight", start=1, seed=0))
    assert 1.0 < metrics["survival_time"] < 6.0


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("raises", "raised ValueError at 0.50 s: lost"),
        ("nan", "answered [nan, 0.1] at 0.50 s; duties must be finite"),
        ("three", "answered with shape (3,) at 0.50 s; a command is two duties, left and right, or a car's thro"),
        ("word", "answered with a str at 0.50 s: could not convert string to float: 'left'; a command is two duties"),
        ("beginner", "raised RuntimeError before the first picture: no map"),
    ],
)
def test_a_failing_agents_episode_says_what_happened_and_when(tmp_path, name, says):
    (tmp_path / "bad_agents.py").write_text(BAD_AGENTS, encoding="utf-8")
    with pytest.raises(EpisodeError) as caught:
        poses(family(tmp_path), agent=f"bad_agents:{name}")
    assert str(caught.value).startswith(says)
    assert "\n" not in str(caught.value)


def strongest(theta_name):
    parameter = PARAMETERS[theta_name]
    neutral = parameter.neutral_value(read_robot("duckiebot").figures)
    return max(parameter.probes, key=lambda probe: abs(probe - neutral))


def theta_of(theta_name):
    """Without a value and with it: an imbalance is one of something that is there."""
    effect = theta_name.split(".")[0]
    main = theta_names(CATALOGUE[effect])[0]
    there = {main: strongest(main)} if PARAMETERS[theta_name].shape else {}
    if CATALOGUE[effect].trace and CATALOGUE[effect].trace.placed:
        there |= {f"{effect}.x": 1.58, f"{effect}.y": 0.70, f"{effect}.radius": 0.6}
    weakest_is_felt = effect != "stiction"  # it is below every duty of the agent
    probe = PARAMETERS[theta_name].probes[0] if weakest_is_felt else strongest(theta_name)
    return there, {**there, theta_name: probe}


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """The measured poses of four seconds of an agent under a θ, each driven once."""
    domain = family(tmp_path_factory.mktemp("seen"), plant="planar", seconds=4.0)

    def drive(**theta):
        episode = make_episode(theta, agent="brisk", start=1, seed=5)
        return domain.measured(episode, domain.drive(episode))

    return functools.cache(drive)


OF_REVERSALS = ("stiction.reversal", "reversal_pause.pause", "reversal_pause.stand")
FELT = [n for e in CATALOGUE.values() for n in theta_names(e) if n not in OF_REVERSALS]
"""No agent turns a wheel backwards."""


@pytest.mark.parametrize("theta_name", FELT)
def test_every_effect_of_the_catalogue_moves_an_agents_trajectory_as_it_is_measured(seen, theta_name):
    without, moved = (seen(**theta) for theta in theta_of(theta_name))
    shared = min(len(without), len(moved))
    assert np.abs(without[:shared] - moved[:shared]).max() > 1e-3


@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_a_marker_moves_the_measured_poses_and_not_the_true_ones(tmp_path, plant):
    domain = family(tmp_path, plant=plant, seconds=1.0)
    episode = make_episode({"marker_offset.forward": 0.1, "heading_offset": 10.0}, agent="brisk", start=1, seed=5)
    driven = domain.drive(episode)
    shift = domain.measured(episode, driven) - driven.poses
    np.testing.assert_array_equal(driven.poses, poses(domain))
    np.testing.assert_allclose(np.hypot(shift[:, 0], shift[:, 1]), 0.1)
    np.testing.assert_allclose(np.arctan2(shift[:, 1], shift[:, 0]), np.angle(np.exp(1j * driven.poses[:, 2])))
    np.testing.assert_allclose(shift[:, 2], np.radians(10.0))


def test_a_slope_is_felt_along_the_first_heading_and_theta_goes_before_effects_of_section_and_model(tmp_path):
    domain = family(tmp_path, plant="planar", seconds=1.0, position_noise_m=0.0, heading_noise_deg=0.0)
    start = poses(domain)[0]
    uphill = {"floor_slope.x": 0.1 * np.cos(start[2]), "floor_slope.y": 0.1 * np.sin(start[2])}
    along = np.array((np.cos(start[2]), np.sin(start[2])))
    level, climbed = ((poses(domain, **theta)[-1] - start)[:2] @ along for theta in ({}, uphill))
    assert 0.05 < level - climbed < 0.1
    domain = family(tmp_path, plant="planar")
    nominal = {"trim": 0, "delay": 0.15, "blur": 0.05, "camera_pitch": 19.15, "wheel_gain.left": 1, "driver_map": 0}
    np.testing.assert_array_equal(poses(domain, **nominal), poses(domain))
    model = tmp_path / "model.toml"
    model.write_text('robot = "duckiebot"\n[effects.trim]\ntrim = 0.1\n[effects.delay]\ndelay = 0.1\n')
    domain = family(tmp_path, model=model, effects={"trim": {"trim": 0.2}})
    train = domain.instance({"delay": 0.0}).drivetrain
    values = {effect.name: effect for chain in (train.command, train.actuation) for effect in chain.effects}
    assert values["trim"].trim == 0.2
    assert values["delay"].delay == 0.0
    assert values["motor_lag"].time_constant == 0.2


def test_what_determines_a_result_determines_the_identity_and_a_model_s_plant_is_not_overruled(tmp_path, write_file):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    same = family(tmp_path / "a").identity
    assert same == family(tmp_path / "b").identity
    assert same != family(tmp_path / "a", plant="planar").identity
    assert same != family(tmp_path / "a", effects={"trim": {"trim": 0.1}}).identity
    (tmp_path / "a" / "mine.py").write_text("x = 1", encoding="utf-8")
    assert same != family(tmp_path / "a").identity
    model = write_file('robot = "duckiebot"\nplant = "planar"\n', "model.toml")
    assert family(tmp_path, model=model).plant == "planar"
    with pytest.raises(SettingsError, match="is 'bullet' but the model says 'planar'"):
        family(tmp_path, model=model, plant="bullet")


@pytest.mark.parametrize(
    ("domain", "says"),
    [
        ({"robott": "x"}, "domain.robott: unknown key; did you mean 'robot'?"),
        ({"robot": "duckybot"}, "domain.robot: unknown value 'duckybot'; did you mean 'duckiebot'?"),
        ({"plant": "bulet"}, "domain.plant: unknown value 'bulet'; did you mean 'bullet'?"),
        ({"camera": "eye"}, "domain.camera: unknown value 'eye'"),
        ({"seconds": 0.0}, "domain.seconds: must be between"),
        ({"position_noise_m": float("nan")}, "domain.position_noise_m: must be finite"),
        ({"effects": {"trim": {"trim": 3.0}}}, "domain.effects.trim.trim: must be between"),
    ],
)
def test_a_mistake_in_the_domain_table_is_one_line(tmp_path, domain, says):
    assert says in complaint_of(lambda: family(tmp_path, **domain))


@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_replaying_an_agents_commands_repeats_its_drive(tmp_path, plant):
    domain = family(tmp_path, plant=plant)
    episode = make_episode({"trim": 0.1}, agent="brisk", start=2, seed=3)
    driven = domain.drive(episode)
    again = domain.replay(episode, driven.commands)
    np.testing.assert_array_equal(again.poses, driven.poses)
    assert len(again.pictures) == len(driven.commands)


def test_the_same_commands_look_different_through_another_camera(tmp_path):
    domain = family(tmp_path, plant="planar")
    commands = np.full((20, 2), 0.3)
    mounted = (make_episode({"camera_pitch": pitch}, agent="-", start=0, seed=0) for pitch in (15, 25))
    level, steep = (domain.replay(episode, commands) for episode in mounted)
    np.testing.assert_array_equal(level.poses, steep.poses)
    assert np.abs(level.pictures.astype(float) - steep.pictures).mean() > 5.0


LEARNT = """
format = 1
robot = "duckiebot"
[effects.learnt.range]
forward = [-0.6, 0.6]
yaw = [-4, 4]
[effects.learnt.wheel_speed]
knots = [0.2, 0.5]
left = [-0.05, -0.1]
"""


@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_a_proxy_drives_what_its_model_has_learnt(tmp_path, write_file, plant):
    model = write_file(LEARNT, "model.toml")
    plain, learnt = (family(tmp_path, plant=plant, seconds=1.5, model=one) for one in (None, model))
    assert learnt.identity != plain.identity
    assert np.hypot(*(poses(learnt)[-1] - poses(plain)[-1])[:2]) > 0.01


ROBOT = read_robot("duckiebot")
TICK_S = 1 / 60
START = np.array([0.3, -0.2, 0.7])
PLANTS = {"bullet": lambda: BulletPlant(ROBOT, START, TICK_S), "planar": lambda: PlanarPlant(START, TICK_S)}
MOVING = (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION)
ON_THE_MOVE = {name: effect for name, effect in CATALOGUE.items() if effect.stage in MOVING}


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
    context = FilterContext(60.0, np.zeros(2), ROBOT.figures, 3, START[2:], START[None, :2])
    return train.apply(duties, train.begin(context))[0]


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
def test_full_duty_drives_at_0_6_metres_per_second_with_a_time_constant_of_0_2_seconds_within_3_percent(plant):
    speed = speeds(poses_for(plant, held(1, 1)))
    assert speed[-1] == pytest.approx(0.6, rel=0.03)
    gap = np.log(1 - speed[5:40] / speed[-1])
    assert -1 / np.polyfit(np.arange(5, 40) / 60, gap, 1)[0] == pytest.approx(0.2, rel=0.03)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(("left", "right", "yaw"), [(0, 1, 3.75), (1, 0, -3.75)])
def test_one_wheel_at_full_duty_turns_at_3_75_radians_per_second_within_3_percent(plant, left, right, yaw):
    poses = poses_for(plant, held(left, right))
    assert (poses[-1, 2] - poses[-121, 2]) / 2.0 == pytest.approx(yaw, rel=0.03)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(("duty", "trim"), [(1.0, 0.1), (0.3, -0.2)])
def test_trim_curves_the_path_by_12_5_per_metre_within_3_percent(plant, duty, trim):
    last = poses_for(plant, held(duty, duty), trim=trim)[-121:]
    curvature = (last[-1, 2] - last[0, 2]) / (speeds(last).sum() * TICK_S)
    assert curvature == pytest.approx(12.5 * trim, rel=0.03)


def mixed_driving(seed):
    random = np.random.default_rng(seed)
    steps = random.uniform(-0.2, 1.0, (10, 1)) + random.normal(0.0, 0.3, (10, 2))
    return np.repeat(np.clip(steps, -1.0, 1.0), 30, axis=0)


@pytest.mark.parametrize("seed", range(2))
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
    pybullet = pytest.importorskip("pybullet", reason="PyBullet is not installed")

    with robot:
        upside_down = pybullet.getQuaternionFromEuler((np.pi, 0.0, 0.0))
        pybullet.resetBasePositionAndOrientation(robot._body, (0, 0, 0.12), upside_down, physicsClientId=robot._world)
        _, crashed = robot.move(np.zeros((60, 3)))
    assert crashed


def test_planar_integration_is_exact_on_a_circle():
    poses = integrate(np.zeros((2, 3)), np.tile((0.5, 0.0, 1.25), (2, 240, 1)), TICK_S)
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


ROAD = shipped_map("small_loop")
SIDE, TILE, OFFSET, MIDDLE = ROAD.size[0], ROAD.width, ROAD.lane_offset, ROAD.size[0] / 2
OUTER = (SIDE - TILE / 2 + OFFSET, TILE, pi / 2)  # lower end of the right side's straight, going up
INNER = (SIDE - TILE / 2 - OFFSET, 2 * TILE, -pi / 2)  # its upper end, going down


def lap(outer, left=0.0):
    """Pieces of a lap so far left of a lane's centre line [m]."""
    radius = TILE / 2 + OFFSET - left if outer else TILE / 2 - OFFSET + left
    return ((TILE, 0.0), (radius * pi / 2, (1 if outer else -1) / radius)) * 4


OUTER_LAP = lap(True)
both_lanes = pytest.mark.parametrize(("start", "outer"), [(OUTER, True), (INNER, False)], ids=("outer", "inner"))
SPEED = 0.3
quick = settings(max_examples=30)


def drive(start, pieces, rate=60.0):
    """Poses at SPEED over pieces of (length [m], curvature [1/m]), backwards where the length is negative."""
    poses = [np.array(start)[None]]
    for length, curvature in pieces:
        x, y, heading = poses[-1][-1]
        way = np.linspace(0, length, max(1, round(abs(length) / SPEED * rate)) + 1)[1:]
        turn = curvature * way
        chord = way * np.sinc(turn / 2 / pi)
        ahead = heading + turn / 2
        poses.append(np.column_stack((x + chord * np.cos(ahead), y + chord * np.sin(ahead), heading + turn)))
    return np.concatenate(poses)


def score(poses, rate=60.0, seconds=60.0):
    return score_trajectory(ROAD, poses, tick_s=1 / rate, seconds=seconds)


def moved_left(pose, left):
    x, y, heading = pose
    return x - left * math.sin(heading), y + left * math.cos(heading), heading


def wandering(seed, samples=400):
    """A smooth drive at random near a start of the map, in and out of lanes."""
    rng = np.random.default_rng(seed)
    x, y, degrees = ROAD.starts[rng.integers(len(ROAD.starts))]
    heading = math.radians(degrees) + np.cumsum(rng.normal(0, 0.12, samples))
    way = rng.uniform(-0.01, 0.03) * np.column_stack((np.cos(heading), np.sin(heading)))
    return np.column_stack(((x, y) + np.cumsum(way, axis=0), heading))


def test_a_drive_is_scored_by_every_metric_and_early_ones_by_its_first_seconds():
    assert list(score(np.tile(OUTER, (2, 1)))) == list(METRICS)
    early = {"early_distance": "m", "early_offset": "m", "speed": "m/s"}
    assert {"distance": "m", "survival_time": "s", "time_out_of_lane": "s", "deviation": "m"} | early == METRICS
    short = drive(moved_left(OUTER, 0.03), [(0.4, 0.0)])
    whole = np.concatenate((short, np.repeat(short[-1:], 60 * 20, axis=0)))
    first = score(whole[: 5 * 60 + 1])
    result = score(whole)
    assert result["early_distance"] == first["distance"] == pytest.approx(0.4)
    assert result["early_offset"] == pytest.approx(0.03)
    assert result["speed"] == pytest.approx(0.4 / (len(whole) - 1) * 60)


@both_lanes
@pytest.mark.parametrize("laps", [1, 3])
@pytest.mark.parametrize("left", [-0.08, 0.0, 0.08])
def test_laps_count_the_centre_lines_length_to_a_millimetre_wherever_in_the_lane(start, outer, laps, left):
    result = score(drive(moved_left(start, left), lap(outer, left) * laps))
    assert result["distance"] == pytest.approx(laps * lane_length(ROAD, outer), abs=0.001)
    assert result["time_out_of_lane"] == 0
    assert result["deviation"] == pytest.approx(abs(left), abs=1e-6)


@both_lanes
def test_the_wrong_way_round_counts_nothing_and_is_out_of_lane_and_backwards_in_it_counts_negative(start, outer):
    wrong = drive(start, lap(outer))[::-1] + (0, 0, pi)
    result = score(wrong)
    assert result["distance"] == 0
    assert result["time_out_of_lane"] == pytest.approx(result["survival_time"])
    assert result["deviation"] == pytest.approx(2 * OFFSET, abs=1e-6)
    result = score(drive(start, [(-length, curvature) for length, curvature in reversed(lap(outer))]))
    assert result["distance"] == pytest.approx(-lane_length(ROAD, outer), abs=0.001)
    assert result["time_out_of_lane"] == 0


def test_a_stopped_robot_survives_until_the_time_limit_and_one_that_ends_at_once_or_leaves_the_map_does_not():
    result = score(np.tile(moved_left(OUTER, 0.05), (3601, 1)))
    assert result == {
        "distance": 0,
        "survival_time": 60,
        "time_out_of_lane": 0,
        "deviation": pytest.approx(0.05),
        "early_distance": 0,
        "early_offset": pytest.approx(0.05),
        "speed": 0,
    }

    result = score(np.array([moved_left(OUTER, 0.05)]))
    nothing = dict.fromkeys(("distance", "survival_time", "time_out_of_lane", "early_distance", "speed"), 0)
    assert result == nothing | {"deviation": pytest.approx(0.05), "early_offset": pytest.approx(0.05)}
    x, y, _ = OUTER
    out = drive((x, y, 0.0), [(3.0, 0.0)])
    first = next(k for k, pose in enumerate(out) if off_map(ROAD, pose[0], pose[1]))
    result = score(out)
    assert result["survival_time"] == pytest.approx(first / 60)
    assert result["survival_time"] == pytest.approx((SIDE - x) / SPEED, abs=1.5 / 60)
    poses = drive(OUTER, OUTER_LAP * 6)
    assert len(poses) > 3601
    assert score(poses) == score(poses[:3601])
    assert score(poses)["survival_time"] == 60


@pytest.mark.parametrize(("rate", "seconds"), [(20.0, 0.3), (30.0, 0.7), (100.0, 1.1), (60.0, 60.0)])
def test_a_survivor_survives_for_the_whole_duration(rate, seconds):
    still = np.tile(OUTER, (round(seconds * rate) + 5, 1))
    assert score(still, rate, seconds)["survival_time"] == pytest.approx(seconds)


def test_a_zig_zag_across_the_lanes_edges_counts_only_what_is_in_it():
    """Ten seconds up the outer lane's right side, a sine aside."""
    y = np.linspace(TILE, 2 * TILE, 601)
    x = OUTER[0] - 0.15 * np.sin((y - TILE) / TILE * 4 * pi)
    result = score(np.column_stack((x, y, np.arctan2(np.gradient(y), np.gradient(x)))))
    inside = 1 - 2 / pi * math.acos(ROAD.lane_width / 2 / 0.15)
    assert result["distance"] == pytest.approx(inside * TILE, abs=0.002)
    assert result["time_out_of_lane"] == pytest.approx((1 - inside) * 10, abs=0.04)
    assert result["deviation"] == pytest.approx(0.15 * 2 / pi, abs=0.001)


@pytest.mark.parametrize("order", [1, -1], ids=("leaving", "entering"))
def test_a_step_across_the_lanes_edge_counts_half(order):
    x, y, heading = OUTER
    poses = np.array([(x + 0.10, y + 0.2, heading), (x + 0.12, y + 0.2 + 0.02 * order, heading)])[::order]
    assert score(poses) == {
        "distance": pytest.approx(0.01),
        "survival_time": pytest.approx(1 / 60),
        "time_out_of_lane": pytest.approx(0.5 / 60),
        "deviation": pytest.approx(0.11),
        "early_distance": pytest.approx(0.01),
        "early_offset": pytest.approx(-0.11),
        "speed": pytest.approx(60 * math.hypot(0.02, 0.02)),
    }


@pytest.mark.parametrize("middle", [0.0, 0.1])
def test_crossing_the_middle_of_the_map_counts_nothing_there(middle):
    way = np.linspace(TILE + 0.01, 2 * TILE - 0.01, 200)
    poses = np.column_stack((way, np.full(200, MIDDLE + middle), np.zeros(200)))
    assert score(poses)["distance"] == 0
    assert score(poses)["time_out_of_lane"] == score(poses)["survival_time"]


@quick
@given(st.integers(0, 10**6), st.floats(0, 1))
def test_the_parts_of_a_drive_add_up(seed, share):
    poses = wandering(seed)
    cut = round(share * round(score(poses)["survival_time"] * 60))
    whole, first, second = score(poses), score(poses[: cut + 1]), score(poses[cut:])
    for metric in ("distance", "survival_time", "time_out_of_lane"):
        assert first[metric] + second[metric] == pytest.approx(whole[metric], abs=1e-9), metric
    areas = [part["deviation"] * part["survival_time"] for part in (first, second, whole)]
    assert areas[0] + areas[1] == pytest.approx(areas[2], abs=1e-9)


@pytest.mark.parametrize(("column", "value"), [(0, math.inf), (2, math.nan)])
def test_a_pose_that_is_not_finite_is_refused_with_its_time(column, value):
    poses = drive(OUTER, OUTER_LAP)
    poses[30:, column] = value
    with pytest.raises(EpisodeError, match=r"not finite at 0\.50 s"):
        score(poses)


WHEELS = 0.1  # between the wheels [m]
BOTH_IN, ONE_OUT, BOTH_OUT = 0.0, ROAD.lane_width / 2 - 0.01, ROAD.lane_width / 2 + 0.052


def worth(poses, rate=60.0, seconds=60.0, wheels=WHEELS):
    return driving_score(ROAD, poses, wheel_distance=wheels, tick_s=1 / rate, seconds=seconds)


@pytest.mark.parametrize("start", [OUTER, INNER], ids=("outer", "inner"))
@pytest.mark.parametrize("side", [-1, 1], ids=("right", "left"))
@pytest.mark.parametrize(("left", "each_second"), [(BOTH_IN, 1.0), (ONE_OUT, 0.0), (BOTH_OUT, -1.0)])
def test_each_second_a_wheel_out_of_the_lane_takes_one_and_both_take_two(start, side, left, each_second):
    poses = drive(moved_left(start, side * left), [(0.5, 0.0)])
    assert worth(poses) == pytest.approx(each_second * 0.5 / SPEED, abs=1e-9)


def test_what_is_in_the_lane_counts_by_where_the_wheels_are():
    x, y, heading = moved_left(OUTER, ONE_OUT)
    askew = np.tile((x, y + 0.2, heading + 1.55), (61, 1))
    assert (worth(askew), worth(np.tile((x, y + 0.2, heading), (61, 1)))) == (pytest.approx(1.0), pytest.approx(0.0))
    wrong = drive(OUTER, OUTER_LAP)[::-1] + (0, 0, pi)
    assert worth(wrong) == pytest.approx(-(len(wrong) - 1) / 60)
    poses = np.array([moved_left(OUTER, BOTH_IN), moved_left(OUTER, BOTH_OUT)])
    assert worth(poses) == pytest.approx(0.0)
    assert worth(poses[[0, 0, 1]]) == pytest.approx(1 / 60)


@pytest.mark.parametrize("judged", [score, worth])
@pytest.mark.parametrize("heading", [0.0, pi / 2, pi, -pi / 2])
def test_what_comes_after_leaving_the_map_counts_nothing(judged, heading):
    out = drive((MIDDLE, MIDDLE, heading), [(1.0, 0.0)])
    gone = next(k for k, pose in enumerate(out) if off_map(ROAD, pose[0], pose[1])) + 1
    assert gone < len(out)
    assert judged(np.vstack((out[:gone], drive(OUTER, OUTER_LAP)))) == judged(out[:gone])


def exact_start(index, **noise):
    return start_pose(ROAD, index, **{"seed": 1, "position_noise_m": 0.0, "heading_noise_deg": 0.0, **noise})


def test_placement_has_the_spread_it_was_given_and_depends_on_seed_and_index_alone():
    for index, (x, y, degrees) in enumerate(ROAD.starts):
        assert exact_start(index) == pytest.approx((x, y, math.radians(degrees)))

    noise = {"position_noise_m": 0.01, "heading_noise_deg": 2.0}
    assert exact_start(3, **noise) == exact_start(3, **noise)
    assert exact_start(3, **noise) != exact_start(3, **noise, seed=2)
    twice = dataclasses.replace(ROAD, starts=ROAD.starts[:1] * 2)
    first, second = (start_pose(twice, index, seed=1, **noise) for index in (0, 1))
    assert all(one != other for one, other in zip(first, second, strict=True))

    noise = {"position_noise_m": 0.02, "heading_noise_deg": 3.0}
    x, y, degrees = ROAD.starts[5]
    errors = np.array([exact_start(5, **noise, seed=seed) for seed in range(500)]) - (x, y, math.radians(degrees))
    assert errors.std(axis=0) == pytest.approx((0.02, 0.02, math.radians(3.0)), rel=0.1)
    assert errors.mean(axis=0) == pytest.approx((0, 0, 0), abs=0.006)
    assert np.corrcoef(errors.T) == pytest.approx(np.eye(3), abs=0.15)
