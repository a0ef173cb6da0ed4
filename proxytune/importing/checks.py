"""Checks of the stamps, poses and units of a drive; what can be mended is.

A robot that drives at hundreds of metres a second is measured in millimetres. Quaternions may have any length but none.
The lag of a robot's turning behind its commands, by cross-correlation, shows two clocks before anything is fitted.
"""

import math
from dataclasses import replace

import numpy as np
from scipy.signal import correlate, correlation_lags

from proxytune.arrays import Flags, Floats
from proxytune.errors import LogError
from proxytune.importing.source import Commands, Drive, Poses
from proxytune.logs import LARGEST

FASTEST_M_S = 40.0
"""No wheeled robot drives faster."""
FASTEST_WHEEL_RAD_S = 2000.0
SHORTEST_S = 1.0
"""A drive that takes less is one whose times are in another unit."""
CHORD_S = 0.2
"""Speeds are taken over so long: noise of poses is none."""
APART = 50.0
"""Commanded and measured ways may differ by slip and gears, but not by such a factor."""
MOVED_M = 0.1
SPARSEST = 20.0
"""A drive that lasts this many times as long as its poses at their usual interval has stamps of another unit."""


def check_units(drive: Drive, where: str) -> None:
    """Refuse a drive whose times, places or commands are plainly in another unit."""
    about = f"{where}: drive {drive.name}"
    times = drive.poses.times
    lasts = float(times[-1] - times[0])
    if lasts < SHORTEST_S:
        short = f"takes {lasts:.3g} s with {len(times)} poses"
        raise LogError(f"{about}: {short}; state the unit of time (--columns time=t:ms)")
    usual = float(np.median(np.diff(times)))
    if lasts > SPARSEST * usual * len(times):
        sparse = f"takes {lasts:.4g} s with {len(times)} poses usually {usual:.3g} s apart"
        remedy = "leave out wrong stamps, cut it at its gaps, or state the unit of time (--columns time=t:ms)"
        raise LogError(f"{about}: {sparse}; {remedy}")
    speed = _usual_speed(drive.poses)
    if speed > FASTEST_M_S:
        raise LogError(f"{about}: drives at {speed:.3g} m/s; state the units of x, y and time (--columns x=pos_x:mm)")
    if drive.wheels is not None:
        fastest = float(np.percentile(np.abs(drive.wheels.speeds), 95))
        if fastest > FASTEST_WHEEL_RAD_S:
            remedy = "state their unit (--columns wheel_left=left_ticks:ticks/4096)"
            raise LogError(f"{about}: its wheels turn at {fastest:.3g} rad/s; {remedy}")
    if drive.commands is not None:
        _check_commands(drive.commands, drive.poses, about)


def _check_commands(commands: Commands, poses: Poses, about: str) -> None:
    most = float(np.percentile(np.abs(commands.values[:, 0]), 95))
    if commands.kind == "wheel_speed" and most > FASTEST_WHEEL_RAD_S:
        raise LogError(f"{about}: asks a wheel for {most:.3g} rad/s; state the unit of its commands")
    if commands.kind not in ("twist", "speed_steering"):
        return
    if most > FASTEST_M_S:
        raise LogError(f"{about}: asks for {most:.3g} m/s; state the unit of its commands (--columns v=cmd_lin:mm/s)")
    lasts: Floats = np.clip(np.diff(np.append(commands.times, max(poses.times[-1], commands.times[-1]))), 0.0, 1.0)
    asked = float((np.abs(commands.values[:, 0]) * lasts).sum())
    # The way driven is taken along chords of CHORD_S.
    grid = np.arange(poses.times[0], poses.times[-1], CHORD_S)
    x, y = (np.interp(grid, poses.times, column) for column in poses.places[:, :2].T)
    driven = float(np.hypot(np.diff(x), np.diff(y)).sum())
    if min(asked, driven) > MOVED_M / APART and max(asked, driven) > max(MOVED_M, APART * min(asked, driven)):
        apart = f"the poses say that it drove {driven:.3g} m where its commands say {asked:.3g} m"
        raise LogError(f"{about}: {apart}; state the units of both (--columns x=pos_x:mm,v=cmd_lin:mm/s)")


def _usual_speed(poses: Poses) -> float:
    """The speed [m/s] that is exceeded for a tenth of a drive that lasts longer than a chord."""
    later = np.searchsorted(poses.times, poses.times + CHORD_S)
    here = np.flatnonzero(later < len(poses.times))
    chords = poses.places[later[here], :2] - poses.places[here, :2]
    return float(np.percentile(np.hypot(*chords.T) / (poses.times[later[here]] - poses.times[here]), 90))


