"""The learnt remainder: what no named effect explains, as curves over features; used only if shown to help.

The curves that may be learnt from drives: their knots lie where the drives have been.
The choice of groups of curves by ridge regression, one scale a group, on blocks that are left out.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.motion.drives import Drives, Floats, Whole, sum_by
from proxytune.diagnosis.motion.innovations import twists_of
from proxytune.diagnosis.motion.multistep_fit import HORIZONS_S
from proxytune.diagnosis.motion.prediction import (
    FITTED_S,
    Ratio,
    Slopes,
    Windows,
    blocks_of,
    cut,
    pose_errors,
    ratio,
    select_windows,
    slopes_of,
)
from proxytune.diagnosis.rules import RULES
from proxytune.effects import GROUPS, LEVEL, Curve, Knots, Learnt, Seen, learnt_theta
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


RIDGES = (1e-3, 1e-2, 1e-1, 1.0)
"""Pulls towards no curve that are tried, as shares of what an average weight of the group is held by."""

FIRMEST_ONLY = {"speed_and_turn": 0.1}
"""Curves over two signals are never pulled less than this: most of their knots are seldom visited."""

FREE = 1e-6
"""The level is hardly pulled."""

ROBUST = 1.5
"""Errors beyond so many medians count less and less."""


class Sums(NamedTuple):
    """Weighted squares by part (P, …): of the columns with each other, with the errors, and of the errors."""

    curve: Floats
    pull: Floats
    size: Floats

    def only(self, chosen: Whole) -> "Sums":
        """Some of the parts."""
        return Sums(self.curve[chosen], self.pull[chosen], self.size[chosen])


class Choice(NamedTuple):
    """The weights of all columns, 0 where a group was not chosen, and the squared error that each group took away."""

    weights: Floats
    gains: Mapping[str, float]


def sums(slopes: Slopes, weights: Floats, part: Whole, parts: int) -> Sums:
    """Sum over the poses of each part; errors are counted from weights of 0.

    Args:
        slopes: Linearised round the weights.
        weights: Those weights (weights,).
        part: The part of each pose (M,).
        parts: How many parts there are.
    """
    errors = slopes.left + slopes.columns @ weights
    size = np.sqrt((slopes.left**2).sum(axis=1))
    trust = 1.0 / np.sqrt(1.0 + (size / (ROBUST * np.median(size) + 1e-12)) ** 2)
    curve = []
    for number in range(parts):
        own = part == number
        columns = slopes.columns[own].reshape(-1, slopes.columns.shape[2])
        curve.append((columns * np.repeat(trust[own], 3)[:, None]).T @ columns)
    pull = sum_by(part, np.einsum("mck,mc,m->mk", slopes.columns, errors, trust), parts)
    return Sums(np.stack(curve), pull, sum_by(part, (errors**2).sum(axis=1) * trust, parts))


def choose(given: Sums, groups: Mapping[str, Whole]) -> Choice:
    """Add groups one by one, the best first, as long as they pay on parts that are left out; the level is always there.

    Args:
        given: Sums over the parts.
        groups: The columns of each group.
    """
    mean = given.curve.sum(axis=0).diagonal()
    pulls = {name: FREE for name in groups if name == LEVEL}
    gains: dict[str, float] = {}
    (losses,) = _held_out_losses(given, *_penalise(groups, [pulls], mean))
    while True:
        tried = {name: _try_group(given, groups, pulls, name, mean) for name in groups if name not in pulls}
        paying = {name: found for name, found in tried.items() if _pays(losses, found[1])}
        if not paying:
            break
        best = min(paying, key=lambda name: float(paying[name][1].sum()))
        pulls[best], after = paying[best]
        gains[best] = float((losses - after).sum())
        losses = after
    weights = np.zeros(len(mean))
    columns, (penalty,) = _penalise(groups, [pulls], mean)
    total = given.curve.sum(axis=0)[np.ix_(columns, columns)]
    weights[columns] = np.linalg.solve(total + np.diag(penalty), given.pull.sum(axis=0)[columns])
    return Choice(weights, gains)


def _try_group(
    given: Sums, groups: Mapping[str, Whole], pulls: Mapping[str, float], name: str, mean: Floats
) -> tuple[float, Floats]:
    """The strongest ridge of a group within one standard error of its best, and the losses of the parts with it."""
    ridges = [ridge for ridge in RIDGES if ridge >= FIRMEST_ONLY.get(name, 0.0)]
    found = _held_out_losses(given, *_penalise(groups, [{**pulls, name: ridge} for ridge in ridges], mean))
    best = min(found, key=lambda losses: float(losses.sum()))
    for ridge, losses in zip(ridges[::-1], found[::-1], strict=True):
        worse = losses - best
        if worse.sum() <= np.sqrt(len(worse)) * worse.std(ddof=1):
            return ridge, losses
    return ridges[-1], found[-1]


def _pays(before: Floats, after: Floats) -> bool:
    gain = before - after
    spread = float(gain.std(ddof=1)) * np.sqrt(len(gain))
    return bool(gain.sum() > RULES.group_share * before.sum() and gain.sum() > RULES.group_t * spread)


def _penalise(
    groups: Mapping[str, Whole], choices: Sequence[Mapping[str, float]], mean: Floats
) -> tuple[Whole, Floats]:
    """The columns of the groups that have a pull, and how hard each is pulled: alike within a group.

    Args:
        groups: The columns of each group.
        choices: Pulls of the same groups (R,).
        mean: The average curvature of each column.

    Returns:
        Columns (K,) and pulls (R, K).
    """
    names = list(choices[0])
    columns = np.concatenate([np.empty(0, int), *(groups[name] for name in names)])
    sizes = np.array([len(groups[name]) for name in names], int)
    held = [[pulls[name] * mean[groups[name]].mean() + 1e-9 for name in names] for pulls in choices]
    return columns, np.repeat(np.array(held), sizes, axis=1)


def _held_out_losses(given: Sums, columns: Whole, penalties: Floats) -> Floats:
    """The squared error of each part with weights from all others, under each penalty (R, K): (R, P)."""
    curve, pull = given.curve[:, columns[:, None], columns], given.pull[:, columns]
    rest = curve.sum(axis=0) - curve + penalties[:, None, :, None] * np.eye(len(columns))
    weights = np.linalg.solve(rest, (pull.sum(axis=0) - pull)[:, :, None])[..., 0]
    bent = (weights * (curve @ weights[..., None])[..., 0]).sum(axis=-1)
    return np.asarray(given.size - 2.0 * (weights * pull).sum(axis=-1) + bent)


PARTS = 16
"""No more parts are left out in turn."""

FOLDS = 4
"""The whole fit, choice of groups included, is repeated so often for the guard, each time without one fold."""

ROUNDS = 2
"""It is linearised and its weights are made robust so often."""


@dataclass(frozen=True)
class Remainder:
    """What was learnt beside a model.

    Attributes:
        theta: Its values by their names in θ, empty where no group pays.
        share: The share of each chosen group, by its title, in what is gained on blocks that are left out.
        guard: By horizon, the error with it over that without, each block predicted by a fit to others.
        used: Whether the guard lets it in.
        held_out: Squared distance at the poses of windows of FITTED_S, predicted by fits to other blocks (M,) [m²].
    """

    theta: Mapping[str, float] = field(default_factory=dict)
    share: Mapping[str, float] = field(default_factory=dict)
    guard: Mapping[float, Ratio] = field(default_factory=dict)
    used: bool = False
    held_out: Floats = field(default_factory=lambda: np.empty(0))


def remainder(drives: Drives, theta: Theta, promises: Callable[[Floats], bool] = lambda _: True) -> Remainder:
    """Fit what a model leaves over of its windows, and say whether that helps.

    Args:
        drives: What the model was fitted to.
        theta: The model.
        promises: Whether curves with these held-out squares (M,) are of use to who asks; if not, they are not guarded
            and not used.
    """
    windows = cut(drives, FITTED_S)
    blocks = len(np.unique(drives.block[windows.begin]))
    before = pose_errors(drives, theta, windows)[:, 0] ** 2 if blocks else np.empty(0)
    if blocks < RULES.remainder_parts:
        return Remainder(held_out=before)
    whole, folds = _fit_curves(drives, theta)
    if not whole.gains:
        return Remainder(held_out=before)
    after = _cross_validate(drives, theta, folds, windows)
    if not promises(after):
        return Remainder(held_out=after)
    guard = _guard(drives, theta, folds, {FITTED_S: (before, after)})
    total = sum(whole.gains.values())
    share = {GROUPS[group].title: gain / total for group, gain in whole.gains.items()}
    return Remainder(whole.theta, share, guard, _helps(guard), after)


@dataclass(frozen=True)
class _CurveFit:
    """A fit's values by their names in θ, and what each group gained."""

    theta: Mapping[str, float]
    gains: Mapping[str, float]


