"""Small Gymnasium environments, and agents for them: the module of a user's study."""

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Discrete


class Cart(gymnasium.Env):
    """A robot on a plane: two actions turn and drive it; it sees x, y, heading, and noise of its own."""

    open = 0
    """How many are not closed."""

    def __init__(self, speed=1.0, actions=2, noise=0.0, bounds=(-1.0, 1.0)):
        self.action_space = Box(*bounds, (actions,), np.float32)
        self.observation_space = Box(-np.inf, np.inf, (4,), np.float32)
        self.speed, self.noise, self.mass, self.table = speed, noise, 1.0, np.array([[1.0, 2.0], [3.0, 4.0]])
        self.received = []
        type(self).open += 1

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.state = self.np_random.uniform(-1.0, 1.0, 3)
        return self._seen(), {}

    def step(self, action):
        self.received.append(np.array(action))
        drive, turn = float(np.sum(action)), float(action[-1] - action[0])
        self.state += 0.1 * self.speed / self.mass * np.array([drive, self.table[1, 0] / 3.0 * drive, turn])
        reward = -float(np.abs(self.state).sum()) + self.noise * self.np_random.normal()
        return self._seen(), reward, bool(abs(self.state[0]) > 3.0), False, {"drive": drive, "state": self.state}

    @property
    def weight(self):
        """Computed, so it cannot be set."""
        return 9.81 * self.mass

    def close(self):
        type(self).open -= 1

    def _seen(self):
        return np.array([self.state[2], self.state[0], self.state[1], 7.0], dtype=np.float32)


class Screen(gymnasium.Env):
    """Shows a white stripe that moves by the action."""

    action_space = Discrete(3)
    observation_space = Box(0, 255, (6, 8, 3), np.uint8)
    dt = 0.1

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = int(self.np_random.integers(8))
        return self._seen(), {}

    def step(self, action):
        self.place = (self.place + int(action) - 1) % 8
        return self._seen(), float(self.place == 4) + 0.01 * self.place, False, False, {}

    def _seen(self):
        picture = np.full((6, 8, 3), 40, np.uint8)
        picture[:, self.place] = 200
        return picture


class Odd(Screen):
    """Observes and takes what no effect can bend."""

    action_space = Dict({"a": Discrete(2)})
    observation_space = Dict({"b": Discrete(2)})


def heavy(mass):
    """A cart that is not made with too large a mass."""
    if mass > 1.5:
        raise ValueError("too heavy")
    return Cart()


def broken(**arguments):
    """Raises as it is made."""
    raise ValueError("no\nsuch luck")


def no_environment(**arguments):
    """Makes something else."""
    return {}


def ahead(observation):
    """Drive ahead."""
    return np.ones(2)


def homeward(observation):
    """Drive towards the middle."""
    return np.clip([-observation[1], -observation[1] - observation[0]], -1.0, 1.0)


class Alternating:
    """Drives every other step: an agent with a memory, made anew for each episode."""

    def __init__(self):
        self.steps = 0

    def predict(self, observation, deterministic=False):
        assert deterministic
        self.steps += 1
        return np.full(2, float(self.steps % 2), np.float32), None


class Wobble:
    """Swings from full ahead to full back, by channel, and rests: what every effect on commands bends."""

    def __init__(self):
        self.steps = 0

    def __call__(self, observation):
        self.steps += 1
        size = len(observation) // 3 + len(observation) // 4
        return np.array([1.0, 0.7])[:size] * np.sin(0.7 * self.steps) * (self.steps % 5 > 0)


class Recurrent:
    """Counts in a state that it is handed back."""

    def predict(self, observation, state=0, deterministic=False):
        return np.full(2, 0.1 * state, np.float32), state + 1


def left_of_middle(picture):
    """Move the stripe to the middle."""
    return 1 + int(np.sign(4 - int(picture[0, :, 0].argmax())))


class Brightness:
    """Moves by all that it sees, which every effect on pictures changes, and never rests for long."""

    def __init__(self):
        self.steps = 0

    def __call__(self, picture):
        self.steps += 1
        weighted = picture[..., 0].astype(int) * np.arange(1, 49).reshape(6, 8)
        return (self.steps + int(weighted.sum()) // 97) % 3


class Engine(Screen):
    """Holds a model of MuJoCo."""

    def __init__(self):
        import mujoco

        self.model = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")


def fails(observation):
    """Raises."""
    raise RuntimeError("lost\nthe way")


def three(observation):
    """Answers with too many numbers."""
    return [1.0, 2.0, 3.0]


def words(observation):
    """Answers with what is no number."""
    return "left"


def infinite(observation):
    """Answers with what is not finite."""
    return [np.inf, 0.0]


nothing = None

if "toys/Cart-v0" not in gymnasium.registry:
    gymnasium.register("toys/Cart-v0", entry_point="toys:Cart", max_episode_steps=12)
