"""Lane following as a Gymnasium environment: the episodes that a study scores, step by step."""

import functools
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from one_line import complaint_of

from proxytune.domain import make_episode
from proxytune.driving import AGENTS, METRICS, read_robot
from proxytune.environments import CAR_LANE_FOLLOWING, LANE_FOLLOWING
from proxytune.environments.lane_following import LaneFollowingEnv
from proxytune.errors import EpisodeError

pytest.importorskip("gymnasium")


STRAIGHT = np.array((1.0, 0.95))
THETA = {"trim": 0.1, "delay": 0.06, "image_noise": 8.0, "delay_jitter": 0.05}
make = functools.partial(LaneFollowingEnv, plant="planar", seconds=3.0)


def episode_of(env, commands, **reset):
    """Reset, then every step of some commands, or by those of a shipped agent, until the episode is over."""
    steps = [(*env.reset(**reset), 0.0, False, False)]
    for command in answers_of(AGENTS[commands], steps) if isinstance(commands, str) else commands:
        picture, reward, terminated, truncated, info = env.step(command)
        steps.append((picture, info, reward, terminated, truncated))
        if terminated or truncated:
            break
    return steps


def answers_of(agent, steps):
    """An agent's answers to the last of some steps."""
    memory = agent.begin(read_robot("duckiebot"))
    while True:
        command, memory = agent.act(steps[-1][0], memory)
        yield command


def worlds():
    """How many PyBullet worlds are open."""
    pybullet = pytest.importorskip("pybullet", reason="PyBullet is not installed")
    return sum(pybullet.isConnected(world) for world in range(1000))


@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_gymnasiums_checker_finds_nothing_to_warn_of(plant):
    env = gymnasium.make(LANE_FOLLOWING, plant=plant, seconds=3.0, theta={"trim": [-0.1, 0.1]}, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    assert env.observation_space.shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("plant", "camera", "agent"),
    [
        *((plant, "ground_plane", agent) for plant in ("bullet", "planar") for agent in ("daredevil", "smooth")),
        pytest.param("bullet", "renderer", "smooth", marks=pytest.mark.slow),
    ],
)
def test_an_agent_drives_in_the_environment_as_in_a_study_to_the_last_bit(plant, camera, agent):
    env = make(plant=plant, camera=camera, theta=THETA, start=4)
    steps = episode_of(env, agent, seed=11)
    told = steps[0][1]
    episode = make_episode(told["theta"], agent=agent, start=told["start"], seed=told["episode_seed"])
    recording = env.family.record(episode)
    for column, name in enumerate(("x", "y", "heading")):
        np.testing.assert_array_equal([info["pose"][column] for _, info, *_ in steps], recording.poses[name][::3])
    assert {name: steps[-1][1][name] for name in METRICS} == recording.metrics
    env.close()


@pytest.mark.parametrize("seconds", [2.0, 1.23])
@pytest.mark.parametrize(("agent", "start"), [("daredevil", 0), ("drifter", 3), ("edges", 4)])
def test_rewards_add_up_to_the_distance_that_a_study_scores(agent, start, seconds):
    steps = episode_of(make(seconds=seconds, theta={"trim": 0.2}), agent, seed=start, options={"start": start})
    assert sum(reward for _, _, reward, *_ in steps) == pytest.approx(steps[-1][1]["distance"], abs=1e-12)
    assert abs(steps[-1][1]["distance"]) > 0.05


def test_info_is_what_a_study_would_score_and_an_episode_ends_off_the_map_or_with_its_time():
    steps = episode_of(make(seconds=2.0), "brisk", seed=3)
    short = episode_of(make(seconds=1.0), "brisk", seed=3)
    for name in ("distance", "survival_time", "deviation"):
        assert steps[20][1][name] == pytest.approx(short[-1][1][name], abs=1e-12)
    assert steps[20][1].keys() == {"pose", "distance", "survival_time", "deviation"}
    assert steps[-1][1].keys() == {"pose", *METRICS}
    *_, terminated, truncated = episode_of(make(seconds=20.0), [STRAIGHT] * 400, seed=0)[-1]
    assert (terminated, truncated) == (True, False)
    steps = episode_of(make(seconds=1.0), [np.zeros(2)] * 400, seed=0)
    assert [over[3:] for over in steps[-2:]] == [(False, False), (False, True)]
    assert len(steps) == 21


