"""Model discrepancy: what no named effect explains, learnt as curves over features and used only if shown to help.

    e = Σ_k w_k φ_k(twists) + noise,    w = (Σ φᵀφ + Λ)⁻¹ Σ φᵀe,

with e the errors of poses over windows, linearised in the weights w of curves φ; the model's own values move along,
since a curve can add latency but not take away what was fitted without it. `offer_curves` lays knots where the
drives have been; over sizes, times and places weights are a Gaussian process, so that knots may be as near as a jump or
the edge of a puddle asks. `curve_selection.choose_groups` adds groups of curves by forward selection with a ridge Λ of one
scale a group, on parts that are left out; `fit_discrepancy` guards the whole by held-out windows (after Kennedy and
O'Hagan's model discrepancy). `match_named_effect` reads what was learnt back into a name, and `learn` tells what the
curves are worth on drives that were not fitted, and whether the names do worse than curves alone.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from proxytune.diagnosis.answer import Rules
from proxytune.diagnosis.motion.curve_selection import MODEL, ChosenGroups, Sums, choose_groups, sum_squares
from proxytune.diagnosis.motion.drives import Drives, Floats
from proxytune.diagnosis.motion.evidence import Findings
from proxytune.diagnosis.motion.innovations import Coordinate, smooth_coordinates, spans, theta_at, twists_of
from proxytune.diagnosis.motion.multistep_fit import HORIZONS_S
from proxytune.diagnosis.motion.prediction import (
    FITTED_S,
    Ratio,
    Rmse,
    Windows,
    blocks_of,
    cut,
    pose_errors,
    ratio,
    rmse,
    select_windows,
    slopes_of,
)
from proxytune.diagnosis.motion.screening import Candidate, candidates
from proxytune.effects import (
    COMMAND_GROUPS,
    GROUPS,
    LEVEL,
    OF_PLACE,
    PLACE,
    FittedRange,
    Knots,
    Learnt,
    LearntCurve,
    effect_of,
    learnt_theta,
    track_of,
)
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
MESHES_M = (0.25, 0.5, 1.0, 2.0)
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
DUTY_KNOTS, DRAWN_KNOTS = 100, 16
"""Knots over the size of a command, and over the sum of both."""
HELD_S = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
SINCE_S = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8, 1.2)
DRAGS = (0.02, 0.05, 0.1, 0.2)
ENDED_S = (0.1, 0.25, 0.63, 1.6)
RAMPS_S = (0.0, 0.1, 0.18, 0.32, 0.56, 1.0, 1.8)
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
    if not _in_frames_of_their_own(drives):
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


def _in_frames_of_their_own(drives: Drives) -> bool:
    """Tell whether each drive counts places from where it begins: several begin in motion at one and the same place."""
    begun = drives.places[drives.rest.any(axis=1), 0]
    return len(begun) > 1 and bool(np.ptp(begun, axis=0).max() < SAME_PLACE_M)


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


PARTS = 16
"""No more parts are left out in turn."""
FOLDS = 4
"""The whole fit, choice of groups included, is repeated so often for the guard, each time without one fold."""
ROUNDS, SETTLED = 8, 0.99
"""It is linearised and its weights are made robust so often, or until two times leave more than this share of the
error."""
FARTHEST = 0.15
"""In a round the model's own values move by no more than this share of their range."""


