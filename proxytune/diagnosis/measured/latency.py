"""How long after its command the motion comes: commands against measured speeds, motors of any slowness allowed.

The measured speeds are compared with the commands, shifted in time and passed through a first-order lag of any time
constant. A lag only ever makes motion later and rounder, a shift alone moves its onset: so the two are told apart, and
what is left of the latency is the pure one. Delay and the offset between two clocks are both pure latency: one number.
"""

from collections.abc import Iterator, Sequence
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

AT_ONCE = 300_000
"""About so many ticks go through the lag together: memory is not to grow with the number of drives."""


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


Ends = tuple[tuple[Whole, Whole], tuple[Whole, Whole]]
"""Episode and tick at which spans begin, and at which they end."""


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
    latencies = np.arange(-reach_s, reach_s + 1e-9, ROUGH_STEP_S).tolist()
    looks = [look for constant in TIME_CONSTANTS_S for look in commanded.reactions(few, latencies, constant)]
    _, latency, constant = min((_misfit(look), look.latency_s, look.time_constant_s) for look in looks)

    def left(point: Floats) -> float:
        latency_s = float(np.clip(point[0], -reach_s, reach_s))
        return _misfit(commanded.reaction(speeds, latency_s, _constant(point[1])))

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
        lambda root: _misfit(commanded.reaction(speeds, latency_s, root**2)),
        bounds=(0.0, top),
        method="bounded",
        options={"xatol": 5e-3},
    )
    return commanded.reaction(speeds, latency_s, float(found.x) ** 2)


def _constant(root: float) -> float:
    """A time constant from its root: near none, a lag matters by its square."""
    return float(min(root**2, LONGEST_TIME_CONSTANT_S))


class _CommandedSpeeds:
    """The speeds that commands ask for, at any latency and motor lag."""

    def __init__(self, drives: Drives, reach_s: float) -> None:
        self.drives = drives
        self.pad = int(np.ceil(reach_s * drives.tick_hz)) + 2

    def speeds(self, speeds: Speeds, latencies_s: Sequence[float], constant_s: float) -> Floats:
        """Mean speeds over the same spans (latencies, M, 2), so much later, of motors with this time constant."""
        asked = np.empty((len(latencies_s), len(speeds.first), 2))
        for own, ends, gone in self._batches(speeds, constant_s):
            for number, latency_s in enumerate(latencies_s):
                late = self.pad - latency_s * self.drives.tick_hz
                shift, part = int(np.floor(late)), late - np.floor(late)
                first, last = ((1.0 - part) * gone[e, t + shift] + part * gone[e, t + shift + 1] for e, t in ends)
                asked[number, own] = (last - first) / (speeds.last - speeds.first)[own, None]
        return asked

    def _batches(self, speeds: Speeds, constant_s: float) -> Iterator[tuple[slice, Ends, Floats]]:
        """Spans of a few episodes, where these begin and end, and how far their commands move the robot."""
        duties = self.drives.duties
        count = max(1, AT_ONCE // duties.shape[1])
        for begin in range(0, len(duties), count):
            own = slice(*np.searchsorted(speeds.episode, (begin, begin + count)))
            if own.start < own.stop:
                episode = speeds.episode[own] - begin
                ends = (episode, speeds.first[own]), (episode, speeds.last[own])
                yield own, ends, self._gone(slice(begin, begin + count), constant_s)

    def _gone(self, episodes: slice, constant_s: float) -> Floats:
        """How far the commands would have moved the robot by each tick: way [m], turn [rad], times ticks a second."""
        given, figures = self.drives.duties[episodes], self.drives.robot.figures
        before = np.repeat(self.drives.rest[episodes, None], self.pad, axis=1)
        duties = np.concatenate((before, given, np.repeat(given[:, -1:], self.pad, axis=1)), axis=1)
        kept = float(np.exp(-1.0 / (constant_s * self.drives.tick_hz))) if constant_s > 1e-4 else 0.0
        wheels, _ = lfilter([1.0 - kept], [1.0, -kept], duties, axis=1, zi=kept * duties[:, :1])
        yaw = (wheels[..., 1] - wheels[..., 0]) / figures["effective_baseline"]
        twists = figures["full_speed"] * np.stack((wheels.mean(axis=-1), yaw), axis=-1)
        return np.concatenate((np.zeros_like(twists[:, :1]), np.cumsum(twists, axis=1)), axis=1)

    def reactions(self, speeds: Speeds, latencies_s: Sequence[float], constant_s: float) -> list[Reaction]:
        """The reaction with the best gains at each latency."""
        asked = zip(latencies_s, self.speeds(speeds, latencies_s, constant_s), strict=True)
        return [_with_best_gains(speeds, one, latency_s, constant_s) for latency_s, one in asked]

    def reaction(self, speeds: Speeds, latency_s: float, constant_s: float) -> Reaction:
        """The reaction with the best gains at one latency."""
        (found,) = self.reactions(speeds, (latency_s,), constant_s)
        return found


def _with_best_gains(speeds: Speeds, asked: Floats, latency_s: float, constant_s: float) -> Reaction:
    gains = np.linalg.pinv(asked.T @ asked, hermitian=True) @ (asked.T @ speeds.values)
    rest = speeds.values - asked @ gains
    size = speeds.values.std(axis=0) + 1e-9
    return Reaction(latency_s, constant_s, gains, rest.std(axis=0) + 1e-9, ((rest / size) ** 2).sum(axis=1))


def _misfit(found: Reaction) -> float:
    """What a reaction leaves of the speeds, as a share of their variances."""
    return float(found.squares.mean())


def squares_by_latency(drives: Drives, speeds: Speeds, robot: Reaction, latencies: Floats, ends: Whole) -> Floats:
    """What this reaction leaves of each span at each latency (M, latencies), in its own variances.

    Where the commands had ended, at tick `ends` (E,), nothing speaks for or against a latency.
    """
    commanded = _CommandedSpeeds(drives, float(np.abs(latencies).max()))
    asked = commanded.speeds(speeds, [robot.latency_s, *latencies.tolist()], robot.time_constant_s)
    usual = _squares(speeds, robot, asked[0])
    left = np.empty((len(speeds.episode), len(latencies)))
    for number, latency in enumerate(latencies):
        known = speeds.last - latency * drives.tick_hz <= ends[speeds.episode]
        left[:, number] = np.where(known, _squares(speeds, robot, asked[number + 1]), usual)
    return left


def _squares(speeds: Speeds, robot: Reaction, asked: Floats) -> Floats:
    rest = (speeds.values - asked @ robot.gains) / robot.spread
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
