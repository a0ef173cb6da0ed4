"""What the hidden effects of the second generator are made of: signals (episodes, time, …) of one run of its robot."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FULL_SPEED, BASELINE, RADIUS, MOTOR_LAG = 0.6, 0.16, 0.0318, 0.20
ROW_S = 0.05

Array = NDArray[np.float64]
Effect = Callable[..., Array]
Table = Mapping[str, Effect]


class Run(NamedTuple):
    """What an effect may look at.

    Attributes:
        random: Random numbers of its own.
        step_s: Length of a step [s].
        exact: Whether a step is integrated exactly, or by Euler's rule from its beginning.
        duties: Duties in force (E, T, 2); before they arrive, those that were sent (E, rows, 2).
    """

    random: np.random.Generator
    step_s: float
    exact: bool
    duties: Array

    @property
    def times(self) -> Array:
        """The middle of each step, or its beginning [s] (T, 1)."""
        return (np.arange(self.duties.shape[1])[:, None] + 0.5 * self.exact) * self.step_s


def one_side(changed: Array, signal: Array, wheel: str) -> Array:
    """The change at one wheel only, or at both."""
    return np.where({"both": (True, True), "left": (True, False), "right": (False, True)}[wheel], changed, signal)


def lagging(signal: Array, tau: float, run: Run) -> Array:
    """What follows a signal that holds over each step with a lag: its mean over the step, or its value at its start."""
    kept = np.exp(-run.step_s / tau) if run.exact else 1.0 - run.step_s / tau
    ends = lfilter([1.0 - kept], [1.0, -kept], signal, axis=1)
    starts = np.concatenate((np.zeros_like(ends[:, :1]), ends[:, :-1]), axis=1)
    return signal + tau / run.step_s * (1.0 - kept) * (starts - signal) if run.exact else starts


def summed(rate: Array, run: Run) -> Array:
    """The integral of a rate up to the middle of each step, or up to its beginning."""
    return (np.cumsum(rate, axis=1) - rate * (0.5 if run.exact else 1.0)) * run.step_s


def angles(speeds: Array, run: Run) -> Array:
    """How far each wheel has turned [rad]."""
    return summed(speeds, run) * (FULL_SPEED / RADIUS)


def newest(signal: Array, valid: NDArray[np.bool_]) -> Array:
    """The newest valid sample (E, T) of a signal (E, T, n), zero before the first."""
    held = np.zeros_like(signal)
    for now in range(signal.shape[1]):
        held[:, now] = np.where(valid[:, now, None], signal[:, now], held[:, now - 1] if now else 0.0)
    return held


def scanned(signal: Array, step: Callable[[Array, Array], Array]) -> Array:
    """A state (E, n) that starts at zero and goes on with each sample, after each of them."""
    state, states = np.zeros_like(signal[:, 0]), np.empty_like(signal)
    for now in range(signal.shape[1]):
        state = states[:, now] = step(state, signal[:, now])
    return states


def twist_change(m: Array, ahead: Array | float = 0.0, aside: Array | float = 0.0, turn: Array | float = 0.0) -> Array:
    """A twist (…, 3) with something added to its forward, sideways [m/s] and yaw part [rad/s]."""
    changed = np.array(m)
    changed[..., 0] += ahead
    changed[..., 1] += aside
    changed[..., 2] += turn
    return changed