@dataclass(frozen=True)
class Discrepancy:
    """The discrepancy of a model, as curves were fitted to it.

    Attributes:
        theta: Its values by their names in θ, with those of the model's own that moved along; empty where no group
            pays.
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


class _Task(NamedTuple):
    """What curves are fitted to, and what they begin with.

    Attributes:
        drives: The drives.
        theta: The model that they are added to.
        offer: All curves.
        moving: The model's own values that move along.
        windows: All windows of FITTED_S.
        before: Squared distance at their poses without curves (M,) [m²].
        rival: The same of what curves have to better clearly to be of use, or None.
        given: Squares by part of the first linearisation.
        errors: Its errors (M, 3) [m].
    """

    drives: Drives
    theta: Theta
    offer: Learnt
    moving: Sequence[Coordinate]
    windows: Windows
    before: Floats
    rival: Floats | None
    given: Sums
    errors: Floats

    @property
    def aim(self) -> float:
        """The error that would do [m]."""
        return np.inf if self.rival is None else self.drives.rules.doubtful_names * float(np.sqrt(self.rival.mean()))

    def does_better(self, squares: Floats) -> bool:
        """Tell whether held-out squares are clearly less than the rival's."""
        if self.rival is None:
            return True
        rules, blocks = self.drives.rules, blocks_of(self.drives, self.windows)
        compared = ratio(squares, self.rival, blocks, rules.ratio_p_value)
        return compared.value < rules.doubtful_names and compared.below

    def without(self, left_out: Iterable[str], *, moves: bool) -> "_Task":
        """The same without the curves of some groups, and the model's own values as they are unless these move."""
        kept = [name not in left_out and (moves or name != MODEL) for name in _column_groups(self.offer, self.moving)]
        curves = tuple(curve for curve in self.offer.curves if curve.group not in left_out)
        return self._replace(
            offer=replace(self.offer, curves=curves),
            moving=self.moving if moves else (),
            given=self.given.of(np.flatnonzero(kept)),
        )


def fit_discrepancy(
    drives: Drives, theta: Theta, free: Sequence[Coordinate] = (), rival: Floats | None = None
) -> Discrepancy:
    """Fit the discrepancy of a model over windows, and say whether that helps; its free coordinates move along.

    Curves that are not clearly better than a rival, by its held-out squares (M,), are neither guarded nor used.
    """
    windows = cut(drives, FITTED_S)
    blocks = len(np.unique(drives.block[windows.begin]))
    before = pose_errors(drives, theta, windows)[:, 0] ** 2 if blocks else np.empty(0)
    if blocks < drives.rules.discrepancy_blocks:
        return Discrepancy(held_out=before)
    offer, moving = offer_curves(drives, theta), smooth_coordinates(free, drives.robot)
    task = _Task(drives, theta, offer, moving, windows, before, rival, *_linearise(drives, theta, offer, moving))
    found = _fitted(task)
    # Maps have the most weights by far: where the guard refuses curves with them, they are fitted without.
    if not found.used and _has(found, OF_PLACE):
        found = _fitted(task, OF_PLACE)
    # The model's own values are weights more: where the guard refuses that, they stay.
    if found.guard and not found.used and moving:
        found = _fitted(task, moves=False)
    # What was learnt and does not better its rival is not tried again.
    if (found.guard and not found.used) or found.held_out is before:
        found = _fitted(task, patient=True)
    # Curves over motion were linearised without those over commands, and may get in each other's way.
    if _has(found, COMMAND_GROUPS):
        alone, of = _fitted(task, COMMAND_GROUPS), blocks_of(drives, windows)
        if alone.used and not (
            found.used and ratio(found.held_out, alone.held_out, of, drives.rules.ratio_p_value).below
        ):
            found = alone
    return found


def _has(found: Discrepancy, groups: Iterable[str]) -> bool:
    return not {GROUPS[group].title for group in groups}.isdisjoint(found.share)


def _fitted(whole: _Task, left_out: Iterable[str] = (), *, moves: bool = True, patient: bool = False) -> Discrepancy:
    task = whole.without(left_out, moves=moves)
    learnt, gains, folds = _fit_curves(task, patient)
    if not gains:
        return Discrepancy(held_out=task.before)
    if not folds:
        return Discrepancy()
    after = _cross_validate(task.drives, task.theta, folds, task.windows)
    if not task.does_better(after):
        return Discrepancy(held_out=after)
    guard = _guard(task.drives, task.theta, folds, {FITTED_S: (task.before, after)})
    total = sum(gains.values())
    share = {GROUPS[group].title: gain / total for group, gain in gains.items()}
    return Discrepancy(learnt, share, guard, _helps(guard, task.drives.rules), after)


