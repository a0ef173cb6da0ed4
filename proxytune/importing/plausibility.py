"""Units that cannot be: a robot that drives at hundreds of metres a second is measured in millimetres."""

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.source import Commands, Drive, Floats, Poses

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
    """Refuse a drive whose times, places or commands are plainly in another unit.

    Raises:
        LogError: With what is odd, and how units are stated.
    """
    about = f"{where}: drive {drive.name}"
    times = drive.poses.times
    lasts = float(times[-1] - times[0])
    if lasts < SHORTEST_S:
        short = f"takes {lasts:.3g} s with {len(times)} poses"
        raise LogError(f"{about}: {short}; state the unit of time (--columns time=t:ms)")
    usual = float(np.median(np.diff(times)))
    if lasts > SPARSEST * usual * len(times):
        raise LogError(
            f"{about}: takes {lasts:.4g} s with {len(times)} poses usually {usual:.3g} s apart; leave out wrong "
            "stamps, cut it at its gaps, or state the unit of time (--columns time=t:ms)"
        )
    speed = _usual_speed(drive.poses)
    if speed > FASTEST_M_S:
        raise LogError(f"{about}: drives at {speed:.3g} m/s; state the units of x, y and time (--columns x=pos_x:mm)")
    if drive.commands is not None:
        _check_commands(drive.commands, drive.poses, about)


def _check_commands(commands: Commands, poses: Poses, about: str) -> None:
    most = float(np.percentile(np.abs(commands.values[:, 0]), 95))
    if commands.kind == "wheel_speed" and most > FASTEST_WHEEL_RAD_S:
        raise LogError(f"{about}: asks a wheel for {most:.3g} rad/s; state the unit of its commands")
    if commands.kind != "twist":
        return
    if most > FASTEST_M_S:
        raise LogError(f"{about}: asks for {most:.3g} m/s; state the unit of its commands (--columns v=cmd_lin:mm/s)")
    asked, driven = _commanded_way(commands, poses.times[-1]), _driven_way(poses)
    if min(asked, driven) > MOVED_M / APART and max(asked, driven) > max(MOVED_M, APART * min(asked, driven)):
        raise LogError(
            f"{about}: the poses say that it drove {driven:.3g} m where its commands say {asked:.3g} m; state the "
            "units of both (--columns x=pos_x:mm,v=cmd_lin:mm/s)"
        )


def _usual_speed(poses: Poses) -> float:
    """The speed [m/s] that is exceeded for a tenth of the drive."""
    later = np.searchsorted(poses.times, poses.times + CHORD_S)
    here = np.flatnonzero(later < len(poses.times))
    if not len(here):
        return 0.0
    chords = poses.places[later[here], :2] - poses.places[here, :2]
    return float(np.percentile(np.hypot(*chords.T) / (poses.times[later[here]] - poses.times[here]), 90))


def _driven_way(poses: Poses) -> float:
    """The way along chords of CHORD_S [m]."""
    grid = np.arange(poses.times[0], poses.times[-1], CHORD_S)
    x, y = (np.interp(grid, poses.times, column) for column in poses.places[:, :2].T)
    return float(np.hypot(np.diff(x), np.diff(y)).sum())


def _commanded_way(commands: Commands, end: float) -> float:
    lasts: Floats = np.clip(np.diff(np.append(commands.times, max(end, commands.times[-1]))), 0.0, 1.0)
    return float((np.abs(commands.values[:, 0]) * lasts).sum())