def test_options_hold_for_one_episode_of_a_series_by_seed_and_theta_is_drawn_within_its_bounds():
    one, other = (make(theta={"trim": [-0.2, 0.2]}) for _ in range(2))
    for reset in ({"seed": 5}, {}, {}):
        for mine, its in zip(*(episode_of(env, [STRAIGHT] * 5, **reset) for env in (one, other)), strict=True):
            np.testing.assert_array_equal(mine[0], its[0])
            np.testing.assert_array_equal(mine[1]["pose"], its[1]["pose"])
    first, second = one.reset(seed=5)[1], one.reset()[1]
    assert (first["episode_seed"], first["theta"]) != (second["episode_seed"], second["theta"])
    env = make(theta={"trim": 0.1, "delay": 0.05}, start=2)
    told = env.reset(seed=0, options={"theta": {"trim": -0.2}, "start": 7, "episode_seed": 42})[1]
    assert (told["theta"], told["start"], told["episode_seed"]) == ({"trim": -0.2, "delay": 0.05}, 7, 42)
    after = env.reset()[1]
    assert (after["theta"], after["start"]) == ({"trim": 0.1, "delay": 0.05}, 2)
    env = make(theta={"trim": [-0.1, 0.1], "delay": 0.05})
    thetas = [env.reset(seed=0 if not number else None)[1]["theta"] for number in range(30)]
    trims = [theta["trim"] for theta in thetas]
    assert -0.1 <= min(trims) < -0.05 < 0.05 < max(trims) <= 0.1
    assert {theta["delay"] for theta in thetas} == {0.05}
    bounds = {"trim": [-0.1, 0.1], "delay": [0.0, 0.2]}
    drawn = [make(theta=theta).reset(seed=0)[1]["theta"] for theta in (bounds, dict(reversed(bounds.items())))]
    assert drawn[0] == drawn[1]


def test_a_model_makes_it_the_target(write_file):
    model = write_file('format = 1\nrobot = "duckiebot"\nplant = "planar"\n[effects.trim]\ntrim = 0.2\n', "truth.toml")
    modelled = LaneFollowingEnv(model=model, start=1, seconds=3.0)
    assert modelled.family.plant == "planar"
    both = (modelled, make(theta={"trim": 0.2}, start=1))
    poses = [episode_of(env, [(0.4, 0.4)] * 20, seed=0)[-1][1]["pose"] for env in both]
    np.testing.assert_array_equal(*poses)


@pytest.mark.slow
def test_a_map_and_an_effect_of_ones_own_lie_in_the_folder_and_it_is_drawn_with_y_upwards(tmp_path):
    page = "size = [2.4, 1.755]\nstarts = [[1.2, 0.17, 0.0], [1.2, 1.58, 180.0]]"
    (tmp_path / "oval.toml").write_text(OVAL.replace("SIZE", page))
    (tmp_path / "mine.py").write_text(HALF)
    env = make(folder=tmp_path, map=tmp_path / "oval.toml", theta={"mine:Half": [0.2, 0.4]}, render_mode="rgb_array")
    told = env.reset(seed=0)[1]
    assert env.family.starts == 2
    assert 0.2 <= told["theta"]["mine:Half"] <= 0.4
    assert env.render().shape == (480, 640 + 656, 3)
    (tmp_path / "tall.toml").write_text(OVAL.replace("SIZE", "size = [2.4, 2.4]\nstarts = [[1.2, 0.17, 0.0]]"))
    env = make(folder=tmp_path, map="tall.toml", render_mode="rgb_array")
    env.reset(seed=0)
    white = (env.render()[:, 640:] > 150).all(axis=-1).any(axis=1)
    assert not white[:120].any()
    assert white[-30:].any()