def _column_groups(offer: Learnt, moving: Sequence[Coordinate]) -> list[str]:
    """The group of each column of a linearisation."""
    return [curve.group for curve in offer.curves for _ in curve.knots] + [MODEL] * len(moving)


def _linearise(
    drives: Drives, theta: Theta, offer: Learnt, moving: Sequence[Coordinate], weights: Floats | float = 0.0
) -> tuple[Sums, Floats]:
    """Squares by part, linearised round a model that has these weights already, and its errors (M, 3) [m]."""
    slopes, parts = slopes_of(drives, theta, offer, moving), _parts(drives)
    for curve, columns in zip(offer.curves, _by_curve(offer, slopes.columns), strict=True):
        if curve.group in CORRELATED:
            columns[:] = columns @ _prior_root(curve)
    known = np.broadcast_to(weights, slopes.columns.shape[2:])
    return sum_squares(slopes, known, slopes.block % parts, parts), slopes.residuals


def _fit_curves(task: _Task, patient: bool) -> tuple[Theta, Mapping[str, float], Sequence[Theta]]:
    """Fit the curves to all parts, with what each group gained, and without each fold in turn; by names in θ.

    The moving coordinates of the model are fitted along. A patient fit looks for what matters in few parts. There are
    no folds where errors do not come near what would do.
    """
    drives, offer, moving, rules = task.drives, task.offer, task.moving, task.drives.rules
    names = _column_groups(offer, moving)
    groups = {name: slice(names.index(name), names.index(name) + names.count(name)) for name in dict.fromkeys(names)}
    own, (low, high) = groups.get(MODEL, slice(0)), spans(moving, drives)
    given, errors = task.given, task.errors
    now, left, apart = dict[str, float](), list[float](), list[float]()

    def stepped(chosen: ChosenGroups) -> dict[str, float]:
        """The chosen curves, and the moving coordinates a step further."""
        if not chosen.gains:
            return {}
        here = np.array([{**task.theta, **now}[coordinate[0]] for coordinate in moving])
        step = np.clip(chosen.weights[own], -FARTHEST, FARTHEST) * (high - low)
        return {**theta_at({}, moving, np.clip(here + step, low, high)), **_theta(offer, chosen)}

    while True:
        chosen = choose_groups(given, groups, rules, rare=patient)
        if not chosen.gains:
            return {}, {}, ()
        left.append(float(np.linalg.norm(errors, axis=1).mean()))
        apart.append(float(np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean())))
        # At the pace of the last step another would not do.
        if len(left) > 2 and apart[-1] - task.aim > apart[-2] - apart[-1]:
            return {}, chosen.gains, ()
        if len(left) == ROUNDS or min(left[-2:]) > SETTLED * min(left[:-2], default=np.inf):
            break
        now = stepped(chosen)
        chosen.weights[own] = 0.0
        given, errors = _linearise(drives, {**task.theta, **now}, offer, moving, chosen.weights)
    fold = np.arange(_parts(drives)) % FOLDS
    without = [given.only(np.flatnonzero(fold != one)) for one in range(FOLDS)]
    folds = [stepped(choose_groups(some, groups, rules, rare=patient)) for some in without]
    return stepped(chosen), chosen.gains, folds


def _by_curve(offer: Learnt, columns: Floats) -> list[Floats]:
    """Views of the columns (…, weights) of each curve."""
    return np.split(columns, np.cumsum([len(curve.knots) for curve in offer.curves]), axis=-1)[:-1]


def _prior_root(curve: LearntCurve) -> Floats:
    """Root of the prior covariance of a curve's weights (knots, knots), an Ornstein-Uhlenbeck process; else of 1."""
    share, knots = CORRELATED.get(curve.group, 0.0), np.reshape(curve.knots, (len(curve.knots), -1))
    length = share * float(np.ptp(knots, axis=0).max())
    if length == 0.0:
        return np.eye(len(knots))
    apart = np.linalg.norm(knots[:, None] - knots, axis=-1)
    return np.asarray(np.linalg.cholesky(np.exp(-apart / length)))


