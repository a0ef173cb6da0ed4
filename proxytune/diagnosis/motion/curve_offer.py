"""The curves that a discrepancy may have: knots where the drives have been, and the prior of their weights.

Over sizes, times and places weights are an Ornstein-Uhlenbeck process, a Gaussian process that may jump: so knots may
lie as near to each other as a step of a driver or the edge of a puddle asks, and few data still tell their weights.
"""

from itertools import product

import numpy as np

from proxytune.diagnosis.motion.drives import Drives, Floats
from proxytune.diagnosis.motion.innovations import twists_of
from proxytune.effects import GROUPS, LEVEL, PLACE, FittedRange, Knots, Learnt, LearntCurve, track_of
from proxytune.space import Theta

RARE = 0.002
"""The range that was seen leaves out so much of the time at either end."""
WHEEL_KNOTS, TURN_KNOTS, USE_KNOTS = 9, 8, 24
GRID = (4, 6)
"""Knots of a curve over a wheel's speed, over the yaw rate, over use, and over speed and yaw rate together."""
TIME_STEP_S, TIME_KNOTS = 2.0, 40
"""Between the knots of a curve over time, farther apart where a drive is so long that these would be more."""
OTHER_KNOTS = 5
"""Knots of a curve over the other wheel's speed."""
MESHES_M = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
MOST_CORNERS, MOST_ON_AXIS, MOST_OF_TRACKER = 100, 16, 40
"""Meshes of the lattices of a map of the floor, of curves over x or y, and of a tracker's map; their most corners."""
SAME_PLACE_M = 1e-3
"""Drives that begin in motion so near to each other did not begin at one place: their frames begin there."""
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
DUTY_KNOTS, DRAWN_KNOTS = 200, 16
"""Knots over the size of a command, and over the sum of both."""
HELD_S = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
SINCE_S = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8, 1.2)
DRAGS = (0.02, 0.05, 0.1, 0.2)
ENDED_S = (0.1, 0.25, 0.63, 1.6)
RAMPS_S = (0.0, 0.1, 0.16, 0.25, 0.4, 0.63, 1.0, 1.6, 2.5)
"""Of commands: how long they are held, since they began or turned round, half widths of plays, time constants, and how
long growing from 0 to 1 and shrinking back takes."""
CORRELATED = {"duty": 0.3, "drawn": 0.3, "time": 0.3, "use": 0.3, PLACE: 0.5}
"""Weights of these groups are correlated: over such a share of the knots' range it falls to 1/e."""
APART = 0.02
"""Knots nearer to each other or to 0 than this share of the range are one."""


