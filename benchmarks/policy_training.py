"""Whether more steps train a better policy: `python benchmarks/policy_training.py [SEED …]`.

The example of docs/how-to/gymnasium.md: after each 8000 steps the policy drives ten seconds from eight starts in the
nominal simulator. Printed are its mean return (metres along the lane) and how long it stays on the road. It needs
`pip install ".[gym,train]"`; a seed takes some four minutes of one core.
"""

import sys

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

import proxytune.environments  # noqa: F401 - registers the environments

LANE, STEPS, EVERY, STARTS, RATE_HZ = "proxytune/LaneFollowing-v0", 80_000, 8_000, 8, 20


class Report(BaseCallback):
    """Prints how the policy drives, every so many steps."""

    def __init__(self, seed):
        super().__init__()
        self.seed, self.last = seed, 0
        self.road = gymnasium.make(LANE, plant="planar", seconds=10)

    def _on_step(self):
        if self.num_timesteps - self.last >= EVERY:
            self.last += EVERY
            self.show(self.num_timesteps)
        return True

    def show(self, steps):
        """Print mean return and seconds on the road, from each start once."""
        driven = []
        for start in range(STARTS):
            picture, _ = self.road.reset(seed=start, options={"start": start})
            metres, ticks, over = 0.0, 0, False
            while not over:
                duties, _ = self.model.predict(picture, deterministic=True)
                picture, reward, ended, cut, _ = self.road.step(duties)
                metres, ticks, over = metres + float(reward), ticks + 1, ended or cut
            driven.append((metres, ticks / RATE_HZ))
        metres, seconds = np.mean(driven, axis=0)
        print(f"| {self.seed} | {steps} | {metres:.2f} | {seconds:.1f} |", flush=True)


def train(seed):
    """Train as the documentation does, by PPO with a step that shrinks to nothing."""
    keys = {"plant": "planar", "seconds": 15, "theta": {"trim": [-0.1, 0.1]}}
    envs = VecNormalize(make_vec_env(LANE, n_envs=4, seed=seed, env_kwargs=keys), norm_obs=False)
    policy = PPO(
        "CnnPolicy", envs, n_steps=256, batch_size=128, n_epochs=4, gamma=0.97, seed=seed, device="cpu",
        learning_rate=lambda left: 5e-4 * left, policy_kwargs={"log_std_init": -1.0},
    )  # fmt: skip
    policy.learn(STEPS, callback=Report(seed))


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    torch.set_num_threads(1)
    print("| seed | steps | return [m] | on the road [s] |\n|---|---|---|---|")
    for number in map(int, sys.argv[1:] or (0, 1, 2)):
        train(number)
