"""The clocks of commands and poses, and drives put right, cut and kept aside for a diagnosis.

Motion before its command is proof of two clocks; so is motion so late that no delay accounts for it, a drive that
answers at another time than the others, a drive that changes its time to answer in the middle, and a time to answer
that grows evenly through all drives. A constant offset that leaves a latency which a delay may have is no proof: delay
and offset are one number.

`read_clocks` measures all this, `put_on_one_clock` corrects it in the log, and `on_one_clock` does both for whoever
fits or judges a log. `cut_out_long_rests` cuts a log where it stands for long: an hour of rest says nothing of motion.
`split` chooses which drives are fitted and which are kept aside, in blocks that are left out in turn, and `thin` makes
long ones short enough to fit in seconds.
"""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from proxytune.arrays import NORMAL_95
from proxytune.diagnosis.motion import latency
from proxytune.diagnosis.motion.drives import Drives, Floats, gather, number_of
from proxytune.diagnosis.motion.innovations import expected_theta, twists_of
from proxytune.diagnosis.motion.latency import Jump
from proxytune.driving import Robot
from proxytune.effects import PARAMETERS
from proxytune.errors import LogError
from proxytune.logs import Log, LogEpisode, Measured, join_windows
from proxytune.space import Theta

FURTHEST_S = 10.0
"""Clocks are looked for up to so far apart."""
EARLIEST_S = 0.02
"""Motion must come so long before its command to be proof."""
ASSUMED_DELAY_S = 0.05
"""The delay that is left to a robot whose nominal delay nobody states, once an offset is taken out."""
RARE = 0.25
"""Clocks of no more than this share of the drives jump, or are others."""
DRIFT_PASSES = 3
"""The robot is fitted anew once commands are on the poses' clock, and what is left of a drift is found by that."""
PROOF_BLOCK_S = 5.0
"""Two latencies are compared over such blocks."""


class Offset(NamedTuple):
    """Time by which poses are stamped later than commands, with a 95 % interval [s]."""

    value: float
    interval: tuple[float, float]


NONE = Offset(0.0, (0.0, 0.0))


@dataclass(frozen=True)
class Clocks:
    """The clocks of a log's commands and poses."""

    latency: Offset  # from command to motion, beyond the motors' lag, drives of another clock apart [s]
    # how much later poses are stamped, if the latency is proof of two clocks: what the latency has besides the
    # assumed delay; 0 where it is none
    offset: Offset
    assumed_delay_s: float  # the delay that the robot is left with where an offset is taken out [s]
    # drives with another clock than the rest: how much later their poses are stamped than those [s]
    drives: dict[str, Offset]
    jumps: tuple[Jump, ...]  # clocks that jump within a drive, of which the longest stretch is kept
    later_s: Floats  # how much later the poses of each drive are put (E,) [s]
    kept_s: Floats  # from when to when each drive is used (E, 2) [s after its beginning]
    # how much later poses are stamped, as log.toml declares; that was taken out beforehand [s], or None
    declared_s: float | None = None
    # how much later poses are stamped with every second [s/s]; all else is of what `without_drift` leaves
    drift: Offset = NONE

    @property
    def left_s(self) -> float:
        """The latency that is left once the offset is taken out [s]."""
        return self.latency.value - self.offset.value

    @property
    def odd(self) -> set[str]:
        """The drives that have another clock than the rest, or one that jumps."""
        return {*self.drives, *(jump.drive for jump in self.jumps)}

    @property
    def differ(self) -> bool:
        """Tell whether any clock differs from another."""
        return bool(self.offset.value or self.drives or self.jumps or self.drift.value)


def on_one_clock(log: Log, robot: Robot, like: Clocks | None = None, model: Theta | None = None) -> tuple[Log, Clocks]:
    """A log as it is fitted and judged: windows joined, long rests cut out, on one clock; and what its clocks were."""
    log = cut_out_long_rests(join_windows(log))
    clocks = read_clocks(log, robot, like, model)
    return put_on_one_clock(log, clocks), clocks