def offer_curves(drives: Drives, theta: Theta) -> Learnt:
    """Offer every group of curves with knots for these drives, all weights 0."""
    asked = twists_of(drives, theta)
    episodes, length = drives.duties.shape[:2]
    edges = np.zeros((episodes, length + 1))
    np.add.at(edges, (drives.episode, drives.first), 1.0)
    np.add.at(edges, (drives.episode, drives.last), -1.0)
    used = np.asarray(np.cumsum(edges, axis=1)[:, :-1] > 0.5)
    forward, yaw = asked[..., 0][used], asked[..., 2][used]
    turn = yaw * track_of(drives.robot.figures) / 2.0
    effort = (np.abs(forward - turn) + np.abs(forward + turn)) / 2.0 / drives.robot.figures["full_speed"]
    seconds = float(drives.last.max()) / drives.tick_hz
    both = product(sorted((0.0, *_corners(forward, GRID[0]))), sorted((0.0, *_corners(yaw, GRID[1]))))
    knots: dict[str, Knots] = {
        "wheel_speed": _corners(np.concatenate((forward - turn, forward + turn)), WHEEL_KNOTS),
        "other_wheel": _corners(np.concatenate((forward - turn, forward + turn)), OTHER_KNOTS),
        "turn_rate": _corners(yaw, TURN_KNOTS),
        "speed_and_turn": tuple((speed, turning) for speed, turning in both if speed or turning),
        LEVEL: (1.0,),
        "transients": TRANSIENTS_S,
        "changes": TRANSIENTS_S,
        "start": STARTS_S,
        "ringing": RINGING_HZ,
        "play": tuple(_round_knot(share * drives.robot.figures["full_speed"]) for share in PLAYS),
        "reversal": REVERSALS_M,
        "direction": (-1.0,) if float((forward < -0.01 * drives.robot.figures["full_speed"]).mean()) > RARE else (),
        "time": _steps(seconds, min(TIME_KNOTS, int(seconds / TIME_STEP_S))),
        "use": _steps(float(np.bincount(np.nonzero(used)[0], effort).max()) / 60.0 / drives.tick_hz, USE_KNOTS),
        "load": LOADS_S,
        "heading": (1.0, 2.0),
    }
    if drives.robot.drive == "differential":
        most = float(np.abs(drives.duties).max())
        knots["duty"] = tuple(_round_knot(most * n / DUTY_KNOTS) for n in range(1, DUTY_KNOTS + 1))
        knots["drawn"] = tuple(_round_knot(2.0 * most * n / DRAWN_KNOTS) for n in range(1, DRAWN_KNOTS + 1))
        knots |= {
            "held": HELD_S,
            "begun": SINCE_S,
            "turned": SINCE_S,
            "dragged": DRAGS,
            "ended": ENDED_S,
            "ramped": tuple(product(RAMPS_S, RAMPS_S))[1:],
        }
    # Where several drives begin in motion at one and the same place, each counts places from where it begins.
    begun = drives.places[drives.rest.any(axis=1), 0]
    if not (len(begun) > 1 and np.ptp(begun, axis=0).max() < SAME_PLACE_M):
        places = drives.places[used]
        knots[PLACE] = _lattice(places, MOST_CORNERS)
        for number, axis in enumerate("xy"):
            knots[axis] = _lattice(places[:, number : number + 1], MOST_ON_AXIS)
            knots[f"tracker_{axis}"] = _lattice(places[:, number : number + 1], MOST_OF_TRACKER)
    curves = [
        LearntCurve(group, channel, knots[group], (0.0,) * len(knots[group]))
        for group, kind in GROUPS.items()
        for channel in kind.channels
        if knots.get(group)
    ]
    return Learnt(FittedRange(_ends(forward), _ends(yaw)), tuple(curves))


def _lattice(places: Floats, most: int) -> Knots:
    """Corners of the meshes that were driven through, in the plane or on an axis, as fine as so many corners allow."""
    axes = places.shape[1]
    for mesh in MESHES_M:
        cells = np.floor(places / mesh - 0.5)
        cells = np.unique(cells[np.diff(cells, axis=0, prepend=np.nan).any(axis=1)], axis=0)
        corners = np.unique(np.concatenate([cells + step for step in product((0, 1), repeat=axes)]), axis=0)
        if len(corners) <= most:
            found = (mesh * (corners + 0.5)).tolist()
            return tuple((x, y) for x, y in found) if axes == 2 else tuple(x for (x,) in found)
    return ()


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


def _steps(last: float, count: int) -> tuple[float, ...]:
    values = [_round_knot(last * number / count) for number in range(1, count + 1)]
    return tuple(dict.fromkeys(value for value in values if value > 1e-3))


def _round_knot(value: float) -> float:
    """Round a knot to three digits: more say nothing."""
    return float(f"{value:.3g}")


def split_by_curve(offer: Learnt, columns: Floats) -> list[Floats]:
    """Views of the columns (…, weights) of each curve."""
    return np.split(columns, np.cumsum([len(curve.knots) for curve in offer.curves]), axis=-1)[:-1]


def prior_root(curve: LearntCurve) -> Floats:
    """Root of the prior covariance of a curve's weights (knots, knots), an Ornstein-Uhlenbeck process; else of 1."""
    share, knots = CORRELATED.get(curve.group, 0.0), np.reshape(curve.knots, (len(curve.knots), -1))
    length = share * float(np.ptp(knots, axis=0).max())
    if length == 0.0:
        return np.eye(len(knots))
    apart = np.linalg.norm(knots[:, None] - knots, axis=-1)
    return np.asarray(np.linalg.cholesky(np.exp(-apart / length)))
