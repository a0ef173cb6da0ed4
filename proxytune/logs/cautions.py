"""What a log says that is allowed and probably not meant, a sentence each: axes, units, copies, names.

Whole drives are looked at as `read_log` gives them, so that `import` and `diagnose` tell the same.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from proxytune.arrays import Floats
from proxytune.logs.log import CAR_COMMANDS, COMMANDS, Log, LogEpisode
from proxytune.logs.outliers import outliers_note, without_outliers
from proxytune.logs.repeats import repeats_note
from proxytune.logs.windows import windows_note
from proxytune.settings import GEOMETRY, alike_caution, figure_cautions

Figures = Mapping[str, float]
"""Of a robot, by the names of robot.toml: wheel_radius, effective_baseline [m], full_speed [m/s]."""
CHORD_S = 0.2
"""Motion is taken along chords of this length: noise of poses is none."""
MOVES = 0.3
"""A chord counts from this share of the fast ones on."""
TURNED = 0.8
"""Headings that point less alike than this (1: all the same way) can tell a mirrored axis."""
FITS, BY_MORE = 0.85, 0.3
"""Headings and courses belong together above the one (1: exactly); those of a mirror image if by so much more."""
LATEST_S = 1.5
"""Turning is looked for so long after its command."""
AGAINST = 0.5
"""A correlation below its negative is turning the other way."""
EXCHANGED = 0.7
"""A correlation above it is turning by the command that is not for turning."""
ASKEW_DEG = 40.0
"""Trackers' frames are turned by less where nobody meant it otherwise."""
JUMP_M, JUMP = 0.5, 5.0
"""A chord that is longer, and so many times a fast one, was not driven."""
FROZEN_S, STILL_M_S = 2.0, 0.02
"""Longer than a cut-out of the motors; slower than any drive."""
SLOWEST_TURN, FASTEST_TURN = 0.1, 5.0
"""Skid steering loses less; degrees are 57 to a radian."""
FASTER, SLOWER = 1.75, 0.5
"""Gains of motors, slip and dead bands stay within; a duty of another scale, or a speed in another unit, does not."""
HELD_S = 0.7
"""Motors have followed a command that has been as large for so long."""
LARGE = 0.6
"""Of the largest commands: dead bands and friction take less of these."""
ENOUGH = 20
"""Chords."""


def log_cautions(log: Log, figures: Figures) -> tuple[str, ...]:
    """Sentences on what is probably not meant in a log; figures of its robot tell how far commands should take it."""
    chords = [_chords(without_outliers(episode)) for episode in log.episodes]
    names = alike_caution("drives", (episode.name for episode in log.episodes))
    return (
        *figure_cautions({**log.geometry, **figures}, f"robot {log.robot}"),
        *_unused(log, figures),
        *_axes(chords),
        *_jumps(log, chords),
        *([] if log.command == "none" else _obedience(log, chords, figures)),
        *([names] if names else []),
        *_copies(log),
        *outliers_note(log),
        *repeats_note(log),
        *windows_note(log),
    )


def _unused(log: Log, figures: Figures) -> Iterator[str]:
    """Tell figures that log.toml states and its robot has otherwise: the robot's count."""
    for key, figure in GEOMETRY.items():
        stated = log.geometry.get(figure, np.nan)
        if abs(stated - figures.get(figure, np.nan)) > 1e-6 * stated:
            counts = f"its robot's own {figures[figure]:g} counts; leave it out, or put that right"
            yield f"log.toml states {key} = {stated:g}, which is not used: {counts}"


class Chords(NamedTuple):
    """Motion of a drive over CHORD_S each, all (N,): when it begins [s], its speed [m/s] and yaw rate [rad/s].

    The course is where it leads, the heading where the robot points in its middle [rad].
    """

    times: Floats
    course: Floats
    heading: Floats
    speed: Floats
    turn: Floats


def _chords(episode: LogEpisode) -> Chords:
    times, poses = episode.measured_poses
    later = np.searchsorted(times, times + CHORD_S - 1e-9)
    here = np.flatnonzero(later < len(times))
    later = later[here]
    lasts = times[later] - times[here]
    short = lasts < 2.0 * CHORD_S
    here, later, lasts = here[short], later[short], lasts[short]
    moved = poses[later] - poses[here]
    heading = (poses[later, 2] + poses[here, 2]) / 2.0
    course = np.arctan2(moved[:, 1], moved[:, 0])
    return Chords(times[here], course, heading, np.hypot(moved[:, 0], moved[:, 1]) / lasts, moved[:, 2] / lasts)


