"""Gymnasium's pendulum, which also tells how upright it is, and small agents for it."""

import gymnasium
import numpy as np


class Upright(gymnasium.Wrapper):
    """Adds to info whether the pole is within 20° of upright."""

    def step(self, action):
        """What the environment answers, with `upright` in info."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated, truncated, {**info, "upright": float(observation[0] > 0.94)}


def pendulum(g=10.0):
    """The environment of this study."""
    return Upright(gymnasium.make("Pendulum-v1", g=g, max_episode_steps=-1))


class Swinger:
    """Pumps energy into the pole, and balances it once it is nearly upright (PD)."""

    def __init__(self, pump, stiffness, damping, catch=0.8, energy=1.0):
        self.pump, self.stiffness, self.damping, self.catch, self.energy = pump, stiffness, damping, catch, energy

    def predict(self, observation, deterministic=True):
        """The torque for an observation, as policies of stable-baselines3 answer."""
        cosine, sine, speed = observation
        if cosine > self.catch:
            return [-self.stiffness * np.arctan2(sine, cosine) - self.damping * speed], None
        wanted = 15.0 * self.energy * (1.0 - cosine) - speed**2 / 2.0
        return [self.pump * np.sign(speed + 1e-6) * np.sign(wanted)], None


firm = Swinger(pump=2.0, stiffness=12.0, damping=3.0)
soft = Swinger(pump=2.0, stiffness=7.0, damping=1.0)
stiff = Swinger(pump=2.0, stiffness=25.0, damping=2.0)
damped = Swinger(pump=2.0, stiffness=12.0, damping=8.0)
gentle = Swinger(pump=0.8, stiffness=12.0, damping=3.0)
eager = Swinger(pump=2.0, stiffness=12.0, damping=3.0, energy=1.3)
early = Swinger(pump=2.0, stiffness=12.0, damping=3.0, catch=0.3)
late = Swinger(pump=2.0, stiffness=12.0, damping=3.0, catch=0.97)


def whirl(observation):
    """Push the way it swings, always."""
    return [2.0 * np.sign(observation[2])]


def brake(observation):
    """Push against the way it swings."""
    return [-0.5 * observation[2]]