LEAST_NORM = 1e-3
"""A shorter quaternion is no orientation: drivers publish zeros before they know one."""
MOST_LACKING = 0.1
"""A tracker that loses its markers now and then lacks no more of its poses than this share."""


def headings_and_tilts(quaternions: Floats, where: str) -> tuple[Floats, Floats]:
    """Headings about the upward axis and tilts away from it, (N,) each [rad]; NaN where a few are no rotation.

    Quaternions (N, 4) are x, y, z, w in the world.
    """
    wrong = no_rotation(quaternions)
    if wrong.mean() > MOST_LACKING:
        raise complaint(quaternions, wrong, where)
    known = np.where(wrong[:, None], np.nan, quaternions)
    x, y, z, w = (known / np.linalg.norm(known, axis=1, keepdims=True)).T
    headings = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    tilts = np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))
    return headings, tilts


def no_rotation(quaternions: Floats) -> Flags:
    """True for quaternions that are not finite or of length zero (N,)."""
    with np.errstate(over="ignore", invalid="ignore"):
        norms = np.linalg.norm(quaternions, axis=1)
    return np.asarray(~(np.isfinite(norms) & (norms > LEAST_NORM)))


def complaint(quaternions: Floats, wrong: Flags, where: str) -> LogError:
    """The complaint about the first of those that are wrong."""
    number = int(np.argmax(wrong))
    values = ", ".join(f"{value:g}" for value in quaternions[number])
    others = f"which is no rotation, and so are {wrong.sum()} of {len(wrong)}; record poses whose orientation is set"
    return LogError(f"{where}: orientation {number + 1} is the quaternion ({values}), {others}")


FURTHEST_BACK_S = 0.5
"""Messages may arrive in another order than they were stamped in; a longer step back is a clock set anew."""
TILT_DEG = 25.0
"""No wheeled robot leans so far for most of a drive: its frame, or the world's, is not z-up."""
FLAT_M = 0.3
"""No floor goes up and down by more: heights that do are another axis."""
PLAUSIBLE_S = 946684800.0
"""2000-01-01: stamps between a day after 1970 and this are of a clock that was never set."""


def checked_drive(drive: Drive, where: str, offset_s: float = 0.0) -> tuple[Drive, list[str]]:
    """A drive with stamps in order and without repeats, and what was found; poses are known to be stamped so late."""
    about = f"{where}: drive {drive.name}"
    _check_sizes((drive.poses.times, drive.poses.places), "poses", about)
    poses, notes = _ordered_poses(drive.poses, about)
    tilt, spans = math.degrees(float(np.median(poses.tilts))), np.ptp(poses.places, axis=0)
    if tilt > TILT_DEG:
        lies = f"the robot's z axis lies {tilt:.0f}° from the world's for half of the drive"
        remedy = "turn the rigid body or the world in the tracker, and export again"
        raise LogError(f"{about}: {lies}; poses must be z-up (x forward, y left): {remedy}")
    if spans[2] > FLAT_M and spans[2] > spans[:2].min():
        other = f"{'xy'[int(spans[:2].argmin())]} only by {spans[:2].min():.2f} m"
        remedy = "the world is not z-up; export poses with z upwards"
        raise LogError(f"{about}: z varies by {spans[2]:.2f} m, {other}: {remedy}")
    commands = drive.commands
    if commands is not None:
        _check_sizes((commands.times, commands.values), "commands", about)
        # Of several commands with one stamp, the last is the one that was held.
        kept, more = _order(commands.times, "commands", about, last=True)
        commands = replace(commands, times=commands.times[kept], values=commands.values[kept])
        notes += more
        first, last = (float(end + offset_s) for end in commands.times[[0, -1]])
        begin, end = poses.times[0], poses.times[-1]
        if first >= end or last < begin:
            apart = f"commands lie between {first:.3f} and {last:.3f} s, poses between {begin:.3f} and {end:.3f} s"
            remedy = "use --stamps receive, or say how far apart they are by --clock-offset"
            raise LogError(f"{about}: {apart}: two clocks; {remedy}")
    return replace(drive, poses=poses, commands=commands), [f"drive {drive.name}: {note}" for note in notes]