def read_clocks(log: Log, robot: Robot, like: Clocks | None = None, model: Theta | None = None) -> Clocks:
    """Measure the latency of every drive of a log; clocks differ too if it is not what `like`, another log's, leave.

    Latencies are those of a robot of first order. A robot that is slow in another way answers later to some commands
    than to others, as if clocks jumped or drifted. So where the θ of a `model` leaves less of the speeds, its motion
    has to show a drift too, and clocks of single drives are told as they are beside it.
    """
    drives = gather(log, robot, log.episodes, compared=False)
    speeds = latency.measured_speeds(drives) if len(drives.first) else None
    if speeds is None or not len(speeds.first):
        # Drives too short to tell are taken to have one clock.
        kept_s, later_s = np.tile((0.0, np.inf), (len(log.episodes), 1)), np.zeros(len(log.episodes))
        return Clocks(NONE, NONE, ASSUMED_DELAY_S, {}, (), later_s, kept_s, log.clock_offset_s)
    log, drift, (squares, latencies, best, apart) = _read_drift(log, robot, drives, speeds, model)
    kept, jumps, common, others = _single_clocks(log, squares, latencies)
    if model is not None and (jumps or others):
        beside = _squares_by_model(log, robot, speeds, latencies, model, best.misfit)
        if beside is not None:
            kept, jumps, common, others = _single_clocks(log, beside, latencies)
    own = latency.squares_within(squares, kept)
    alike = np.concatenate([part for e, part in enumerate(own) if e not in others])
    usual = latency.likeliest_latency(alike, latencies)
    assumed = like.left_s if like else max(robot.theta.get("delay", 0.0), ASSUMED_DELAY_S)
    least_apart = max(latency.LEAST_APART_S, latency.SURE * usual.deviation)
    unlike = like is not None and abs(usual.value - assumed) > least_apart
    half = NORMAL_95 * usual.deviation
    early = usual.value + half < 0.0 and usual.value < -EARLIEST_S
    # No delay accounts for such a latency.
    impossible = early or usual.value - half > PARAMETERS["delay"].high
    taken = log.fit_clock_offset or unlike or (apart and impossible)
    later = np.full(len(own), assumed - usual.value if taken else 0.0)
    for e, one in others.items():
        later[e] -= one.value - common
    return Clocks(
        latency=_offset(usual, 0.0),
        offset=_offset(usual, assumed) if taken else NONE,
        assumed_delay_s=assumed,
        drives={log.episodes[e].name: _offset(one, common) for e, one in others.items()},
        jumps=jumps,
        later_s=later,
        kept_s=np.array(kept, dtype=float),
        declared_s=log.clock_offset_s,
        drift=drift,
    )


_Squares = tuple[latency.Blocks, Floats, latency.Reaction, bool]


def _read_drift(
    log: Log, robot: Robot, drives: Drives, speeds: latency.Speeds, model: Theta | None
) -> tuple[Log, Offset, _Squares]:
    """The log without a drift of clocks, that drift, and what `_squares_by_reaction` then gives."""
    begin = np.array([episode.times[0] for episode in log.episodes])

    def drift_of(blocks: latency.Blocks, latencies: Floats) -> latency.Drift | None:
        times = begin[blocks.episode] + (blocks.number + 0.5) * latency.LATENCY_BLOCK_S
        return latency.clock_drift(blocks, times, latencies)

    given = _squares_by_reaction(log, drives, speeds)
    corrected, drift, found = log, NONE, given
    for _ in range(DRIFT_PASSES):
        more = drift_of(*found[:2])
        if more is None or not (drift.value or more.is_sure):
            break
        drift = _offset(latency.Latency(drift.value + more.rate, more.deviation), 0.0)
        corrected = without_drift(corrected, more.rate)
        found = _squares_by_reaction(corrected, gather(corrected, robot, corrected.episodes), speeds)
    if model is not None and drift.value:
        _, latencies, best, _ = given
        beside = _squares_by_model(log, robot, speeds, latencies, model, best.misfit)
        if beside is not None and not ((more := drift_of(beside, latencies)) and more.is_sure):
            return log, NONE, given
    return corrected, drift, found


def put_on_one_clock(log: Log, clocks: Clocks) -> Log:
    """Put commands on the clock of poses, which keep it, and leave out poses beyond a jump or before all commands."""
    if not clocks.differ:
        return log

    def retime(episode: LogEpisode, later_s: float, kept_s: Floats) -> LogEpisode:
        if later_s:
            episode = replace(episode, issued=_issued(episode) - later_s)
        begin, end = episode.times[0] + np.maximum(kept_s, (-later_s, 0.0)) + (-1e-9, 1e-9)
        known, measured = (begin <= episode.times) & (episode.times <= end), episode.measured
        if measured is not None:
            measured = Measured(*(part[known[measured.rows]] for part in measured))
        return replace(episode, poses=np.where(known[:, None], episode.poses, np.nan), measured=measured)

    episodes = without_drift(log, clocks.drift.value).episodes
    return replace(log, episodes=tuple(map(retime, episodes, clocks.later_s, clocks.kept_s)))