def _axes(drives: list[Chords]) -> Iterator[str]:
    """Tell where the robot moves in a mirror: x or y reversed, or exchanged, and headings not."""
    names = ("speed", "course", "heading")
    speed, course, heading = (np.concatenate([getattr(one, name) for one in drives]) for name in names)
    if len(speed) < ENOUGH:
        return
    moves = speed >= max(MOVES * float(np.quantile(speed, 0.9)), 1e-9)
    if not moves.any():
        return
    course, heading = course[moves], heading[moves]
    # Doubled angles: backwards is as good as forwards
    together, mirrored, spread = (
        float(np.abs(np.mean(np.exp(2j * angle)))) for angle in (course - heading, course + heading, heading)
    )
    if spread < TURNED and mirrored > max(FITS, together + BY_MORE):
        remedy = "reverse x or y, or exchange them, so that headings turn from x to y"
        yield f"places are mirrored against headings: the robot moves where a mirror image of it points; {remedy}"
    askew = math.degrees(float(np.angle(np.mean(np.exp(2j * (course - heading)))))) / 2.0
    if spread < TURNED and together > FITS and abs(askew) > ASKEW_DEG:
        remedy = "headings grow from x to y and are 0 along x; turn them, or the places"
        yield f"the robot moves at {abs(askew):.0f}° to where its headings point: {remedy}"


def _jumps(log: Log, drives: list[Chords]) -> Iterator[str]:
    """Tell where a drive is all at once elsewhere."""
    for episode, chords in zip(log.episodes, drives, strict=True):
        usual = float(np.quantile(chords.speed, 0.9)) if len(chords.speed) >= ENOUGH else np.inf
        if chords.speed.max(initial=0.0) * CHORD_S > max(JUMP_M, JUMP * usual * CHORD_S):
            at = int(np.argmax(chords.speed))
            jump, after = chords.speed[at] * CHORD_S, chords.times[at] - chords.times[0]
            why = "the tracker took something else for it, or two drives are one; cut there"
            yield f"drive '{episode.name}' jumps by {jump:.2g} m after {after:.4g} s: {why}"
            return


def _obedience(log: Log, drives: list[Chords], figures: Figures) -> Iterator[str]:
    """Compare what was driven with what was asked for."""
    asked = _commanded(log, figures)
    driven = max((float(np.quantile(one.speed, 0.9)) for one in drives if len(one.speed)), default=0.0)
    if driven > STILL_M_S and not any(episode.commands.any() for episode in log.episodes):
        yield f"the robot drives at {driven:.2g} m/s, and every command is zero: take what moved it"
        return
    yield from _turning(log, drives)
    if np.isfinite(np.concatenate([speed for speed, _ in asked])).all():
        yield from _backwards(log, drives, asked)
        yield from [*_frozen(log, asked)] or _speeds(log, drives, asked)


def _backwards(log: Log, drives: list[Chords], asked: Sequence[tuple[Floats, Floats]]) -> Iterator[str]:
    """Tell where it goes back when it is told to go on."""
    along = [one.speed * np.cos(one.course - one.heading) for one in drives]
    wanted = [
        np.interp(one.times, episode.times, speed)
        for episode, one, (speed, _) in zip(log.episodes, drives, asked, strict=True)
    ]
    done, said = np.concatenate(along), np.concatenate(wanted)
    size = float(np.linalg.norm(done) * np.linalg.norm(said))
    if len(done) >= ENOUGH and size > 0.0 and float(done @ said) < -AGAINST * size:
        yield "the robot drives backwards where its commands say forwards: turn the sign of v, or headings, around"


def _frozen(log: Log, asked: Sequence[tuple[Floats, Floats]]) -> Iterator[str]:
    """Tell where poses stay the same to the last digit while it is told to drive on."""
    large = LARGE * float(np.quantile(np.abs(np.concatenate([speed for speed, _ in asked])), 0.95))
    for episode, (speed, _) in zip(log.episodes, asked, strict=True):
        times, poses = episode.measured_poses
        driving = np.interp(times, episode.times, np.abs(speed)) > max(large, 1e-9)
        changes = np.flatnonzero(np.append(len(poses) > 0, (np.diff(poses, axis=0) != 0.0).any(axis=1)))
        ends = np.append(changes, len(times))[1:]
        for first, end in zip(changes, ends, strict=True):
            lasts = float(times[end - 1] - times[first])
            if lasts > FROZEN_S and driving[first:end].mean() * lasts > FROZEN_S:
                keeps = f"keeps one pose to the last digit for {lasts:.2g} s, from {times[first] - times[0]:.4g} s on"
                why = "while its commands go on: a tracker that lost the robot; cut it there"
                yield f"drive '{episode.name}' {keeps}, {why}"
                return


