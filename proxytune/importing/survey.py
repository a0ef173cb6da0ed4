"""A drive in numbers: how long, how often measured, what dropped out, and when it answers its commands."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from proxytune.importing.reaction import reaction_of
from proxytune.importing.source import Drive, Floats

GAP_S = 0.5
"""A longer time without a pose is a gap."""


@dataclass(frozen=True)
class Survey:
    """A drive in numbers.

    Attributes:
        name: What the log calls it.
        seconds: From its first pose to its last [s].
        poses: How many were measured.
        poses_hz: At the usual interval between them.
        lost: Share of the poses that dropped out, gaps apart.
        gaps: Times without a pose of more than GAP_S.
        longest_gap_s: The longest of them [s].
        jitter_s: Standard deviation of the intervals between poses, drop-outs apart [s].
        commands: How many were issued.
        frames: How many pictures were taken.
        lag_s: How long after its command it turns [s]; below 0: before it. None where that cannot be told.
    """

    name: str
    seconds: float
    poses: int
    poses_hz: float
    lost: float
    gaps: int
    longest_gap_s: float
    jitter_s: float
    commands: int
    frames: int
    lag_s: float | None

    @property
    def facts(self) -> dict[str, Any]:
        """What a JSON document says of it."""
        return asdict(self)


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


def clock_notes(drives: list[Survey]) -> list[str]:
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