def _issued(episode: LogEpisode) -> Floats:
    return episode.times if episode.issued is None else episode.issued


def without_drift(log: Log, rate: float) -> Log:
    """Put commands on the poses' clock, which is later by `rate` with every second from the log's first sample on."""
    if rate == 0.0:
        return log
    first = min(float(episode.times[0]) for episode in log.episodes)
    issued = [(_issued(episode), episode) for episode in log.episodes]
    return replace(log, episodes=tuple(replace(one, issued=own + rate * (own - first)) for own, one in issued))


def _single_clocks(
    log: Log, squares: latency.Blocks, latencies: Floats
) -> tuple[list[tuple[float, float]], tuple[Jump, ...], float, dict[int, latency.Latency]]:
    """The stretch of each drive without a jump, all jumps, the latency of most drives, and drives with another."""
    kept, jumps = latency.stretches(log, squares, latencies)
    # Few odd drives may be their clocks; a robot whose lag is another in every manoeuvre, as with ramps, has many.
    most = max(1.0, RARE * len(log.episodes))
    varied = len({jump.drive for jump in jumps}) > most
    if varied:
        # Where poses step, it is the clock, however many drives have it.
        proven, at_steps = latency.stretches(log, squares, latencies, at_steps=True)
        varied = len({jump.drive for jump in jumps} - {jump.drive for jump in at_steps}) > most
        kept, jumps = (proven, at_steps) if varied else (kept, jumps)
    jumped = {jump.drive for jump in jumps}
    common, others = latency.deviants(latency.squares_within(squares, kept), latencies)
    whole = [e for e in others if log.episodes[e].name not in jumped]
    if varied or len(whole) > most:
        others = {e: one for e, one in others.items() if e not in whole}
    return kept, jumps, common, others


def _squares_by_reaction(log: Log, drives: Drives, speeds: latency.Speeds) -> _Squares:
    """Squares of blocks that the best reaction leaves, their latencies, it, and whether its own is impossible."""
    best, apart = _reaction(drives, speeds)
    count = int(_reach(drives) / latency.STEP_S)
    latencies = best.latency_s + np.arange(-count, count + 1) * latency.STEP_S
    expected = latency.speeds_by_reaction(drives, speeds, best, latencies)
    return latency.squares_by_latency(log, drives, speeds, expected, count, latencies), latencies, best, apart


def _squares_by_model(
    log: Log, robot: Robot, speeds: latency.Speeds, latencies: Floats, model: Theta, most: float
) -> latency.Blocks | None:
    """Squares that a model leaves; None where that is more than `most` of the speeds' variances."""
    drives = gather(log, robot, log.episodes)
    late = latencies - expected_theta(model, drives.rate_hz).get("delay", 0.0)
    expected = latency.speeds_by_model(speeds, twists_of(drives, model)[..., ::2], late * drives.tick_hz)
    size = speeds.values.std(axis=0) + 1e-9
    left = [float((((speeds.values - one) / size) ** 2).sum(axis=1).mean()) for one in expected]
    usual = int(np.argmin(left))
    if left[usual] >= most:
        return None
    return latency.squares_by_latency(log, drives, speeds, expected, usual, latencies)


def _reach(drives: Drives) -> float:
    """Time by which clocks are looked for apart: no further than drives are long."""
    return float(np.clip(drives.last.max() / drives.tick_hz / 3.0, 0.5, FURTHEST_S))


def _offset(known: latency.Latency, besides: float) -> Offset:
    middle, half = known.value - besides, min(NORMAL_95 * known.deviation, FURTHEST_S)
    return Offset(middle, (middle - half, middle + half))


def _reaction(drives: Drives, speeds: latency.Speeds) -> tuple[latency.Reaction, bool]:
    """The best reaction; with a latency that no delay has only if that is clearly better, and whether it is."""
    most = PARAMETERS["delay"].high
    free = latency.reaction(drives, speeds, _reach(drives))
    if 0.0 <= free.latency_s <= most:
        return free, False
    usual = min((latency.reaction_at(drives, speeds, end) for end in (0.0, most)), key=lambda one: one.squares.sum())
    _, _, better = latency.sum_in_blocks(PROOF_BLOCK_S, drives, speeds, usual.squares - free.squares)
    sure = better.sum() > latency.SURE * np.sqrt(len(better)) * better.std()
    return (free, True) if sure else (usual, False)