def _theta(offer: Learnt, choice: ChosenGroups) -> dict[str, float]:
    """The chosen groups with their weights, by their names in θ."""
    curves = tuple(
        curve._replace(weights=tuple((_prior_root(curve) @ weights).tolist()))
        for curve, weights in zip(offer.curves, _by_curve(offer, choice.weights), strict=True)
        if curve.group in choice.gains or curve.group == LEVEL
    )
    return learnt_theta(Learnt(offer.seen, curves))


def _guard(
    drives: Drives, theta: Theta, folds: Sequence[Theta], known: Mapping[float, tuple[Floats, Floats]]
) -> dict[float, Ratio]:
    """The ratios of held-out errors with and without curves, by horizon; squares of some are known already."""
    found = {}
    for horizon_s in HORIZONS_S:
        windows = cut(drives, horizon_s)
        blocks = blocks_of(drives, windows)
        if len(np.unique(blocks)) >= drives.rules.discrepancy_blocks:
            before, after = known.get(horizon_s) or (
                pose_errors(drives, theta, windows)[:, 0] ** 2,
                _cross_validate(drives, theta, folds, windows),
            )
            found[horizon_s] = ratio(after, before, blocks, drives.rules.ratio_p_value)
    return found


def _cross_validate(drives: Drives, theta: Theta, folds: Sequence[Theta], windows: Windows) -> Floats:
    """Squared distance at every compared pose (M,), each predicted by the fit that left its block out."""
    squares = np.empty(len(windows.increment))
    fold_of = drives.block[windows.begin] % _parts(drives) % FOLDS
    for number, fold in enumerate(folds):
        own = fold_of == number
        if own.any():
            part = select_windows(windows, own)
            squares[own[windows.window]] = pose_errors(drives, {**theta, **fold}, part)[:, 0] ** 2
    return squares


def _parts(drives: Drives) -> int:
    return min(PARTS, int(drives.block.max()) + 1)


def _helps(guard: Mapping[float, Ratio], rules: Rules) -> bool:
    helps = any(one.value < rules.discrepancy_helps and one.below for one in guard.values())
    return helps and all(one.value <= rules.discrepancy_harms for one in guard.values())


PROMISING = 3
"""So many forms are tuned, those whose probes gain most."""
EVALUATIONS = 25
"""So often the windows are replayed to tune one."""


class MatchedEffect(NamedTuple):
    """A named effect that keeps most of what curves gain.

    Attributes:
        effect: Its name.
        form: What is special about its form.
        theta: Its values by their names in θ.
        share: The share of the gain that it keeps; it was tuned to all windows, the curves to others than these.
    """

    effect: str
    form: str
    theta: Mapping[str, float]
    share: float


def match_named_effect(
    drives: Drives, theta: Theta, discrepancy: Discrepancy, taken: Iterable[str]
) -> MatchedEffect | None:
    """Find the named effect, not taken, that removes as much error as the curves, if one keeps most of their gain."""
    windows = cut(drives, FITTED_S)

    def loss(candidate: Candidate, values: Floats) -> float:
        low, high = spans(candidate.free, drives)
        moved = theta_at({**theta, **candidate.fixed}, candidate.free, np.clip(values, low, high))
        return float(np.mean(pose_errors(drives, moved, windows)[:, 0] ** 2))

    plain = float(np.mean(pose_errors(drives, theta, windows)[:, 0] ** 2))
    gained = plain - float(discrepancy.held_out.mean())
    if gained <= 0.0:
        return None
    forms = candidates(drives.robot, theta, taken)
    probed = [min((loss(one, np.array(p)), number, p) for p in one.probes) for number, one in enumerate(forms)]
    tuned = [_tune(forms[number], np.array(probe), loss, drives) for _, number, probe in sorted(probed)[:PROMISING]]
    least, form, values = min(tuned, key=lambda found: found[0])
    share = (plain - least) / gained
    found = theta_at(form.fixed, form.free, values)
    return MatchedEffect(form.effect, form.form, found, share) if share >= drives.rules.match_share else None


