"""What episodes cost, and the environment's steps: `python -m pytest benchmarks/episode_costs.py -o addopts= -s`.

Episode and environment are driven by the same agent through the same episodes, so they do the same work but for what
Gymnasium asks: a reward, an info and a copied picture each step. Their times are of the processor, best of ROUNDS.
"""

import time
from pathlib import Path

import numpy as np
import pytest

from proxytune.domain import make_episode
from proxytune.driving import (
    AGENTS,
    TICK_HZ,
    BulletPlant,
    cameras,
    drivetrain,
    lane_following,
    load_agent,
    loops,
    perception,
    read_robot,
)
from proxytune.driving.cameras import Views
from proxytune.driving.plants import PlanarPlant, integrate
from proxytune.effects import FilterContext, effects_from
from proxytune.settings import Section

ROBOT = read_robot("duckiebot")
MINUTE = 60 * TICK_HZ
CAREFUL = make_episode({}, agent="steady", start=1, seed=0)


def twists():
    train = drivetrain(ROBOT, effects_from(ROBOT.theta, ROBOT.figures))
    duties = np.tile((0.33, 0.36), (MINUTE, 1))
    return train.apply(duties, train.begin(FilterContext(TICK_HZ, np.zeros(2), ROBOT.figures)))[0]


def family(folder: Path, plant: str):
    return lane_following(Section(folder / "study.toml", "domain.", {"plant": plant}), model=None)


def use(monkeypatch, by):
    """Let the inner loops be done by Numba or by NumPy."""
    way = loops.by_numba() if by == "numba" else loops
    for module in (cameras, perception):
        monkeypatch.setattr(module, "fastest", lambda pictures: way)


ROUNDS, EPISODES = 5, 3

both = pytest.mark.parametrize("by", ["numpy", "numba"])


@pytest.mark.benchmark(group="60-s episode")
@both
@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_episode_with_camera_and_agent(benchmark, tmp_path, monkeypatch, plant, by):
    use(monkeypatch, by)
    domain = family(tmp_path, plant)
    metrics = benchmark.pedantic(domain.run, args=(CAREFUL,), rounds=7, warmup_rounds=1)
    assert metrics["survival_time"] == 60.0


@pytest.mark.benchmark(group="60-s episode")
def test_bare_steps_of_the_same_episode(benchmark, tmp_path):
    """PyBullet's stepSimulation alone, as often as in the episode, the robot driving along."""
    import pybullet

    def setup():
        plant = BulletPlant(ROBOT, np.array((0.9, 0.2, 0.0)), 1.0 / TICK_HZ)
        plant.move(np.tile((0.2, 0.0, 0.4), (TICK_HZ, 1)))
        return (plant,), {}

    def step(plant):
        for _ in range(MINUTE):
            pybullet.stepSimulation(plant._world)
        plant.__exit__(None, None, None)

    benchmark.pedantic(step, setup=setup, rounds=7, warmup_rounds=1)


@pytest.fixture
def driven(tmp_path):
    """The instance of a planar episode, its drive, and the pictures that its agent saw."""
    domain = family(tmp_path, "planar")
    drive = domain.drive(CAREFUL)
    return domain.instance({}), drive, domain.replay(CAREFUL, drive.commands).pictures


@pytest.mark.benchmark(group="parts of a 60-s planar episode")
def test_agent(benchmark, driven, tmp_path):
    agent = load_agent(CAREFUL.agent, tmp_path)

    def act():
        memory = agent.begin(ROBOT)
        for picture in driven[2]:
            _, memory = agent.act(picture, memory)

    benchmark(act)


@pytest.mark.benchmark(group="parts of a 60-s planar episode")
def test_effects_on_commands_and_motion(benchmark, driven):
    train, held = driven[0].drivetrain, [np.repeat(command[None], 3, axis=0) for command in driven[1].commands]

    def apply():
        memory = train.begin(FilterContext(TICK_HZ, np.zeros(2), ROBOT.figures))
        for duties in held:
            _, memory = train.apply(duties, memory)

    benchmark(apply)


@pytest.mark.benchmark(group="parts of a 60-s planar episode")
def test_planar_plant(benchmark):
    steps = twists().reshape(-1, 3, 3)

    def move():
        plant = PlanarPlant(np.zeros(3), 1.0 / TICK_HZ)
        for step in steps:
            plant.move(step)

    benchmark(move)


@pytest.mark.benchmark(group="parts of a 60-s planar episode")
@both
def test_pictures(benchmark, driven, monkeypatch, by):
    use(monkeypatch, by)
    instance, steps = driven[0], driven[1].poses[1:].reshape(-1, 3, 3)

    def see():
        setting = FilterContext(TICK_HZ, driven[1].poses[0], ROBOT.figures)
        views = Views(instance.camera, instance.image, (setting,))
        for poses in steps:
            views.pass_by(poses[None], (0,))
            views.planes((0,))

    benchmark(see)


@pytest.mark.benchmark(group="one-minute log")
def test_planar_replay_of_a_one_minute_log(benchmark):
    """Duties at 60 Hz through delay, trim and motor lag to poses."""
    poses = benchmark(lambda: integrate(np.zeros(3), twists(), 1.0 / TICK_HZ))
    assert poses.shape == (MINUTE, 3)


def stepped(env, robot):
    """How many steps an environment takes under the episode's agent."""
    agent = AGENTS[CAREFUL.agent]
    picture, _ = env.reset(options={"start": CAREFUL.start, "episode_seed": CAREFUL.seed})
    memory, steps, over = agent.begin(robot), 0, False
    while not over:
        command, memory = agent.act(picture, memory)
        picture, _, terminated, truncated, _ = env.step(command)
        steps, over = steps + 1, terminated or truncated
    return steps


def rate(work):
    """Steps a second of the processor's time, of work that gives its number of steps."""
    best = 0.0
    for _ in range(ROUNDS):
        begun = time.process_time()
        steps = sum(work() for _ in range(EPISODES))
        best = max(best, steps / (time.process_time() - begun))
    return best


@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_steps_a_second(plant):
    gymnasium = pytest.importorskip("gymnasium")
    from proxytune.environments import LANE_FOLLOWING

    env = gymnasium.make(LANE_FOLLOWING, plant=plant, seconds=15.0)
    domain = env.unwrapped.family
    robot = domain.instance({}).robot

    def bare():
        domain.run(CAREFUL)
        return round(domain.seconds * robot.figures["control_rate"])

    assert stepped(env, robot) == bare()
    rates = {"bare episode": rate(bare)}
    rates["environment"] = rate(lambda: stepped(env.unwrapped, robot))
    rates["gymnasium.make"] = rate(lambda: stepped(env, robot))
    env.close()
    for name, found in rates.items():
        print(f"  {plant:7} {name:15} {found:6.0f} steps/s, {found / rates['bare episode']:.2f} of the bare episode")
