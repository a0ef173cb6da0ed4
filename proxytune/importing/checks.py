"""What is wrong, or worth knowing, about the stamps and poses of a drive; what can be mended is."""

import math
from dataclasses import replace

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.orientation import MOST_LACKING
from proxytune.importing.source import Commands, Drive, Floats, Poses

FURTHEST_BACK_S = 0.5
"""Messages may arrive in another order than they were stamped in; a longer step back is a clock set anew."""

TILT_DEG = 25.0
"""No wheeled robot leans so far for most of a drive: its frame, or the world's, is not z-up."""

FLAT_M = 0.3
"""No floor goes up and down by more: heights that do are another axis."""

PLAUSIBLE_S = 946684800.0
"""2000-01-01: stamps between a day after 1970 and this are of a clock that was never set."""


def checked_drive(drive: Drive, where: str, offset_s: float = 0.0) -> tuple[Drive, list[str]]:
    """A drive with stamps in order and without repeats, and what was found, a sentence each.

    Args:
        drive: As an importer has read it.
        where: The source, as a complaint names it.
        offset_s: How much later poses are stamped than commands, as far as that is known [s].

    Raises:
        LogError: If stamps jump back, all are equal, poses are not z-up, or commands and poses are of different times.
    """
    about = f"{where}: drive {drive.name}"
    poses, notes = _ordered_poses(drive.poses, about)
    _check_upright(poses, about)
    commands = drive.commands
    if commands is not None:
        commands, more = _ordered_commands(commands, about)
        notes += more
        _check_overlap(commands.times + offset_s, poses.times, about)
    return replace(drive, poses=poses, commands=commands), [f"drive {drive.name}: {note}" for note in notes]


def _ordered_poses(poses: Poses, about: str) -> tuple[Poses, list[str]]:
    """Poses by time, the first of several with one stamp."""
    poses, lacking = _whole_poses(poses, about)
    kept, notes = _order(poses.times, "poses", about, last=False)
    notes = lacking + notes
    if len(kept) < 2:
        raise LogError(f"{about}: only {len(kept)} of its poses have a time of their own; a drive needs two or more")
    return poses.only(kept), notes


def _whole_poses(poses: Poses, about: str) -> tuple[Poses, list[str]]:
    """Poses without those that lack a number or an orientation."""
    parts = (poses.times, poses.places, poses.headings, poses.tilts)
    whole = np.asarray(np.isfinite(np.column_stack(parts)).all(axis=1))
    lacking = int((~whole).sum())
    if lacking > MOST_LACKING * len(whole):
        number = int(np.argmin(whole)) + 1
        what = f"{lacking} of its {len(whole)} poses, first number {number}, are no pose"
        raise LogError(f"{about}: {what}; record it again")
    notes = [f"{lacking} poses without a place or an orientation were left out"] if lacking else []
    return poses.only(whole), notes


def _ordered_commands(commands: Commands, about: str) -> tuple[Commands, list[str]]:
    """Commands by time, the last of several with one stamp: it is the one that was held."""
    kept, notes = _order(commands.times, "commands", about, last=True)
    return replace(commands, times=commands.times[kept], values=commands.values[kept]), notes


def _order(times: Floats, what: str, about: str, *, last: bool) -> tuple[np.ndarray, list[str]]:
    """The numbers of what is kept, by time, and notes of what was wrong."""
    if not len(times):
        raise LogError(f"{about}: has no {what}; record them, or name another topic")
    steps = np.diff(times)
    furthest = float(-steps.min(initial=0.0))
    if furthest > FURTHEST_BACK_S:
        number = int(np.argmin(steps)) + 1
        raise LogError(
            f"{about}: the stamps of its {what} go back by {furthest:.3g} s at number {number + 1}: a clock was set "
            "anew; use --stamps receive, or cut the recording there"
        )
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


def _check_upright(poses: Poses, about: str) -> None:
    """Refuse poses whose upward axis is not z."""
    tilt = math.degrees(float(np.median(poses.tilts)))
    if tilt > TILT_DEG:
        raise LogError(
            f"{about}: the robot's z axis lies {tilt:.0f}° from the world's for half of the drive; poses must be z-up "
            "(x forward, y left): turn the rigid body or the world in the tracker, and export again"
        )
    spans = np.ptp(poses.places, axis=0)
    if spans[2] > FLAT_M and spans[2] > spans[:2].min():
        raise LogError(
            f"{about}: z varies by {spans[2]:.2f} m, {'xy'[int(spans[:2].argmin())]} only by {spans[:2].min():.2f} m: "
            "the world is not z-up; export poses with z upwards"
        )


def _check_overlap(commands: Floats, poses: Floats, about: str) -> None:
    """Refuse commands and poses of different times."""
    if commands[0] >= poses[-1] or commands[-1] < poses[0]:
        raise LogError(
            f"{about}: commands lie between {commands[0]:.3f} and {commands[-1]:.3f} s, poses between {poses[0]:.3f} "
            f"and {poses[-1]:.3f} s: two clocks; use --stamps receive, or say how far apart they are by --clock-offset"
        )