OVAL = """
format = 1
description = "an oval"
SIZE
[road]
width = 0.585
lane_offset = 0.1287
lane_width = 0.22
begin = [0.8775, 0.2925, 0.0]
segments = [{ straight = 0.645 }, { radius = 0.585, turn = 90 }, { radius = 0.585, turn = 90 },
    { straight = 0.645 }, { radius = 0.585, turn = 90 }, { radius = 0.585, turn = 90 }]
[paint]
white_width = 0.048
yellow_width = 0.024
straight_dash = 0.042
bend_dash = 0.042
"""
HALF = """
from dataclasses import dataclass
from typing import ClassVar
from proxytune import Parameter
from proxytune.effects import Stage

@dataclass(frozen=True)
class Half:
    loss: float
    name: ClassVar = "half"
    stage: ClassVar = Stage.MOTION
    parameters: ClassVar = (Parameter(name="loss", unit="", low=0.0, high=0.9, neutral=0.0, probes=(0.1, 0.2)),)
    trace: ClassVar = None
    def begin(self, setting): return None
    def apply(self, signal, memory): return signal * (1.0 - self.loss), None
"""


def test_one_picture_and_one_way_are_drawn_where_the_robot_is():
    env = make(render_mode="rgb_array", start=1)
    picture, _ = env.reset(seed=0)
    before = env.render()
    assert (before.dtype, before.shape) == (np.uint8, (480, 640 + 480, 3))
    np.testing.assert_array_equal(before[5:480:10, 5:640:10], picture)
    for _ in range(10):
        env.step((0.5, 0.5))
    assert 0 < (before[:, 640:] != env.render()[:, 640:]).any(axis=-1).mean() < 0.02
    assert make().render() is None

    x, y, _ = env.reset(seed=0)[1]["pose"]
    above, per_metre = env.render()[:, 640:], 480 / 1.755
    assert tuple(above[round(480 - y * per_metre), round(x * per_metre)]) == (70, 160, 255)
    assert env.metadata["render_fps"] == 20


@pytest.mark.parametrize("vector", [SyncVectorEnv, AsyncVectorEnv])
def test_vector_environments_run_and_go_on_after_an_episode(vector):
    count = functools.partial(gymnasium.make, LANE_FOLLOWING, plant="planar", seconds=1.0)
    envs = vector([count, count])
    pictures, infos = envs.reset(seed=7)
    assert pictures.shape == (2, 48, 64, 3)
    assert infos["episode_seed"][0] != infos["episode_seed"][1]
    overs = [envs.step(np.full((2, 2), 0.3, dtype=np.float32))[3] for _ in range(25)]
    assert [step for step, over in enumerate(overs) if over.all()] == [19]
    envs.close()


@pytest.mark.slow
def test_worlds_and_cameras_of_many_theta_do_not_pile_up_and_closing_twice_does_no_harm():
    before, env = worlds(), make(plant="bullet", theta={"trim": [-0.1, 0.1]})
    for number in range(100):
        env.reset(seed=number)
        env.step((0.3, 0.3))
        assert worlds() <= before + 1
    env.close()
    env.close()
    with make(plant="bullet") as one, make(plant="bullet") as another:
        one.reset(seed=0)
        another.reset(seed=1)
        assert one.unwrapped._drive.plant._world != another.unwrapped._drive.plant._world
    assert worlds() <= before + 2
    before, env = worlds(), make(camera="renderer", theta={"camera_pitch": [10.0, 20.0]})
    for number in range(8):
        env.reset(seed=number)
    assert worlds() <= before + 5  # the family keeps the cameras of its last four instances
    env.close()


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"plant": "bulet"}, "plant: unknown value 'bulet'; did you mean 'bullet'?"),
        ({"robott": "duckiebot"}, "robott: unknown key; did you mean 'robot'?"),
        ({"foo": 1}, "foo: unknown key; known are: camera, effects, folder, heading_noise_deg, map, model, plant,"),
        ({"map": "big_loop"}, "map: unknown value 'big_loop'"),
        ({"theta": {"trimm": 0.1}}, "theta: unknown parameter 'trimm'; did you mean 'trim'?"),
        ({"theta": {"mass": 1.0}}, "unknown parameter 'mass'; nearest are "),
        ({"theta": {"mass": 1.0}}, "; `python -m proxytune list effects` has all"),
        ({"theta": {"trim": 5.0}}, "theta: trim must lie within [-0.5, 0.5], got 5.0"),
        ({"theta": {"trim": [0.2, 0.1]}}, "theta: trim: the lower bound must come first, got [0.2, 0.1]"),
        ({"theta": {"trim": "left"}}, "theta: trim must be a finite number or [low, high], got 'left'"),
        ({"theta": {"trim": [0.0, float("nan")]}}, "theta: trim must be a finite number or [low, high]"),
        ({"theta": 0.1}, "theta: must give a value or [low, high] by parameter, got 0.1"),
        ({"start": 10}, "start: must be a whole number from 0 to 9, got 10"),
        ({"model": "none.toml"}, "none.toml: no such file"),
        ({"render_mode": "human"}, "render_mode: unknown value 'human'; use 'rgb_array' or None"),
    ],
)
def test_a_mistake_is_one_line(keys, says):
    assert says in complaint_of(lambda: make(**keys))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"thetta": {}}, "options: unknown 'thetta'; did you mean 'theta'?"),
        ({"start": -1}, "start: must be a whole number from 0 to 9, got -1"),
        ({"episode_seed": 0.5}, "episode_seed: must be a whole number from 0 to 4294967295, got 0.5"),
        ({"theta": {"delay": -1.0}}, "theta: delay must lie within"),
    ],
)
def test_a_mistake_in_the_options_is_one_line(options, says):
    assert says in complaint_of(lambda: make().reset(options=options))