LONGEST_S = 20.0
"""Rests are cut out if they last longer."""
BEFORE_S, AFTER_S = 1.0, 3.0
"""So much of a rest is kept before the next command and after the last one: the robot comes to a stop in it."""
REST = 1e-3
"""A command below this share of the largest is none."""


def cut_out_long_rests(log: Log) -> Log:
    """Cut a log at its long rests into drives of their own; the same log where there are none."""
    if log.command == "none":
        return log
    pieces = tuple(piece for episode in log.episodes for piece in _pieces(episode, log.rate_hz))
    whole = len(pieces) == len(log.episodes) and all(map(operator.is_, pieces, log.episodes))
    return log if whole else replace(log, episodes=pieces)


def _pieces(episode: LogEpisode, rate_hz: float) -> tuple[LogEpisode, ...]:
    size = np.abs(episode.held).max(axis=1)
    moving = np.flatnonzero(size > REST * size.max())
    if not len(moving):
        return (episode,)
    most, rows = LONGEST_S * rate_hz, len(episode.times)
    ends = np.flatnonzero(np.diff(moving) > most)
    begins = [int(row - BEFORE_S * rate_hz) for row in moving[[0, *(ends + 1)]]]
    stops = [int(row + AFTER_S * rate_hz) + 1 for row in moving[[*ends, -1]]]
    begins[0] = begins[0] if moving[0] > most else 0
    stops[-1] = stops[-1] if rows - 1 - moving[-1] > most else rows
    if (begins, stops) == ([0], [rows]):
        return (episode,)
    return tuple(_piece(episode, begin, stop) for begin, stop in zip(begins, stops, strict=True))


def _piece(episode: LogEpisode, begin: int, stop: int) -> LogEpisode:
    """Rows of an episode, with the commands that are in force in them."""
    times = episode.times[begin:stop]
    issued, commands = episode.issued, episode.commands[begin:stop]
    if issued is not None:
        first = max(0, int(np.searchsorted(issued, times[0] + 1e-9, side="right")) - 1)
        chosen = slice(first, int(np.searchsorted(issued, times[-1], side="right")))
        issued, commands = issued[chosen], episode.commands[chosen]
    wheels: Floats | None = None if episode.wheels is None else episode.wheels[begin:stop]
    name = f"{episode.name} from {times[0]:.0f} s"
    measured = episode.measured
    if measured is not None:
        own = (measured.rows >= begin) & (measured.rows < stop)
        measured = Measured(measured.times[own], measured.poses[own], measured.rows[own] - begin)
    return LogEpisode(name, times, commands, episode.poses[begin:stop], wheels, issued, measured)


MOST = 6000
"""No more increments are fitted: beyond, they hardly sharpen what is found, and cost in proportion."""
STRETCH_S = 6.0
"""Blocks are shortened no further than this, so that windows of prediction fit into them; else blocks are left out."""
FEWEST_BLOCKS = 16

JOINED_S = 0.1
"""Increments are joined up to this length; motors are slower."""


