"""The latency from a command to its motion: commands against measured speeds, motors of any slowness allowed.

The measured speeds are compared with the commands, shifted in time and passed through a first-order lag of any time
constant, and turns through another. A lag only ever makes motion later and rounder, a shift alone moves its onset: so
the two are told apart, and what is left of the latency is the pure one; without a lag of their own, drives that turn
more than others would seem to have another clock. Delay and the offset between two clocks are both pure latency: one
number.

`clock_drift` finds two clocks that run at different rates, `stretches` where a clock jumps within a drive, and
`deviants` the drives that have another one. A clock that jumps also puts poses on or back by the way of that time, if
the robot moves: a step between two samples, where the latency changes by as much, is better proof than the latency.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.optimize import minimize

from proxytune.diagnosis.motion.drives import Drives, Floats, Whole, lagged, relative, rows_at, sum_by
from proxytune.driving import drivetrain
from proxytune.logs import Log

SPAN_S = 0.2
"""Speeds are means over so long: pose noise is averaged out, and 0.05 s of latency is still clear."""
MOST_SPANS = 8000
"""Of longer logs as many speeds are taken, evenly spread."""
LONGEST_LAG_S = 1.0
TIME_CONSTANTS_S = (0.06, 0.25)
"""The longest lag that is reckoned with, and the motors' of a first look."""
SIMPLEX = (0.06, 0.15, 0.3)
"""Steps of the latency [s] and the roots of the lags of motors and turns in which the best is looked for."""
TURNS_LATE = 0.8
"""Turns have a lag of their own if with it no more than this share of the mean square is left."""
STEP_S = 0.05
"""Latencies are tried in such steps; the best lies between them, at the vertex of a parabola."""
ROUGH_STEP_S = 0.1
THINNED = 2
"""The step of the first look, which one span in so many is enough for."""
AT_ONCE = 300_000
"""About so many ticks go through the lag together: memory is not to grow with the number of drives."""


class Speeds(NamedTuple):
    """Measured forward speeds [m/s] and yaw rates [rad/s] over spans of ticks (M, 2)."""

    episode: Whole
    first: Whole
    last: Whole
    values: Floats


class Reaction(NamedTuple):
    """The linear, first-order robot that follows its commands best."""

    latency_s: float  # what latency lies beyond the motor's lag [s]
    lags_s: tuple[float, float]  # time constants: of the motors, and of turns beside that
    gains: Floats  # from commanded to measured forward speed and yaw rate (2, 2)
    squares: Floats  # what it leaves of each span (M,), in units of the whole log's

    @property
    def misfit(self) -> float:
        """Mean square that it leaves of the speeds, as a share of their variances."""
        return float(self.squares.mean())


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
    looks = [look for constant in TIME_CONSTANTS_S for look in commanded.reactions(few, latencies, (constant, 0.0))]
    _, latency, (constant, _) = min((look.misfit, look.latency_s, look.lags_s) for look in looks)
    return _close_reaction(commanded, speeds, (latency, float(np.sqrt(constant)), 0.0), (-reach_s, reach_s))


def reaction_at(drives: Drives, speeds: Speeds, latency_s: float) -> Reaction:
    """The best reaction with this latency."""
    commanded = _CommandedSpeeds(drives, abs(latency_s))
    return _close_reaction(commanded, speeds, (latency_s, 0.3, 0.0), (latency_s, latency_s))


