"""The curves that may be learnt from drives: their knots lie where the drives have been."""

from itertools import product

import numpy as np

from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.model.replay import twists_of
from proxytune.effects.learnt.bases import Knots
from proxytune.effects.learnt.effect import Curve, Learnt, Seen
from proxytune.effects.learnt.features import GROUPS, LEVEL
from proxytune.space import Theta

RARE = 0.002
"""The range that was seen leaves out so much of the time at either end."""

WHEEL_KNOTS, TURN_KNOTS, TIME_KNOTS = 9, 8, 6
GRID = (4, 6)
"""Knots of a curve over a wheel's speed, over the yaw rate, over time or use, and over speed and yaw rate together."""

TRANSIENTS_S = (0.04, 0.1, 0.25, 0.63, 1.6)
STARTS_S = (0.05, 0.15, 0.5)
"""Time constants over which the memory of a start fades [s]."""

RINGING_HZ = (0.4, 0.8, 1.6, 3.2)
"""Frequencies of swings."""

PLAYS = (0.02, 0.05, 0.1, 0.2)
"""Half widths of plays, as shares of full speed."""

REVERSALS_M = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Ways over which the memory of a reversal fades [m]."""

LOADS_S = (1.0, 4.5, 20.0)
"""Time constants of the low-passes."""

APART = 0.02
"""Knots nearer to each other or to 0 than this share of the range are one."""


def offer_curves(drives: Drives, theta: Theta) -> Learnt:
    """Offer every group of curves with knots for these drives, all weights 0."""
    asked = twists_of(drives, theta)
    used = _ticks_in_motion(drives)
    forward, yaw = asked[..., 0][used], asked[..., 2][used]
    turn = yaw * drives.robot.figures["effective_baseline"] / 2.0
    effort = (np.abs(forward - turn) + np.abs(forward + turn)) / 2.0 / drives.robot.figures["full_speed"]
    seconds = float(drives.last.max()) / drives.tick_hz
    knots: dict[str, Knots] = {
        "wheel_speed": _corners(np.concatenate((forward - turn, forward + turn)), WHEEL_KNOTS),
        "turn_rate": _corners(yaw, TURN_KNOTS),
        "speed_and_turn": _pairs(_corners(forward, GRID[0]), _corners(yaw, GRID[1])),
        LEVEL: (1.0,),
        "transients": TRANSIENTS_S,
        "start": STARTS_S,
        "ringing": RINGING_HZ,
        "play": tuple(_round_knot(share * drives.robot.figures["full_speed"]) for share in PLAYS),
        "reversal": REVERSALS_M,
        "direction": (-1.0,) if float((forward < -0.01 * drives.robot.figures["full_speed"]).mean()) > RARE else (),
        "time": _steps(seconds),
        "use": _steps(float(effort.mean()) * seconds / 60.0),
        "load": LOADS_S,
        "heading": (1.0, 2.0),
    }
    curves = [
        Curve(group, channel, knots[group], (0.0,) * len(knots[group]))
        for group, kind in GROUPS.items()
        for channel in kind.channels
        if knots[group]
    ]
    return Learnt(Seen(_ends(forward), _ends(yaw)), tuple(curves))


def _ticks_in_motion(drives: Drives) -> Floats:
    """The ticks (E, T) that lie within measured motion."""
    episodes, length = drives.duties.shape[:2]
    edges = np.zeros((episodes, length + 1))
    np.add.at(edges, (drives.episode, drives.first), 1.0)
    np.add.at(edges, (drives.episode, drives.last), -1.0)
    return np.asarray(np.cumsum(edges, axis=1)[:, :-1] > 0.5)


def _ends(signal: Floats) -> tuple[float, float]:
    low, high = np.quantile(signal, (RARE, 1.0 - RARE)).tolist()
    return _round_knot(min(low, 0.0)), _round_knot(max(high, 0.0))


def _corners(signal: Floats, count: int) -> tuple[float, ...]:
    """Knots half at quantiles of a signal while it moves, half evenly over its range; 0 is none."""
    low, high = _ends(signal)
    least = APART * (high - low)
    moving = signal[np.abs(signal) > least]
    if len(moving) == 0:
        return ()
    shares = np.linspace(0.0, 1.0, count)
    wanted = (np.quantile(np.clip(moving, low, high), shares) + low + shares * (high - low)) / 2.0
    kept: list[float] = []
    for value in map(_round_knot, wanted.tolist()):
        if abs(value) > least and (not kept or value - kept[-1] > least):
            kept.append(value)
    return tuple(kept)


def _pairs(speeds: tuple[float, ...], turns: tuple[float, ...]) -> Knots:
    return tuple(
        (speed, turn) for speed, turn in product(sorted((0.0, *speeds)), sorted((0.0, *turns))) if speed or turn
    )


def _steps(last: float) -> tuple[float, ...]:
    values = [_round_knot(last * number / TIME_KNOTS) for number in range(1, TIME_KNOTS + 1)]
    return tuple(dict.fromkeys(value for value in values if value > 1e-3))


def _round_knot(value: float) -> float:
    """Round a knot to three digits: more say nothing."""
    return float(f"{value:.3g}")
