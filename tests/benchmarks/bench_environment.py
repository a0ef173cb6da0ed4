"""Steps a second of the environment beside the bare episode's.

`python -m pytest tests/benchmarks/bench_environment.py -o addopts= -s`. Both are driven by the same agent through the
same episodes, so they do the same work but for what Gymnasium asks: a reward, an info and a copied picture each step.
Times are of the processor, best of ROUNDS.
"""

import time

import gymnasium
import pytest

from proxytune.domain import make_episode
from proxytune.driving import AGENTS
from proxytune.environments import LANE_FOLLOWING

pytest.importorskip("gymnasium")


AGENT, START, SEED, ROUNDS, EPISODES = "steady", 1, 0, 5, 3
OPTIONS = {"start": START, "episode_seed": SEED}


def stepped(env, robot):
    agent = AGENTS[AGENT]
    picture, _ = env.reset(options=OPTIONS)
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
    env = gymnasium.make(LANE_FOLLOWING, plant=plant, seconds=15.0)
    family = env.unwrapped.family
    episode = make_episode({}, agent=AGENT, start=START, seed=SEED)
    robot = family.instance({}).robot

    def bare():
        family.run(episode)
        return round(family.seconds * robot.figures["control_rate"])

    assert stepped(env, robot) == bare()
    rates = {"bare episode": rate(bare)}
    rates["environment"] = rate(lambda: stepped(env.unwrapped, robot))
    rates["gymnasium.make"] = rate(lambda: stepped(env, robot))
    env.close()
    for name, found in rates.items():
        print(f"  {plant:7} {name:15} {found:6.0f} steps/s, {found / rates['bare episode']:.2f} of the bare episode")