def thin(drives: Drives) -> Drives:
    """Thin drives to about MOST increments: join them, then keep a stretch of each block, then fewer blocks."""
    count = len(drives.episode)
    if count <= MOST:
        return drives
    usual = float(np.median(drives.last - drives.first)) / drives.tick_hz
    shorter = join_increments(drives, min(-(-count // MOST), max(1, round(JOINED_S / usual))))
    least = round(STRETCH_S * drives.tick_hz / float(np.median(shorter.last - shorter.first)))
    # Of each block one piece, somewhere within it.
    number = number_of(shorter.block)
    size = np.bincount(number)
    kept = np.minimum(size, np.maximum(np.ceil(min(1.0, MOST / len(shorter.episode)) * size).astype(int), least))
    # Multiples of the golden ratio spread stretches evenly, in step with nothing that drives repeat.
    spread = np.arange(len(size)) * 0.6180339887 % 1.0
    begin = (spread * (size - kept)).astype(int)
    chosen = spread < max(MOST / kept.sum(), FEWEST_BLOCKS / len(size))
    place = np.arange(len(shorter.block)) - np.searchsorted(number, number)
    return shorter.only(chosen[number] & (place >= begin[number]) & (place < (begin + kept)[number]))


def join_increments(drives: Drives, times: int) -> Drives:
    """Join every `times` increments in a row, within unbroken runs of poses and blocks."""
    if times == 1:
        return drives
    run = np.cumsum(~drives.linked | np.concatenate(([True], drives.block[1:] != drives.block[:-1])))
    place = np.arange(len(run)) - np.searchsorted(run, run)
    begins = np.flatnonzero(place % times == 0)
    ends = np.concatenate((begins[1:], [len(run)])) - 1
    whole = drives.only(np.isin(np.arange(len(run)), begins))
    poses = np.stack((drives.poses[begins, 0], drives.poses[ends, 1]), axis=1)
    travel = np.add.reduceat(drives.travel, begins)
    after = None if drives.after is None else np.stack((drives.after[begins, 0], drives.after[ends, 1]), axis=1)
    return replace(whole, last=drives.last[ends], poses=poses, travel=travel, linked=drives.linked[begins], after=after)


FEWEST_EPISODES = 6
"""With fewer, each episode is split by time: the first half is fitted, the second tested."""
LEAST_MOTION_S = 20.0
"""Less measured motion than this is not enough to fit, and as much again to test."""
MOST_S = 900.0
"""No more seconds are fitted where there are drives to choose from: every replay takes all of them."""
MOST_TESTED_S = 1800.0
"""No more seconds are tested on in the same way: the bullet plant drives them all, twice."""
BLOCKS = 16
"""Each part has at least about so many blocks, if they last BLOCK_S."""
TEST_BLOCK_S = 4.0
"""Blocks are no shorter, unless episodes are."""


class Parts(NamedTuple):
    """The drives to fit and the drives to test on."""

    fitted: Drives
    tested: Drives


def split(log: Log, robot: Robot, test: Log | None) -> Parts:
    """Keep every third episode to test on, of few the second half of each, or another log; too little is refused."""
    if test is not None:
        parts = Parts(*(gather(one, robot, one.episodes) for one in (log, test)))
    elif len(log.episodes) >= FEWEST_EPISODES:
        fitted = _choose_some([e for i, e in enumerate(log.episodes) if i % 3 != 2], MOST_S)
        parts = Parts(gather(log, robot, fitted), gather(log, robot, _choose_some(log.episodes[2::3], MOST_TESTED_S)))
    else:
        parts = _halve(gather(log, robot, log.episodes))
    for name, drives in zip(("fit", "test on"), parts, strict=True):
        if drives.seconds < LEAST_MOTION_S:
            problem = f"{log.name}: only {drives.seconds:.1f} s of measured motion to {name}"
            raise LogError(f"{problem}, at least {LEAST_MOTION_S:.0f} s are needed for each; record more episodes")
    return Parts(thin(cut_into_blocks(parts.fitted)), cut_into_blocks(parts.tested))


def _choose_some(chosen: Sequence[LogEpisode], most_s: float) -> list[LogEpisode]:
    """Choose some of these drives, spread evenly, of about so many seconds; the rest is not needed."""
    seconds = sum(float(episode.times[-1] - episode.times[0]) for episode in chosen)
    wanted = max(FEWEST_EPISODES, math.ceil(len(chosen) * min(1.0, most_s / max(seconds, 1.0))))
    count = min(len(chosen), wanted)
    return [chosen[number * len(chosen) // count] for number in range(count)]


def _halve(drives: Drives) -> Parts:
    early = np.zeros(len(drives.episode), dtype=bool)
    for episode in np.unique(drives.episode):
        own = drives.episode == episode
        gone = np.cumsum((drives.last - drives.first) * own)
        early |= own & (gone <= gone[-1] / 2.0)
    return Parts(drives.only(early), drives.only(~early))


def cut_into_blocks(drives: Drives) -> Drives:
    """Cut the episodes of drives into blocks until there are enough of them."""
    wanted = max(TEST_BLOCK_S, drives.seconds / BLOCKS)
    block = np.zeros(len(drives.episode), dtype=int)
    total = 0
    for episode in np.unique(drives.episode):
        own = np.flatnonzero(drives.episode == episode)
        lasts = drives.last[own] - drives.first[own]
        pieces = max(1, math.floor(lasts.sum() / drives.tick_hz / wanted))
        block[own] = total + (np.cumsum(lasts) - lasts) * pieces // lasts.sum()
        total += pieces
    _, block = np.unique(block, return_inverse=True)
    return replace(drives, block=block, linked=drives.linked & np.concatenate(([False], block[1:] == block[:-1])))