def _close_reaction(
    commanded: "_CommandedSpeeds", speeds: Speeds, start: tuple[float, float, float], reach_s: tuple[float, float]
) -> Reaction:
    """The best reaction near a latency and the roots of both lags: near none, a lag matters by its square.

    Turns lag beside the motors only if that leaves clearly less: clocks that jump look a little like it.
    """

    def at(point: Floats) -> Reaction:
        motors, turns = np.minimum(np.append(point[1:], 0.0)[:2] ** 2, LONGEST_LAG_S).tolist()
        (found,) = commanded.reactions(speeds, [float(np.clip(point[0], *reach_s))], (motors, turns))
        return found

    def search(count: int) -> Reaction:
        simplex = (start + np.eye(4, 3, -1) * SIMPLEX)[: count + 1, :count]
        options: Any = {"xatol": 2e-3, "fatol": 1e-5, "maxfev": 30 * count, "initial_simplex": simplex}
        found: Any = minimize(lambda point, *_: at(point).misfit, simplex[0], method="Nelder-Mead", options=options)
        return at(found.x)

    plain, late = search(2), search(3)
    return late if late.misfit < TURNS_LATE * plain.misfit else plain


class _CommandedSpeeds:
    """The speeds that commands ask for, at any latency and motor lag."""

    def __init__(self, drives: Drives, reach_s: float) -> None:
        self.drives = drives
        self.pad = int(np.ceil(reach_s * drives.tick_hz)) + 2

    def speeds(self, speeds: Speeds, latencies_s: Sequence[float], lags_s: tuple[float, float]) -> Floats:
        """Mean speeds over the same spans (latencies, M, 2), so much later, of motors and turns with these lags."""
        asked = np.empty((len(latencies_s), len(speeds.first), 2))
        for own, ends, gone in self._batches(speeds, lags_s):
            for number, latency_s in enumerate(latencies_s):
                moved = _moved(gone, ends, self.pad - latency_s * self.drives.tick_hz)
                asked[number, own] = moved / (speeds.last - speeds.first)[own, None]
        return asked

    def _batches(self, speeds: Speeds, lags_s: tuple[float, float]) -> Iterator[tuple[slice, Ends, Floats]]:
        """Spans of a few episodes, where these begin and end, and how far their commands move the robot."""
        duties = self.drives.duties
        count = max(1, AT_ONCE // duties.shape[1])
        for begin in range(0, len(duties), count):
            own = slice(*np.searchsorted(speeds.episode, (begin, begin + count)))
            if own.start < own.stop:
                episode = speeds.episode[own] - begin
                ends = (episode, speeds.first[own]), (episode, speeds.last[own])
                yield own, ends, self._gone(slice(begin, begin + count), lags_s)

    def _gone(self, episodes: slice, lags_s: tuple[float, float]) -> Floats:
        """Motion that the commands ask for by each tick: way [m], turn [rad], times ticks a second."""
        given, figures = self.drives.duties[episodes], self.drives.robot.figures
        before = np.repeat(self.drives.rest[episodes, None], self.pad, axis=1)
        duties = np.concatenate((before, given, np.repeat(given[:, -1:], self.pad, axis=1)), axis=1)
        of_wheels, of_turning = (lag_s * self.drives.tick_hz if lag_s > 1e-4 else 0.0 for lag_s in lags_s)
        wheels = lagged(duties, of_wheels)
        if self.drives.robot.drive == "ackermann":
            twists = drivetrain(self.drives.robot, ()).ideal(wheels)[..., ::2]
        else:
            yaw = (wheels[..., 1] - wheels[..., 0]) / figures["effective_baseline"]
            twists = figures["full_speed"] * np.stack((wheels.mean(axis=-1), yaw), axis=-1)
        twists[..., 1:] = lagged(twists[..., 1:], of_turning)
        return np.concatenate((np.zeros_like(twists[:, :1]), np.cumsum(twists, axis=1)), axis=1)

    def reactions(self, speeds: Speeds, latencies_s: Sequence[float], lags_s: tuple[float, float]) -> list[Reaction]:
        """The reaction with the best gains at each latency."""
        found, size = list[Reaction](), speeds.values.std(axis=0) + 1e-9
        for latency_s, asked in zip(latencies_s, self.speeds(speeds, latencies_s, lags_s), strict=True):
            gains = np.linalg.pinv(asked.T @ asked, hermitian=True) @ (asked.T @ speeds.values)
            rest = speeds.values - asked @ gains
            squares = ((rest / size) ** 2).sum(axis=1)
            found.append(Reaction(latency_s, lags_s, gains, squares))
        return found


def _moved(gone: Floats, ends: Ends, late: float) -> Floats:
    """Motion within spans (M, 2) by motion until each tick (E, T, 2), so many ticks on."""
    shift, part = int(np.floor(late)), late - np.floor(late)
    first, last = ((1.0 - part) * rows_at(gone, e, t + shift) + part * rows_at(gone, e, t + shift + 1) for e, t in ends)
    return np.asarray(last - first)


def speeds_by_reaction(drives: Drives, speeds: Speeds, robot: Reaction, latencies: Floats) -> Floats:
    """The speeds that this reaction has over the same spans at each latency (latencies, M, 2)."""
    commanded = _CommandedSpeeds(drives, float(np.abs(latencies).max()))
    return np.asarray(commanded.speeds(speeds, latencies.tolist(), robot.lags_s) @ robot.gains)


def speeds_by_model(speeds: Speeds, twists: Floats, late_ticks: Floats) -> Floats:
    """The speeds over the same spans by a model's motion of every tick (E, T, 2), so much later (latencies, M, 2)."""
    pad = int(np.ceil(np.abs(late_ticks).max())) + 2
    gone = np.cumsum(np.pad(twists, ((0, 0), (pad + 1, pad), (0, 0)), "edge"), axis=1)
    ends = (speeds.episode, speeds.first), (speeds.episode, speeds.last)
    moved = np.stack([_moved(gone, ends, pad - late) for late in late_ticks])
    return np.asarray(moved / (speeds.last - speeds.first)[:, None])


def squares_by_latency(
    log: Log, drives: Drives, speeds: Speeds, expected: Floats, usual: int, latencies: Floats
) -> "Blocks":
    """Squares that expected speeds (latencies, M, 2) leave, in units of what the `usual` one of the latencies does."""
    ends = np.array([len(episode.times) for episode in log.episodes]) * round(drives.tick_hz / log.rate_hz)
    ends += drives.lead
    rest = speeds.values - expected
    rest /= rest[usual].std(axis=0) + 1e-9
    squares = np.einsum("lmc,lmc->ml", rest, rest)
    # Where the commands had ended, nothing speaks for or against a latency.
    known = speeds.last[:, None] - latencies * drives.tick_hz <= ends[speeds.episode, None]
    squares = np.where(known, squares, squares[:, [usual]])
    return Blocks(*sum_in_blocks(LATENCY_BLOCK_S, drives, speeds, squares))


def likeliest_latency(squares: Floats, latencies: Floats) -> Latency:
    """The latency at which squares summed over blocks (blocks, latencies) are least."""
    total = squares.sum(axis=0)
    least = int(total.argmin())
    middle = int(np.clip(least, 1, len(total) - 2))
    curve = float(total[middle - 1] - 2.0 * total[middle] + total[middle + 1])
    # Nothing tells it, as at either end: a robot that is stuck is as if its commands came long after.
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


LATENCY_BLOCK_S = 2.0
"""Squares are summed over such blocks, whose scatter says how sure a latency is."""
LEAST_APART_S = 0.04
"""Clocks less far apart are one."""
SIDE = 4
"""A stretch between two jumps has at least so many blocks, and a drive of its own clock twice as many."""
SURE, SURE_OF_A_JUMP = 5.0, 8.0
"""Standard deviations; a jump is looked for at every time, so more of them."""
SURE_BESIDE_OTHERS, SHARE_BESIDE_OTHERS = 5.5, 0.15
"""The same where one side of the jump answers as the other drives do; NEAR_S apart, or two deviations, is the same."""
NEAR_S = 0.02

SURE_AT_A_STEP, SHARE_AT_A_STEP = 4.0, 0.05
"""The same where poses step when the latency changes, as a jump of their clock makes them while the robot moves."""
STEP_SPAN_S, STEP_NATS = 0.2, 8.0
"""Poses so long before and after show a step, and it is so much likelier than none."""
LEAST_STEP_S, STEP_TOLERANCE = 0.03, 0.5
"""The least jump that a step tells, and the share to which it does besides chance."""

SHARE, SHARE_IF_FAR = 0.08, 0.7
FAR_S = 1.0
"""The least share of what is left over that another clock takes away, and that one further off than FAR_S does. Drives
in which a robot sticks or has play answer later than others, but another latency explains little of that."""
LEAST_SQUARES = 2.0
"""Squares a block below this are next to nothing: another latency that takes them away explains nothing."""
MOST_JUMPS = 4


class Blocks(NamedTuple):
    """Squares left over at each latency, by blocks of time: episode (B,), number in it (B,), squares (B, L)."""

    episode: Whole
    number: Whole
    squares: Floats


FASTEST_DRIFT_S, DRIFT_STEP_S = 1.0, 0.025
"""A drift is looked for that puts clocks so far apart over a log, in steps of as much at either end."""
PIECE, FEWEST_PIECES = 5, 4
"""Pieces of so many blocks vote on a drift."""
DRIFT_ITERATIONS = 3
LEAST_DRIFT_S = 0.02
"""Clocks that come less far apart over a log keep one rate."""


class Drift(NamedTuple):
    """Two clocks that run at different rates: poses are stamped so much later with every second [s/s] of its span."""

    rate: float
    deviation: float
    span_s: float

    @property
    def is_sure(self) -> bool:
        """True if it is no chance, and long enough to matter."""
        return abs(self.rate) > SURE * self.deviation and abs(self.rate) * self.span_s > LEAST_DRIFT_S


def clock_drift(blocks: Blocks, times: Floats, latencies: Floats) -> Drift | None:
    """The rate at which latency grows over a log, its blocks' middles at `times` (B,) [s]; None where nothing tells."""
    middle, step = times - times.mean(), float(latencies[1] - latencies[0])
    span = float(np.ptp(times))
    if span <= 0.0:
        return None
    steps = round(FASTEST_DRIFT_S / DRIFT_STEP_S)
    rates = np.arange(-steps, steps + 1) * 2.0 * DRIFT_STEP_S / span
    left = [_put_later(blocks.squares, latencies, rate * middle).sum(axis=0).min() for rate in rates]
    rate = float(rates[int(np.argmin(left))])
    for _ in range(DRIFT_ITERATIONS):
        squares = _put_later(blocks.squares, latencies, rate * middle)
        total = squares.sum(axis=0)
        at = int(np.clip(total.argmin(), 1, len(total) - 2))
        curve = float(total[at - 1] - 2.0 * total[at] + total[at + 1]) / step**2 / len(times)
        if curve <= 0.0:
            return None
        slopes = (squares[:, at + 1] - squares[:, at - 1]) / (2.0 * step)
        further = -float(slopes @ middle) / (curve * float(middle @ middle))
        rate += further
    # Where a part of the drives alone grows late, their robot or their own clock does.
    _, label = np.unique(blocks.episode * len(times) + blocks.number // PIECE, return_inverse=True)
    votes = np.bincount(label, (slopes - slopes.mean() + curve * further * middle) * middle)
    if len(votes) < FEWEST_PIECES:
        return None
    lost = len(votes) / (len(votes) - 2.0)
    deviation = float(np.sqrt(lost * (votes**2).sum())) / (curve * float(middle @ middle))
    return Drift(rate, deviation, span)


def _put_later(squares: Floats, latencies: Floats, later_s: Floats) -> Floats:
    """Squares of blocks (B, L) at latencies that are later by so much in each block (B,), along parabolas."""
    place = np.arange(len(latencies)) + (later_s / (latencies[1] - latencies[0]))[:, None]
    nearest = np.clip(np.rint(place).astype(int), 1, len(latencies) - 2)
    by = np.clip(place - nearest, -1.0, 1.0)
    row = np.arange(len(squares))[:, None]
    before, here, after = (squares[row, nearest + k] for k in (-1, 0, 1))
    return np.asarray(here + by * (after - before) / 2.0 + by**2 * (after - 2.0 * here + before) / 2.0)


class Jump(NamedTuple):
    """A clock that jumps within a drive, at a time [s, of the log]: poses are stamped so much later from then [s]."""

    drive: str
    time_s: float
    by_s: float


def squares_within(blocks: Blocks, kept: Sequence[tuple[float, float]]) -> list[Floats]:
    """The squares of each episode's blocks that lie in its stretch [s]."""
    begin, end = blocks.number * LATENCY_BLOCK_S, (blocks.number + 1) * LATENCY_BLOCK_S
    within = [(blocks.episode == e) & (begin >= first) & (end <= last) for e, (first, last) in enumerate(kept)]
    return [blocks.squares[own] for own in within]


class Step(NamedTuple):
    """Poses that step as if their clock jumped by so much within a block, and how much likelier that is [nats]."""

    number: int
    by: Latency
    nats: float


def _steps(log: Log) -> list[list[Step]]:
    """The clearest step of each drive's blocks: a clock that jumps puts moving poses on or back between samples."""
    count = max(3, round(STEP_SPAN_S * log.rate_hz))
    # The way round a step is a parabola over time; a jump's step is as long in way and turn.
    at = np.arange(1 - count, count + 1) - 0.5
    parabola = np.linalg.pinv(np.stack((np.ones(2 * count), at, at**2, at > 0.0), axis=1))
    # From ways by samples to the increments between them.
    filters = (parabola @ np.tri(2 * count, 2 * count - 1, -1))[[1, 3]].T * (log.rate_hz, 1.0)
    moved = [relative(e.poses[:-1], e.poses[1:])[:, ::2] for e in log.episodes]
    empty = np.empty((0, 2, 2))
    seen = [sliding_window_view(m, 2 * count - 1, 0) @ filters if len(m) >= 2 * count - 1 else empty for m in moved]
    every = np.abs(np.concatenate(seen)[..., 1])
    every = every[np.isfinite(every).all(axis=1)]
    # Robust: a tenth of all may be of starts and stops.
    spread = np.quantile(every, 0.9, axis=0) / 1.645 + 1e-9 if len(every) else np.ones(2)
    return [_clearest(count / log.rate_hz, one / spread[:, None], log.rate_hz) for one in seen]


def _clearest(begin_s: float, seen: Floats, rate_hz: float) -> list[Step]:
    """The clearest steps of a drive from its speeds and steps (N, 2, 2), in deviations of a step."""
    speeds, steps = seen[..., 0], seen[..., 1]
    size = (speeds**2).sum(axis=1) + 1e-9
    by = -(speeds * steps).sum(axis=1) / size
    nats = by**2 * size - (steps**2).sum(axis=1) / 2.0
    number = ((begin_s + np.arange(len(by)) / rate_hz) / LATENCY_BLOCK_S).astype(int)
    sure = np.flatnonzero((nats > STEP_NATS) & (np.abs(by) > LEAST_STEP_S))
    best = {number[i]: i for i in sure[np.argsort(nats[sure])]}
    return [Step(int(k), Latency(float(by[i]), float(size[i] ** -0.5)), float(nats[i])) for k, i in best.items()]


def stretches(
    log: Log, blocks: Blocks, latencies: Floats, *, at_steps: bool = False
) -> tuple[list[tuple[float, float]], tuple[Jump, ...]]:
    """The longest stretch of each drive without a jump of its clock [s after its beginning], and all jumps.

    With `at_steps` only jumps at which poses step: a robot that changes makes none.
    """
    kept: list[tuple[float, float]] = []
    jumps: list[Jump] = []
    judged = _judged([blocks.squares[blocks.episode == e] for e in range(len(log.episodes))], latencies)
    usual = _median(list(judged.values())) if len(judged) > 1 else None
    for e, (episode, steps) in enumerate(zip(log.episodes, _steps(log), strict=True)):
        own = np.flatnonzero(blocks.episode == e)
        drive = Blocks(*(part[own] for part in blocks))
        found = _jumps_at_steps(drive, latencies, steps, usual, at_steps=at_steps)
        edges = [0.0, *(float(blocks.number[own[at]] * LATENCY_BLOCK_S) for at, _ in found), np.inf]
        margin = np.array([0.0, *([LATENCY_BLOCK_S] * len(found)), 0.0])
        end = float(episode.times[-1] - episode.times[0])
        spans = list(zip((edges + margin)[:-1].tolist(), (edges - margin)[1:].tolist(), strict=True))
        kept.append(max(spans, key=lambda span: min(span[1], end) - span[0]))
        jumps += [Jump(episode.name, float(episode.times[0]) + edges[1 + k], by) for k, (_, by) in enumerate(found)]
    return kept, tuple(jumps)


def _jumps_at_steps(
    drive: Blocks, latencies: Floats, steps: Sequence[Step], usual: float | None, *, at_steps: bool
) -> list[tuple[int, float]]:
    """The jumps of a drive: the clearest at a step, then those on either side of it; others where there is no step."""
    step = None if usual is None else _jump_at_a_step(drive, latencies, steps, usual)
    if step is None:
        return [] if at_steps else _all_jumps(drive.squares, latencies, usual)
    sides = (slice(None, step[0]), slice(step[0] + 1, None))
    earlier, later = (
        _jumps_at_steps(Blocks(*(part[side] for part in drive)), latencies, steps, usual, at_steps=at_steps)
        for side in sides
    )
    return [*earlier, step, *((step[0] + 1 + at, by) for at, by in later)]


def _jump_at_a_step(drive: Blocks, latencies: Floats, steps: Sequence[Step], usual: float) -> tuple[int, float] | None:
    """The block within which poses step and after which the latency is another by as much, the likeliest; and that."""
    near = np.abs(latencies - usual) < FAR_S
    found = []
    for number, step, nats in steps:
        at, after = (int(np.searchsorted(drive.number, number, side)) for side in ("left", "right"))
        if min(at, len(drive.number) - after) < SIDE:
            continue
        one, other, share = _sides(drive.squares[:at, near], drive.squares[after:, near], latencies[near])
        by, deviation = other.value - one.value, float(np.hypot(one.deviation, other.deviation))
        apart = 2.0 * np.hypot(deviation, step.deviation) + STEP_TOLERANCE * abs(step.value)
        if abs(by - step.value) < apart and _is_jump(one, other, share, usual, at_a_step=True):
            found.append((nats + (by / deviation) ** 2 / 2.0, at, by))
    return max(found)[1:] if found else None


def _all_jumps(squares: Floats, latencies: Floats, usual: float | None) -> list[tuple[int, float]]:
    """The jumps of a drive; small ones alone where none is found among all."""
    found = _jumps(squares, latencies, MOST_JUMPS, usual)
    if found or not len(squares):
        return found
    # What a robot does in its last seconds may look like something that it did long before.
    near = np.abs(latencies - latencies[int(squares.sum(axis=0).argmin())]) < FAR_S
    return _jumps(squares[:, near], latencies[near], MOST_JUMPS, usual)


def _jumps(squares: Floats, latencies: Floats, most: int, usual: float | None) -> list[tuple[int, float]]:
    """Blocks at which one drive's latency jumps, and by how much [s]: the clearest first, then on either side of it."""
    if most == 0 or len(squares) < 2 * SIDE:
        return []
    before = np.cumsum(squares, axis=0)[SIDE - 1 : len(squares) - SIDE]
    total = squares.sum(axis=0)
    at = int((before.min(axis=1) + (total - before).min(axis=1)).argmin()) + SIDE
    one, other, share = _sides(squares[:at], squares[at:], latencies)
    by = other.value - one.value
    if not _is_jump(one, other, share, usual):
        return []
    earlier, later = (_jumps(part, latencies, most - 1, usual) for part in (squares[:at], squares[at:]))
    return [*earlier, (at, by), *((at + more, step) for more, step in later)]


def _sides(before: Floats, after: Floats, latencies: Floats) -> tuple[Latency, Latency, float]:
    """The latencies before and after, and the least share of what is left over that each takes away from the other."""
    one, other = likeliest_latency(before, latencies), likeliest_latency(after, latencies)
    return one, other, min(_share(before, latencies, other.value), _share(after, latencies, one.value))


def _is_jump(one: Latency, other: Latency, share: float, usual: float | None, *, at_a_step: bool = False) -> bool:
    """Tell whether the two sides of a block have clearly different latencies, by the share that each takes away."""
    by = abs(other.value - one.value)
    sure = by / float(np.hypot(one.deviation, other.deviation))
    least = SHARE_AT_A_STEP if at_a_step else SHARE
    if by <= LEAST_APART_S or share < (least if by < FAR_S else SHARE_IF_FAR):
        return False
    # Where both sides are far off, a few seconds are only like what was asked long before or after.
    if by > FAR_S and usual is not None and min(abs(side.value - usual) for side in (one, other)) > FAR_S:
        return False
    if sure > SURE_OF_A_JUMP:
        return True
    enough, least = (SURE_AT_A_STEP, least) if at_a_step else (SURE_BESIDE_OTHERS, SHARE_BESIDE_OTHERS)
    if usual is None or sure <= enough or share < least:
        return False
    near, far = sorted((one, other), key=lambda side: abs(side.value - usual))
    as_others = abs(near.value - usual) < max(NEAR_S, 2.0 * near.deviation)
    return as_others and abs(far.value - usual) > max(LEAST_APART_S, enough * far.deviation)


def _share(squares: Floats, latencies: Floats, elsewhere: float) -> float:
    """The share of what is left over at another latency that the best one takes away."""
    best, other = int(squares.sum(axis=0).argmin()), int(np.abs(latencies - elsewhere).argmin())
    gained = squares[:, other] - squares[:, best]
    # Far off, one block alone is no proof: a tracker may put its map right within it.
    kept = np.ones(len(squares), dtype=bool)
    kept[gained.argmax()] = abs(latencies[best] - elsewhere) < FAR_S
    return float(gained[kept].sum() / max(squares[kept, other].sum(), LEAST_SQUARES * kept.sum()))


def deviants(own: Sequence[Floats], latencies: Floats) -> tuple[float, dict[int, Latency]]:
    """The latency that most drives have, and the drives that clearly have another."""
    judged = _judged(own, latencies)
    if len(judged) < 2:
        return 0.0, {}
    common = _median(list(judged.values()))
    found = {}
    for e, one in judged.items():
        away = abs(one.value - common)
        enough = _share(own[e], latencies, common) > (SHARE if away < FAR_S else SHARE_IF_FAR)
        if enough and away > max(LEAST_APART_S, SURE * one.deviation):
            found[e] = one
    return common, found


def _judged(own: Sequence[Floats], latencies: Floats) -> dict[int, Latency]:
    """The latency of every drive that is long enough to have one."""
    judged = {e: likeliest_latency(squares, latencies) for e, squares in enumerate(own) if len(squares) >= 2 * SIDE}
    return {e: one for e, one in judged.items() if np.isfinite(one.deviation)}


def _median(latencies: Sequence[Latency]) -> float:
    """The middle latency, sure ones counting more."""
    ordered = sorted(latencies)
    weight = np.cumsum([1.0 / (one.deviation**2 + (LEAST_APART_S / 4.0) ** 2) for one in ordered])
    return ordered[int(np.searchsorted(weight, weight[-1] / 2.0))].value