def test_an_action_that_is_no_command_is_refused_with_its_time_and_a_step_without_an_episode():
    env = make()
    env.reset(seed=0)
    env.step((0.1, 0.1))
    with pytest.raises(EpisodeError, match=r"answered \[nan, 0.1\] at 0.05 s"):
        env.step((np.nan, 0.1))
    with pytest.raises(EpisodeError, match=r"shape \(3,\) .*; a command is two .*, or a car's throttle and steering"):
        env.step((0.1, 0.1, 0.1))
    with pytest.raises(EpisodeError, match="answered with a str at 0.05 s"):
        env.step("ab")
    env = make(seconds=1.0)
    assert "call reset" in complaint_of(env.step, (0.1, 0.1))
    episode_of(env, [(0.0, 0.0)] * 30, seed=0)
    assert "the episode is over" in complaint_of(env.step, (0.1, 0.1))
    steps = episode_of(make(), [(0.2, 0.2)] * 8, seed=0)
    for number, (picture, *_) in enumerate(steps):
        picture[:] = number
    assert [int(picture[0, 0, 0]) for picture, *_ in steps] == list(range(9))


def printed(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    return done.stdout.strip(), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    "code",
    [
        "import gymnasium; print(gymnasium.make('proxytune.environments:proxytune/LaneFollowing-v0').spec.id)",
        "import gymnasium, proxytune.environments; print(gymnasium.make('proxytune/LaneFollowing-v0').spec.id)",
    ],
)
def test_gymnasium_makes_it(code):
    assert printed(code)[0] == "proxytune/LaneFollowing-v0"


def test_without_gymnasium_it_says_what_to_install_and_nothing_imports_it():
    _, errors = printed("import sys; sys.modules['gymnasium'] = None; import proxytune.environments")
    remedy = 'pip install ".[gym]" in the checkout of proxytune'
    assert errors.splitlines()[-1].endswith(f"gymnasium is not installed; {remedy}")
    assert printed("import sys, proxytune; print('gymnasium' in sys.modules)")[0] == "False"


@pytest.mark.slow
def test_a_car_follows_its_lane_as_an_environment_of_its_own():
    env = gymnasium.make(CAR_LANE_FOLLOWING, plant="planar", seconds=1.0, theta={"steering_offset": 0.05}, start=0)
    env.reset(seed=1)
    over, total = False, 0.0
    while not over:
        _, reward, terminated, over, info = env.step([0.2, -0.05])
        total += reward
    assert not terminated
    assert total == pytest.approx(info["distance"])
    assert info["distance"] > 0.2
    env.close()