def _fit_curves(drives: Drives, theta: Theta) -> tuple[_CurveFit, list[_CurveFit]]:
    """Fit the curves to all parts, and without each fold in turn."""
    offer, parts = offer_curves(drives, theta), _parts(drives)
    groups = _columns(offer)
    weights = np.zeros(sum(len(curve.knots) for curve in offer.curves))
    now: Mapping[str, float] = {}
    for _ in range(ROUNDS):
        slopes = slopes_of(drives, {**theta, **now}, offer)
        given = sums(slopes, weights, slopes.block % parts, parts)
        choice = choose(given, groups)
        weights, now = choice.weights, _theta(offer, choice)
        if not choice.gains:
            break
    folds = [_fit_without_fold(offer, given, groups, fold) for fold in range(FOLDS)] if now else []
    return _CurveFit(now, choice.gains), folds


def _fit_without_fold(offer: Learnt, given: Sums, groups: Mapping[str, Whole], fold: int) -> _CurveFit:
    choice = choose(given.only(np.arange(len(given.size)) % FOLDS != fold), groups)
    return _CurveFit(_theta(offer, choice), choice.gains)


def _columns(offer: Learnt) -> dict[str, Whole]:
    """The columns of each group."""
    names = np.array([curve.group for curve in offer.curves for _ in curve.knots])
    return {name: np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}


