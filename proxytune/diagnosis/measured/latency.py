"""How long after its command the motion comes: commands against measured speeds, motors of any slowness allowed.

The measured speeds are compared with the commands, shifted in time and passed through a first-order lag of any time
constant. A lag only ever makes motion later and rounder, a shift alone moves its onset: so the two are told apart, and
what is left of the latency is the pure one. Delay and the offset between two clocks are both pure latency: one number.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.signal import lfilter

from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, sum_by

SPAN_S = 0.2
"""Speeds are means over so long: pose noise is averaged out, and 0.05 s of latency is still clear."""

MOST_SPANS = 8000
"""Of longer logs as many speeds are taken, evenly spread."""

LONGEST_TIME_CONSTANT_S = 1.0
TIME_CONSTANTS_S = (0.06, 0.25)
"""The longest motor lag that is reckoned with, and those of a first look."""

STEP_S = 0.05
"""Latencies are tried in such steps; the best lies between them, at the vertex of a parabola."""

ROUGH_STEP_S = 0.1
THINNED = 2
"""The step of the first look, which one span in so many is enough for."""


class Speeds(NamedTuple):
    """Measured forward speeds [m/s] and yaw rates [rad/s] over spans of time.

    Attributes:
        episode: Episode of each span (M,).
        first: Tick at which it begins (M,).
        last: Tick at which it ends (M,).
        values: Forward speed and yaw rate (M, 2).
    """

    episode: Whole
    first: Whole
    last: Whole
    values: Floats


class Reaction(NamedTuple):
    """The linear, first-order robot that follows its commands best.

    Attributes:
        latency_s: Time from command to motion beyond the motor's lag; negative where motion comes first [s].
        time_constant_s: Of the motor [s].
        gains: From commanded to measured forward speed and yaw rate (2, 2).
        spread: What it leaves of either, standard deviation (2,).
        squares: What it leaves of each span, in units of the whole log's (M,).
    """

    latency_s: float
    time_constant_s: float
    gains: Floats
    spread: Floats
    squares: Floats


class Latency(NamedTuple):
    """A pure latency [s] with its standard deviation."""

    value: float
    deviation: float


def measured_speeds(drives: Drives) -> Speeds:
    """Speeds over spans of SPAN_S one after another, each within an unbroken run of poses."""
    count = max(1, round(SPAN_S * drives.tick_hz / float(np.median(drives.last - drives.first))))
    every = max(count, len(drives.first) // MOST_SPANS)
    begin = np.arange(0, len(drives.first) - count + 1, every)
    run = np.cumsum(~drives.linked)
    begin = begin[run[begin] == run[begin + count - 1]]
    end = begin + count - 1
    gone = np.concatenate((np.zeros((1, 2)), np.cumsum(drives.measured[:, [0, 2]], axis=0)))
    later = 0.0 if drives.after is None else drives.after[end, 1] - drives.after[begin, 0]
    seconds = (drives.last[end] - drives.first[begin] + later) / drives.tick_hz
    values = (gone[end + 1] - gone[begin]) / seconds[:, None]
    return Speeds(drives.episode[begin], drives.first[begin], drives.last[end], values)


def reaction(drives: Drives, speeds: Speeds, reach_s: float) -> Reaction:
    """The best reaction with a latency of at most `reach_s` either way: a rough look at all, then a close one."""
    commanded = _CommandedSpeeds(drives, reach_s + 1.0)
    few = Speeds(*(part[::THINNED] for part in speeds))
    looks = [
        (commanded.misfit(few, float(latency), constant), float(latency), constant)
        for constant in TIME_CONSTANTS_S
        for latency in np.arange(-reach_s, reach_s + 1e-9, ROUGH_STEP_S)
    ]
    _, latency, constant = min(looks)

    def left(point: Floats) -> float:
        return commanded.misfit(speeds, float(np.clip(point[0], -reach_s, reach_s)), _constant(point[1]))

    root = float(np.sqrt(constant))
    corners = np.array([(latency, root), (latency + 0.06, root), (latency, root + 0.15)])
    found = minimize(
        left,
        corners[0],
        method="Nelder-Mead",
        options={"xatol": 2e-3, "fatol": 1e-5, "maxfev": 60, "initial_simplex": corners},
    )
    return commanded.reaction(speeds, float(np.clip(found.x[0], -reach_s, reach_s)), _constant(float(found.x[1])))


def reaction_at(drives: Drives, speeds: Speeds, latency_s: float) -> Reaction:
    """The best reaction with this latency."""
    commanded = _CommandedSpeeds(drives, abs(latency_s))
    top = float(np.sqrt(LONGEST_TIME_CONSTANT_S))
    found = minimize_scalar(
        lambda root: commanded.misfit(speeds, latency_s, root**2),
        bounds=(0.0, top),
        method="bounded",
        options={"xatol": 5e-3},
    )
    return commanded.reaction(speeds, latency_s, float(found.x) ** 2)


def _constant(root: float) -> float:
    """A time constant from its root: near none, a lag matters by its square."""
    return float(min(root**2, LONGEST_TIME_CONSTANT_S))


class _CommandedSpeeds:
    """The speeds that commands ask for, at any latency and motor lag; the motion of the last lag is kept."""

    def __init__(self, drives: Drives, reach_s: float) -> None:
        self.drives = drives
        self.pad = int(np.ceil(reach_s * drives.tick_hz)) + 2
        before = np.repeat(drives.rest[:, None], self.pad, axis=1)
        after = np.repeat(drives.duties[:, -1:], self.pad, axis=1)
        self.duties = np.concatenate((before, drives.duties, after), axis=1)
        self.gone: dict[float, Floats] = {}

    def speeds(self, speeds: Speeds, latency_s: float, constant_s: float) -> Floats:
        """Mean speeds over the same spans (M, 2), so much later, of motors with this time constant."""
        gone = self._gone(constant_s)
        late = self.pad - latency_s * self.drives.tick_hz
        shift, part = int(np.floor(late)), late - np.floor(late)
        ends = [(1.0 - part) * gone[e, t + shift] + part * gone[e, t + shift + 1] for e, t in _ends(speeds)]
        return np.asarray((ends[1] - ends[0]) / (speeds.last - speeds.first)[:, None])

    def _gone(self, constant_s: float) -> Floats:
        """How far the commands would have moved the robot by each tick: way [m], turn [rad], times ticks a second."""
        if constant_s not in self.gone:
            kept = float(np.exp(-1.0 / (constant_s * self.drives.tick_hz))) if constant_s > 1e-4 else 0.0
            wheels, _ = lfilter([1.0 - kept], [1.0, -kept], self.duties, axis=1, zi=kept * self.duties[:, :1])
            figures = self.drives.robot.figures
            yaw = (wheels[..., 1] - wheels[..., 0]) / figures["effective_baseline"]
            twists = figures["full_speed"] * np.stack((wheels.mean(axis=-1), yaw), axis=-1)
            gone = np.concatenate((np.zeros_like(twists[:, :1]), np.cumsum(twists, axis=1)), axis=1)
            self.gone = {constant_s: gone}
        return self.gone[constant_s]

    def misfit(self, speeds: Speeds, latency_s: float, constant_s: float) -> float:
        """What the best gains leave of the speeds, as a share of their variances."""
        return float(self.reaction(speeds, latency_s, constant_s).squares.mean())

    def reaction(self, speeds: Speeds, latency_s: float, constant_s: float) -> Reaction:
        """The reaction with the best gains."""
        asked = self.speeds(speeds, latency_s, constant_s)
        gains = np.linalg.pinv(asked.T @ asked, hermitian=True) @ (asked.T @ speeds.values)
        rest = speeds.values - asked @ gains
        size = speeds.values.std(axis=0) + 1e-9
        return Reaction(latency_s, constant_s, gains, rest.std(axis=0) + 1e-9, ((rest / size) ** 2).sum(axis=1))


def _ends(speeds: Speeds) -> tuple[tuple[Whole, Whole], tuple[Whole, Whole]]:
    return (speeds.episode, speeds.first), (speeds.episode, speeds.last)


def squares_by_latency(drives: Drives, speeds: Speeds, robot: Reaction, latencies: Floats, ends: Whole) -> Floats:
    """What this reaction leaves of each span at each latency (M, latencies), in its own variances.

    Where the commands had ended, at tick `ends` (E,), nothing speaks for or against a latency.
    """
    commanded = _CommandedSpeeds(drives, float(np.abs(latencies).max()))
    usual = _squares(commanded, speeds, robot, robot.latency_s)
    left = np.empty((len(speeds.episode), len(latencies)))
    for number, latency in enumerate(latencies):
        known = speeds.last - latency * drives.tick_hz <= ends[speeds.episode]
        left[:, number] = np.where(known, _squares(commanded, speeds, robot, float(latency)), usual)
    return left


def _squares(commanded: _CommandedSpeeds, speeds: Speeds, robot: Reaction, latency_s: float) -> Floats:
    rest = (speeds.values - commanded.speeds(speeds, latency_s, robot.time_constant_s) @ robot.gains) / robot.spread
    return np.asarray((rest**2).sum(axis=1))


def likeliest_latency(squares: Floats, latencies: Floats) -> Latency:
    """The latency at which squares summed over blocks (blocks, latencies) are least.

    Its deviation is that of the blocks' slopes there over the curvature; infinite where nothing tells it, as at either
    end: a robot that is stuck is as if its commands came long after.
    """
    total = squares.sum(axis=0)
    least = int(total.argmin())
    middle = int(np.clip(least, 1, len(total) - 2))
    curve = float(total[middle - 1] - 2.0 * total[middle] + total[middle + 1])
    if curve <= 0.0 or least != middle:
        return Latency(float(latencies[middle]), float("inf"))
    slopes = (squares[:, middle + 1] - squares[:, middle - 1]) / 2.0
    step = float(latencies[1] - latencies[0])
    deviation = float(np.sqrt(((slopes - slopes.mean()) ** 2).sum())) / curve * step
    return Latency(float(latencies[middle]) - float(np.clip(slopes.sum() / curve, -1.0, 1.0)) * step, deviation)


def sum_in_blocks(seconds: float, drives: Drives, speeds: Speeds, values: Floats) -> tuple[Whole, Whole, Floats]:
    """Sums of values of the spans (M, …) over blocks of time: episode and number in it (B,), sums (B, …)."""
    number = (speeds.first / drives.tick_hz / seconds).astype(int)
    most = int(number.max()) + 1
    keys, label = np.unique(speeds.episode * most + number, return_inverse=True)
    return keys // most, keys % most, sum_by(label, values, len(keys))
