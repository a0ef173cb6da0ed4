"""An episode is the same for the same seed, ends when it should, and fails loudly."""

import itertools

import numpy as np
import pytest

from proxytune.domain import make_episode
from proxytune.driving.episode import TICK_HZ
from proxytune.driving.family import lane_following
from proxytune.driving.lane_following import LaneFollowing
from proxytune.driving.robot import read_robot
from proxytune.effects import CATALOGUE, DECLARED, PARAMETERS, Stage, theta_names
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
circle = Bad((-0.4, 0.4))
straight = Bad((1.0, 1.0))
"""


@pytest.mark.parametrize("plant", ["bullet", "planar"])
@pytest.mark.parametrize("camera", ["ground_plane", pytest.param("renderer", marks=pytest.mark.slow)])
def test_the_same_episode_gives_the_same_trajectory_to_the_last_bit(tmp_path, plant, camera):
    domain = family(tmp_path, plant=plant, camera=camera, seconds=1.5)
    np.testing.assert_array_equal(poses(domain), poses(domain))


def test_another_seed_puts_the_robot_down_elsewhere(tmp_path):
    domain = family(tmp_path, plant="planar")
    first, second = poses(domain, seed=1)[0], poses(domain, seed=2)[0]
    assert 0.0 < np.hypot(*(first - second)[:2]) < 0.08


def test_an_episode_lasts_its_time_when_nothing_goes_wrong(tmp_path):
    assert len(poses(family(tmp_path, plant="planar"))) == 3 * TICK_HZ + 1


def test_an_episode_ends_when_the_robot_leaves_the_map(tmp_path):
    (tmp_path / "bad_agents.py").write_text(BAD_AGENTS, encoding="utf-8")
    metrics = family(tmp_path, seconds=20.0).run(make_episode({}, agent="bad_agents:straight", start=1, seed=0))
    assert 1.0 < metrics["survival_time"] < 6.0


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("raises", "raised ValueError at 0.50 s: lost"),
        ("nan", "answered [nan, 0.1] at 0.50 s; duties must be finite"),
        ("three", "answered with shape (3,) at 0.50 s; a command is two duties, left and right"),
        ("word", "raised ValueError at 0.50 s"),
        ("beginner", "raised RuntimeError before the first picture: no map"),
    ],
)
def test_a_failing_agents_episode_says_what_happened_and_when(tmp_path, name, says):
    (tmp_path / "bad_agents.py").write_text(BAD_AGENTS, encoding="utf-8")
    with pytest.raises(EpisodeError) as caught:
        poses(family(tmp_path), agent=f"bad_agents:{name}")
    assert str(caught.value).startswith(says)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", DECLARED)
def test_each_declared_parameter_moves_an_agents_trajectory(tmp_path, name):
    domain = family(tmp_path, plant="planar", seconds=8.0)
    parameter = PARAMETERS[name]
    low, high = (poses(domain, agent="wary", **{name: value}) for value in (parameter.probes[0], parameter.probes[-1]))
    shared = min(len(low), len(high))
    assert np.abs(low[:shared] - high[:shared]).max() > 0.01


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


def seen(domain, **theta):
    episode = make_episode(theta, agent="brisk", start=1, seed=5)
    return domain.measured(episode, domain.drive(episode))


FELT = [n for e in CATALOGUE.values() for n in theta_names(e) if n != "stiction.reversal"]
"""All parameters but one: no agent turns a wheel backwards."""


@pytest.mark.parametrize("theta_name", FELT)
def test_every_effect_of_the_catalogue_moves_an_agents_trajectory_as_it_is_measured(tmp_path, theta_name):
    domain = family(tmp_path, plant="planar", seconds=6.0)
    without, moved = (seen(domain, **theta) for theta in theta_of(theta_name))
    shared = min(len(without), len(moved))
    assert np.abs(without[:shared] - moved[:shared]).max() > 1e-3


@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_a_marker_moves_the_measured_poses_and_not_the_true_ones(tmp_path, plant):
    domain = family(tmp_path, plant=plant, seconds=1.0)
    theta = {"marker_offset.forward": 0.1, "heading_offset": 10.0}
    episode = make_episode(theta, agent="brisk", start=1, seed=5)
    driven = domain.drive(episode)
    shift = domain.measured(episode, driven) - driven.poses
    np.testing.assert_array_equal(driven.poses, poses(domain))
    np.testing.assert_allclose(np.hypot(shift[:, 0], shift[:, 1]), 0.1)
    np.testing.assert_allclose(np.arctan2(shift[:, 1], shift[:, 0]), np.angle(np.exp(1j * driven.poses[:, 2])))
    np.testing.assert_allclose(shift[:, 2], np.radians(10.0))


def test_a_slope_is_felt_along_the_heading_that_the_robot_starts_with(tmp_path):
    domain = family(tmp_path, plant="planar", seconds=1.0, position_noise_m=0.0, heading_noise_deg=0.0)
    start = poses(domain)[0]
    uphill = {"floor_slope.x": 0.1 * np.cos(start[2]), "floor_slope.y": 0.1 * np.sin(start[2])}
    along = np.array((np.cos(start[2]), np.sin(start[2])))
    level, climbed = ((poses(domain, **theta)[-1] - start)[:2] @ along for theta in ({}, uphill))
    assert 0.05 < level - climbed < 0.1


def test_naming_a_nominal_value_changes_nothing(tmp_path):
    domain = family(tmp_path, plant="planar")
    nominal = {
        "trim": 0.0,
        "delay": 0.15,
        "blur": 0.05,
        "camera_pitch": 19.15,
        "wheel_gain.left": 1.0,
        "driver_map": 0.0,
    }
    np.testing.assert_array_equal(poses(domain, **nominal), poses(domain))


def test_theta_goes_before_the_sections_effects_and_those_before_the_models(tmp_path):
    model = tmp_path / "model.toml"
    model.write_text(
        'robot = "duckiebot"\n[effects.trim]\ntrim = 0.1\n[effects.delay]\ndelay = 0.1\n', encoding="utf-8"
    )
    domain = family(tmp_path, model=model, effects={"trim": {"trim": 0.2}})
    instance = domain.instance({"delay": 0.0})
    values = {
        e.name: e for chain in (instance.drivetrain.command, instance.drivetrain.actuation) for e in chain.effects
    }
    assert values["trim"].trim == 0.2
    assert values["delay"].delay == 0.0
    assert values["motor_lag"].time_constant == 0.2


def test_what_determines_a_result_determines_the_identity(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    same = family(tmp_path / "a").identity
    assert same == family(tmp_path / "b").identity
    assert same != family(tmp_path / "a", plant="planar").identity
    assert same != family(tmp_path / "a", effects={"trim": {"trim": 0.1}}).identity
    (tmp_path / "a" / "mine.py").write_text("x = 1", encoding="utf-8")
    assert same != family(tmp_path / "a").identity


@pytest.mark.parametrize(
    ("domain", "says"),
    [
        ({"robott": "x"}, "domain.robott: unknown key; did you mean 'robot'?"),
        ({"robot": "duckybot"}, "domain.robot: unknown value 'duckybot'; did you mean 'duckiebot'?"),
        ({"plant": "bulet"}, "domain.plant: unknown value 'bulet'; did you mean 'bullet'?"),
        ({"camera": "eye"}, "domain.camera: unknown value 'eye'"),
        ({"map": "big_loop"}, "domain.map: unknown value 'big_loop'; did you mean 'small_loop'?"),
        ({"seconds": 0.0}, "domain.seconds: must be between"),
        ({"position_noise_m": float("nan")}, "domain.position_noise_m: must be finite"),
        ({"effects": {"trim": {"trim": 3.0}}}, "domain.effects.trim.trim: must be between"),
    ],
)
def test_a_mistake_in_the_domain_table_is_one_line(tmp_path, domain, says):
    with pytest.raises(SettingsError) as caught:
        family(tmp_path, **domain)
    assert says in str(caught.value)


def test_a_model_of_another_plant_is_not_overruled_in_silence(tmp_path):
    model = tmp_path / "model.toml"
    model.write_text('robot = "duckiebot"\nplant = "planar"\n', encoding="utf-8")
    assert family(tmp_path, model=model).plant == "planar"
    with pytest.raises(SettingsError, match="is 'bullet' but the model says 'planar'"):
        family(tmp_path, model=model, plant="bullet")


def test_pictures_come_at_the_cameras_rate(tmp_path):
    seen = []

    class Watcher:
        def begin(self, robot):
            return None

        def act(self, picture, memory):
            seen.append(picture)
            return (0.3, 0.35), None

    from proxytune.driving import lane_following as module

    domain = family(tmp_path, plant="planar")
    original = module.load_agent
    module.load_agent = lambda name, folder: Watcher()
    try:
        poses(domain)
    finally:
        module.load_agent = original
    fresh = [not np.array_equal(a, b) for a, b in itertools.pairwise(seen)]
    assert sum(fresh[20:40]) == 15


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
    level, steep = (
        domain.replay(make_episode({"camera_pitch": pitch}, agent="-", start=0, seed=0), commands) for pitch in (15, 25)
    )
    np.testing.assert_array_equal(level.poses, steep.poses)
    assert np.abs(level.pictures.astype(float) - steep.pictures).mean() > 5.0


def test_camera_effects_are_those_of_the_camera_stage():
    assert sum(effect.stage is Stage.CAMERA for effect in CATALOGUE.values()) == 9


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
def test_a_proxy_drives_what_its_model_has_learnt(tmp_path, plant):
    model = tmp_path / "model.toml"
    model.write_text(LEARNT)
    plain, learnt = (family(tmp_path, plant=plant, seconds=1.5, model=one) for one in (None, model))
    assert learnt.identity != plain.identity
    assert np.hypot(*(poses(learnt)[-1] - poses(plain)[-1])[:2]) > 0.01