def _theta(offer: Learnt, choice: Choice) -> dict[str, float]:
    """The chosen groups with their weights, by their names in θ."""
    if not choice.gains:
        return {}
    ends = np.cumsum([len(curve.knots) for curve in offer.curves])[:-1]
    parts = zip(offer.curves, np.split(choice.weights, ends), strict=True)
    curves = tuple(
        curve._replace(weights=tuple(weights.tolist()))
        for curve, weights in parts
        if curve.group in choice.gains or curve.group == LEVEL
    )
    return learnt_theta(Learnt(offer.seen, curves))


def _guard(
    drives: Drives, theta: Theta, folds: list[_CurveFit], known: Mapping[float, tuple[Floats, Floats]]
) -> dict[float, Ratio]:
    """The ratios of held-out errors with and without curves, by horizon; squares of some are known already."""
    found = {}
    for horizon_s in HORIZONS_S:
        windows = cut(drives, horizon_s)
        blocks = blocks_of(drives, windows)
        if len(np.unique(blocks)) >= RULES.remainder_parts:
            before, after = known.get(horizon_s) or (
                pose_errors(drives, theta, windows)[:, 0] ** 2,
                _cross_validate(drives, theta, folds, windows),
            )
            found[horizon_s] = ratio(after, before, blocks)
    return found


def _cross_validate(drives: Drives, theta: Theta, folds: list[_CurveFit], windows: Windows) -> Floats:
    """Squared distance at every compared pose (M,), each predicted by the fit that left its block out."""
    squares = np.empty(len(windows.increment))
    fold_of = drives.block[windows.begin] % _parts(drives) % FOLDS
    for number, fold in enumerate(folds):
        own = fold_of == number
        if own.any():
            part = select_windows(windows, own)
            squares[own[windows.window]] = pose_errors(drives, {**theta, **fold.theta}, part)[:, 0] ** 2
    return squares


def _parts(drives: Drives) -> int:
    """How many parts blocks are dealt out to."""
    return min(PARTS, int(drives.block.max()) + 1)


def _helps(guard: Mapping[float, Ratio]) -> bool:
    helps = any(one.value < RULES.remainder_helps and one.below for one in guard.values())
    return helps and all(one.value <= RULES.remainder_harms for one in guard.values())