def _commanded(log: Log, figures: Figures) -> list[tuple[Floats, Floats]]:
    """What each drive's commands ask for at its samples: speed [m/s], NaN if not known, and turning in any unit."""
    held = [episode.held for episode in log.episodes]
    if log.command in ("duty", "wheel_speed"):
        figure = "full_speed" if log.command == "duty" else "wheel_radius"
        scale = {**log.geometry, **figures}.get(figure, np.nan)
        return [(scale * wheels.mean(axis=1), wheels[:, 1] - wheels[:, 0]) for wheels in held]
    # Throttle is no speed: a car's motor does nothing for small ones.
    scale = np.nan if log.command == "ackermann" else 1.0
    return [(scale * drives, turns) for drives, turns in (commands.T for commands in held)]


def _turning(log: Log, drives: list[Chords]) -> Iterator[str]:
    """Tell where it turns the other way than its commands ask, or by the command that is not for turning."""
    strongest, gain = _correlation(log, drives, [turn for _, turn in _commanded(log, {})])
    if strongest > AGAINST and log.command == "twist" and not SLOWEST_TURN < gain < FASTEST_TURN:
        yield f"the robot turns {gain:.2g} times as fast as its commands say: check the unit of omega, rad/s"
    if strongest < -AGAINST:
        why = "headings that grow clockwise, a mirrored axis, or left and right exchanged"
        yield f"the robot turns the other way than its commands say (correlation {strongest:.2f}): {why}"
    if log.command in ("twist", *CAR_COMMANDS):
        driving, turning = COMMANDS[log.command]
        other, _ = _correlation(log, drives, [episode.held[:, 0] for episode in log.episodes])
        if abs(other) > EXCHANGED and abs(strongest) < AGAINST:
            both = f"{driving} (correlation {other:.2f}) and not with {turning} ({strongest:.2f})"
            yield f"the robot turns with {both}: are the two exchanged?"


def _correlation(log: Log, drives: list[Chords], turns: Sequence[Floats]) -> tuple[float, float]:
    """Correlation of turning with a command at the delay where it is strongest, and rad/s for one of the command."""
    lags = np.arange(0.0, LATEST_S, 0.1)
    found = np.zeros((len(lags), 3))
    for episode, chords, turn in zip(log.episodes, drives, turns, strict=True):
        if len(chords.times) < ENOUGH:
            continue
        asked = np.stack([np.interp(chords.times + CHORD_S / 2.0 - lag, episode.times, turn) for lag in lags])
        asked = asked - asked.mean(axis=1, keepdims=True)
        done = chords.turn - chords.turn.mean()
        found += np.stack((asked @ done, (asked**2).sum(axis=1), np.full(len(lags), done @ done)), axis=1)
    sizes = np.sqrt(found[:, 1] * found[:, 2])
    if not sizes.any():
        return 0.0, 0.0
    correlation = found[:, 0] / np.where(sizes > 0.0, sizes, 1.0)
    at = int(np.argmax(np.abs(correlation)))
    return float(correlation[at]), float(found[at, 0] / found[at, 1])


def _speeds(log: Log, drives: list[Chords], asked: Sequence[tuple[Floats, Floats]]) -> Iterator[str]:
    """Tell where large commands, held for a while, take it much further or less far than they ask for."""
    ratios = []
    for episode, chords, (wanted, _) in zip(log.episodes, drives, asked, strict=True):
        size = np.abs(wanted)
        if not len(chords.times) or not size.any():
            continue
        at = [np.interp(chords.times + shift, episode.times, size) for shift in (CHORD_S, 0.0, -HELD_S / 2.0, -HELD_S)]
        least, most = np.min(at, axis=0), np.max(at, axis=0)
        held = (least >= LARGE * np.quantile(size, 0.95)) & (most <= 1.2 * least)
        ratios.append(chords.speed[held] / np.mean(at, axis=0)[held])
    found = np.concatenate(ratios) if ratios else np.empty(0)
    if len(found) < ENOUGH:
        return
    ratio = float(np.median(found))
    if not SLOWER < ratio < FASTER:
        unit = {
            "duty": "duties of -1 to 1 at full duty, and full_speed",
            "twist": "the unit of v",
            "speed_steering": "the unit of speed",
            "wheel_speed": "wheel speeds in rad/s, and wheel_radius",
        }[log.command]
        yield f"the robot drives {ratio:.2g} times as fast as its largest commands say: check {unit}"


def _copies(log: Log) -> Iterator[str]:
    """Tell of drives that are others to the last digit."""
    first: dict[bytes, str] = {}
    copies = []
    for episode in log.episodes:
        known = episode.poses[np.isfinite(episode.poses[:, 0])]
        if len(known) > 1 and np.ptp(known, axis=0).any():
            other = first.setdefault(episode.commands.tobytes() + known.tobytes(), episode.name)
            copies += [(episode.name, other)] if other != episode.name else []
    if copies:
        one, other = copies[0]
        more = f" (and {len(copies) - 1} more copies)" if len(copies) > 1 else ""
        yield f"drive '{one}' is a copy of '{other}' to the last digit{more}; give each once, or intervals shrink"
