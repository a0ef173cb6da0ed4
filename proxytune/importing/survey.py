"""A drive in numbers: how long, how often measured, what dropped out, and when it answers its commands."""

from collections.abc import Sequence

import numpy as np

from proxytune.importing.reaction import reaction_of
from proxytune.importing.source import Drive, Floats, Survey

GAP_S = 0.5
"""A longer time without a pose is a gap."""


def survey(drive: Drive) -> Survey:
    """The numbers of a drive whose stamps are in order."""
    times = drive.poses.times
    steps = np.diff(times)
    usual = float(np.median(steps))
    gaps = steps[steps > max(GAP_S, 3.0 * usual)]
    answer = reaction_of(drive)
    return Survey(
        name=drive.name,
        seconds=float(times[-1] - times[0]),
        poses=len(times),
        poses_hz=1.0 / usual,
        lost=_lost(steps, usual),
        gaps=len(gaps),
        longest_gap_s=float(gaps.max(initial=0.0)),
        jitter_s=float(steps[steps < 1.5 * usual].std()),
        commands=0 if drive.commands is None else len(drive.commands.times),
        frames=0 if drive.pictures is None else len(drive.pictures.times),
        lag_s=None if answer is None else answer.lag_s,
    )


def _lost(steps: Floats, usual: float) -> float:
    missing = float(np.maximum(np.rint(steps / usual) - 1.0, 0.0)[steps <= GAP_S].sum())
    return missing / (missing + len(steps) + 1)


def clock_notes(drives: Sequence[Survey]) -> list[str]:
    """What the lags say of the clocks of commands and poses, in a sentence."""
    lags = [(one.lag_s, one.name) for one in drives if one.lag_s is not None]
    early = [pair for pair in lags if pair[0] < 0.0]
    if early:
        lag, first = min(early)
        return [
            f"{len(early)} of {len(drives)} drives turn before they are told to (up to {-lag:.2f} s, {first}): two "
            "clocks stamped commands and poses; diagnose corrects that, --clock-offset declares it"
        ]
    if not lags:
        return ["no drive turns enough to tell whether commands and poses share a clock"]
    usual = float(np.median([lag for lag, _ in lags]))
    return [
        f"it turns {usual:.2f} s after its commands: delay, lag and an offset between the two clocks together, which "
        "nothing here can tell apart"
    ]