def _tune(
    form: Candidate, probe: Floats, loss: Callable[[Candidate, Floats], float], drives: Drives
) -> tuple[float, Candidate, Floats]:
    """The least loss of a form near a probe, and where it is."""
    low, high = spans(form.free, drives)
    start = (probe - low) / (high - low)
    simplex = np.vstack((start, start + np.eye(len(start)) * np.where(start < 0.9, 0.1, -0.1)))

    def left(shares: Floats, *_: Any, **__: Any) -> float:
        return loss(form, low + shares * (high - low))

    options: Any = {"initial_simplex": simplex, "maxfev": EVALUATIONS}
    found = minimize(left, start, method="Nelder-Mead", options=options)
    return float(found.fun), form, np.clip(low + found.x * (high - low), low, high)


class LearntError(NamedTuple):
    """The error over windows with names and learnt curves, on drives not fitted [m], [rad], and by that with names."""

    horizon_s: float
    after: Rmse
    heading: Rmse
    ratio: Ratio


@dataclass(frozen=True)
class Learning:
    """The learnt discrepancy and what it is worth.

    Attributes:
        discrepancy: The curves, beside all named effects.
        errors: What they are worth, by horizon, shortest first; empty where they are not used.
        names_doubtful: Whether curves beside what is declared alone predict clearly better: then the names are wrong,
            and the curves are these.
        looks_like: The named effect that would do nearly as well as the curves, or None.
        model: All values of the model with the curves, by name in θ; empty where they are not used.
    """

    discrepancy: Discrepancy
    errors: tuple[LearntError, ...]
    names_doubtful: bool
    looks_like: MatchedEffect | None = None
    model: Mapping[str, float] = field(default_factory=dict)

    @property
    def theta(self) -> Mapping[str, float]:
        """The parameters of the curves that are used, by name in θ; empty where none are."""
        return self.discrepancy.theta if self.discrepancy.used else {}

    def depends_on(self, others: Iterable[str]) -> tuple[str, ...]:
        """The signals of the curves that are used, largest share first, and others, each once."""
        share = self.discrepancy.share if self.discrepancy.used else {}
        return tuple(dict.fromkeys([*sorted(share, key=lambda title: -share[title]), *others]))


def learn(found: Findings, tested: Drives, horizons_s: Iterable[float]) -> Learning:
    """Learn what the named effects leave over, and test it over windows of these lengths."""
    names = found.model
    curves = fit_discrepancy(names.drives, names.theta, names.free)
    alone = _beside_declared(found, curves)
    base, curves = (found.declared, alone) if alone else (names, curves)
    if not curves.used:
        return Learning(curves, (), False)
    model = {**base.theta, **curves.theta}
    errors = (_error(names.theta, model, tested, horizon_s) for horizon_s in horizons_s)
    like = match_named_effect(base.drives, base.theta, curves, {effect_of(name) for name in names.theta})
    return Learning(curves, tuple(error for error in errors if error), alone is not None, like, model)


def _error(names: Theta, model: Theta, drives: Drives, horizon_s: float) -> LearntError | None:
    windows = cut(drives, horizon_s)
    blocks = blocks_of(drives, windows)
    if len(np.unique(blocks)) < 2:
        return None
    before, after = (pose_errors(drives, theta, windows) ** 2 for theta in (names, model))
    compared = ratio(after[:, 0], before[:, 0], blocks, drives.rules.ratio_p_value)
    return LearntError(horizon_s, rmse(after[:, 0], blocks), rmse(after[:, 1], blocks), compared)


def _beside_declared(found: Findings, beside: Discrepancy) -> Discrepancy | None:
    """Curves beside what is declared alone, if there are names and these predict clearly better without them."""
    if not found.adopted or not len(beside.held_out):
        return None
    alone = fit_discrepancy(found.model.drives, found.declared.theta, found.declared.free, beside.held_out)
    return alone if alone.used else None