def _check_sizes(parts: tuple[Floats, ...], what: str, about: str) -> None:
    """Refuse numbers that are none of a robot: the square of their square would not be finite."""
    values = np.concatenate([np.ravel(part) for part in parts])
    large = values[np.abs(values) > LARGEST]  # NaN is none: what was not measured is told of elsewhere
    if len(large):
        raise LogError(f"{about}: its {what} hold the number {large[0]:g}; leave out what was not measured")


def _ordered_poses(poses: Poses, about: str) -> tuple[Poses, list[str]]:
    """Poses by time, the first of several with one stamp, without those that lack a number or an orientation."""
    parts = (poses.times, poses.places, poses.headings, poses.tilts)
    whole = np.asarray(np.isfinite(np.column_stack(parts)).all(axis=1))
    lacking = int((~whole).sum())
    if lacking > MOST_LACKING * len(whole):
        number = int(np.argmin(whole)) + 1
        what = f"{lacking} of its {len(whole)} poses, first number {number}, are no pose"
        raise LogError(f"{about}: {what}; record it again")
    poses = poses.only(whole)
    kept, notes = _order(poses.times, "poses", about, last=False)
    if lacking:
        notes = [f"{lacking} poses without a place or an orientation were left out", *notes]
    if len(kept) < 2:
        raise LogError(f"{about}: only {len(kept)} of its poses have a time of their own; a drive needs two or more")
    return poses.only(kept), notes


def _order(times: Floats, what: str, about: str, *, last: bool) -> tuple[np.ndarray, list[str]]:
    """The numbers of what is kept, by time, and notes of what was wrong."""
    if not len(times):
        raise LogError(f"{about}: has no {what}; record them, or name another topic")
    steps = np.diff(times)
    furthest = float(-steps.min(initial=0.0))
    if furthest > FURTHEST_BACK_S:
        number = int(np.argmin(steps)) + 1
        back = f"the stamps of its {what} go back by {furthest:.3g} s at number {number + 1}"
        raise LogError(f"{about}: {back}: a clock was set anew; use --stamps receive, or cut the recording there")
    order = np.argsort(times, kind="stable")
    sorted_times = times[order]
    repeats = np.diff(sorted_times) == 0.0
    kept = order[np.append(~repeats, True)] if last else order[np.append(True, ~repeats)]
    notes = []
    if (steps < 0.0).any():
        notes.append(f"{int((steps < 0.0).sum())} {what} came after later ones (by up to {furthest:.3g} s); sorted")
    if repeats.any():
        kind = "last" if last else "first"
        notes.append(f"{int(repeats.sum())} {what} repeat a stamp; the {kind} of each was kept")
    if sorted_times[-1] > 86400.0 and sorted_times[0] < PLAUSIBLE_S:
        notes.append(f"the stamps of its {what} lie before the year 2000: their clock was not set")
    return kept, notes


STEP_S = 0.01
FURTHEST_S = 2.0
"""Answers are looked for so far from their commands."""
CLEAR = 0.4
"""A correlation below this tells no lag."""
SMOOTH_S = 0.1
"""Measured turns are taken over so long."""


def lag_of(drive: Drive) -> float | None:
    """The lag of measured behind commanded turning [s], below 0 where it comes before; None where nothing tells it."""
    if (commands := drive.commands) is None:
        return None
    times = np.arange(drive.poses.times[0], drive.poses.times[-1], STEP_S)
    if len(times) * STEP_S < 3.0 * FURTHEST_S:
        return None
    held = commands.values[np.maximum(np.searchsorted(commands.times, times, side="right") - 1, 0)]
    turn = held[:, 1] - held[:, 0] if commands.kind in ("duty", "wheel_speed") else held[:, 1]
    heading = np.interp(times, drive.poses.times, np.unwrap(drive.poses.headings))
    half = round(SMOOTH_S / STEP_S / 2.0)
    rate = np.zeros(len(times))
    rate[half:-half] = heading[2 * half :] - heading[: -2 * half]
    # In whatever unit, the means taken out
    commanded, measured = turn - turn.mean(), rate - rate.mean()
    size = np.linalg.norm(commanded) * np.linalg.norm(measured)
    if not size > 0.0:
        return None
    lags = correlation_lags(len(measured), len(commanded)) * STEP_S
    strength = correlate(measured, commanded) / size
    near = np.abs(lags) <= FURTHEST_S
    best = int(np.argmax(strength[near]))
    return float(lags[near][best]) if strength[near][best] > CLEAR else None
