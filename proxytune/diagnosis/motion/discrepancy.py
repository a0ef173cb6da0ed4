"""Model discrepancy: what no named effect explains, learnt as curves over features and used only if shown to help.

    e = Σ_k w_k φ_k(twists) + noise,    w = (Σ φᵀφ + Λ)⁻¹ Σ φᵀe,

with e the errors of poses over windows, linearised in the weights w of curves φ; the model's own values move along,
since a curve can add latency but not take away what was fitted without it. `curve_offer` lays knots where the
drives have been, with a prior of their weights; `curve_selection` adds groups of curves by forward selection with a
ridge Λ of one scale a group, on parts that are left out; `fit_discrepancy` guards the whole by held-out windows (after
Kennedy and O'Hagan's model discrepancy). `match_named_effect` reads what was learnt back into a name, and `learn` tells
what the curves are worth on drives that were not fitted, and whether the names do worse than curves alone.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from proxytune.diagnosis.answer import Rules
from proxytune.diagnosis.motion.curve_offer import CORRELATED, offer_curves, prior_root, split_by_curve
from proxytune.diagnosis.motion.curve_selection import MODEL, ChosenGroups, Sums, choose_groups, sum_squares
from proxytune.diagnosis.motion.drives import Drives, Floats
from proxytune.diagnosis.motion.evidence import Findings
from proxytune.diagnosis.motion.innovations import Coordinate, smooth_coordinates, spans, theta_at, values_at
from proxytune.diagnosis.motion.multistep_fit import HORIZONS_S, PoseNoise, noise_floor, pose_noise
from proxytune.diagnosis.motion.prediction import (
    FITTED_S,
    Ratio,
    Rmse,
    Windows,
    blocks_of,
    count_blocks,
    cut,
    pose_errors,
    ratio_over,
    rmse,
    select_windows,
    slopes_of,
    squared_distances,
)
from proxytune.diagnosis.motion.screening import Candidate, candidates
from proxytune.effects import (
    COMMAND_GROUPS,
    GROUPS,
    LEVEL,
    OF_PLACE,
    Learnt,
    effect_of,
    learnt_theta,
)
from proxytune.space import Theta

PARTS = 16
"""No more parts are left out in turn."""
FOLDS = 4
"""The whole fit, choice of groups included, is repeated so often for the guard, each time without one fold."""
ROUNDS, SETTLED = 12, 0.998
"""It is linearised and its weights are made robust so often, or until two times leave more than this share of the
error."""
FARTHEST = 0.15
"""In a round the model's own values move by no more than this share of their range."""


@dataclass(frozen=True)
class Discrepancy:
    """The discrepancy of a model, as curves were fitted to it."""

    # its values by name in θ, with those of the model's own that moved along; empty where no group pays
    theta: Mapping[str, float] = field(default_factory=dict)
    share: Mapping[str, float] = field(default_factory=dict)  # of each chosen group, by title, in the held-out gain
    guard: Mapping[float, Ratio] = field(default_factory=dict)  # held-out error with it over that without, by horizon
    used: bool = False  # whether the guard lets it in
    # squared distance at the poses of windows of FITTED_S, predicted by fits to other blocks (M,) [m²]
    held_out: Floats = field(default_factory=lambda: np.empty(0))


class _Task(NamedTuple):
    """What curves are fitted to, and what they begin with."""

    drives: Drives
    theta: Theta  # the model that they are added to
    offer: Learnt  # all curves
    moving: Sequence[Coordinate]  # the model's own values that move along
    windows: Windows  # all windows of FITTED_S
    before: Floats  # squared distance at their poses without curves (M,) [m²]
    rival: Floats | None  # the same of what curves have to better clearly to be of use, or None
    given: Sums  # squares by part of the first linearisation
    errors: Floats  # its errors (M, 3) [m]

    @property
    def aim(self) -> float:
        """The error that would do [m]."""
        return np.inf if self.rival is None else self.drives.rules.doubtful_names * float(np.sqrt(self.rival.mean()))

    def does_better(self, squares: Floats) -> bool:
        """Tell whether held-out squares are clearly less than the rival's."""
        if self.rival is None:
            return True
        compared = ratio_over(self.drives, self.windows, squares, self.rival)
        return compared.value < self.drives.rules.doubtful_names and compared.below

    def without(self, left_out: Iterable[str], *, moves: bool) -> "_Task":
        """The same without the curves of some groups, and the model's own values as they are unless these move."""
        kept = [name not in left_out and (moves or name != MODEL) for name in _column_groups(self.offer, self.moving)]
        if all(kept):
            return self
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
    blocks = count_blocks(drives, windows)
    before = squared_distances(drives, theta, windows) if blocks else np.empty(0)
    if blocks < drives.rules.discrepancy_blocks or not _has_room(drives, theta):
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
        alone = _fitted(task, COMMAND_GROUPS)
        if alone.used and not (found.used and ratio_over(drives, windows, found.held_out, alone.held_out).below):
            found = alone
    return found


def _has_room(drives: Drives, theta: Theta) -> bool:
    """Tell whether there is more error than the noise of measured poses, which is left in any case."""
    noise, share = pose_noise(drives, theta), drives.rules.discrepancy_helps
    known = [windows for horizon_s in HORIZONS_S if len((windows := cut(drives, horizon_s)).begin)]
    return not all(_is_noise(drives, noise, one, squared_distances(drives, theta, one), share) for one in known)


def _is_noise(drives: Drives, noise: PoseNoise, windows: Windows, squares: Floats, share: float) -> bool:
    """Tell whether the noise of poses makes at least this share of the error over windows, of squares (M,) [m²]."""
    return noise_floor(drives, windows, noise)[0] >= share * float(np.sqrt(squares.mean()))


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
    for curve, columns in zip(offer.curves, split_by_curve(offer, slopes.columns), strict=True):
        if curve.group in CORRELATED:
            columns[:] = columns @ prior_root(curve)
    known = np.broadcast_to(weights, slopes.columns.shape[2:])
    return sum_squares(slopes, known, slopes.block % parts, parts), slopes.residuals


def _fit_curves(task: _Task, patient: bool) -> tuple[Theta, Mapping[str, float], Sequence[Theta]]:
    """Fit the curves to all parts, with what each group gained, and without each fold in turn; by names in θ.

    The moving coordinates of the model are fitted along. The chosen groups alone are linearised until they settle,
    then all again, until the same are chosen. A patient fit looks for what matters in few parts. There are no
    folds where errors do not come near what would do.
    """
    drives, offer, moving, rules = task.drives, task.offer, task.moving, task.drives.rules
    names = np.array(_column_groups(offer, moving))
    own, (low, high) = names == MODEL, spans(moving, drives)
    given, errors = task.given, task.errors
    now, left, apart = dict[str, float](), list[float](), list[float]()
    kept, active, since = np.full(len(names), True), set[str](), 0

    def choose(sums: Sums) -> ChosenGroups:
        """Choose among the groups whose columns are kept."""
        here = names[kept].tolist()
        groups = {name: slice(here.index(name), here.index(name) + here.count(name)) for name in dict.fromkeys(here)}
        found, weights = choose_groups(sums, groups, rules, rare=patient), np.zeros(len(names))
        weights[kept] = found.weights
        return found._replace(weights=weights)

    def stepped(chosen: ChosenGroups) -> dict[str, float]:
        """The chosen curves, and the moving coordinates a step further."""
        if not chosen.gains:
            return {}
        here = values_at({**task.theta, **now}, moving)
        step = np.clip(chosen.weights[own], -FARTHEST, FARTHEST) * (high - low)
        return {**theta_at({}, moving, np.clip(here + step, low, high)), **_theta(offer, chosen)}

    while True:
        chosen = choose(given)
        if not chosen.gains:
            return {}, {}, ()
        left.append(float(np.linalg.norm(errors, axis=1).mean()))
        apart.append(float(np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean())))
        # At the pace of the last step another would not do.
        if len(left) > 2 and apart[-1] - task.aim > apart[-2] - apart[-1]:
            return {}, chosen.gains, ()
        if kept.all():
            if len(left) >= ROUNDS or (len(left) > 2 and set(chosen.gains) == active):
                break
            active, since = set(chosen.gains), len(left) - 1
        # All are offered again after the first step, which is the longest, where the chosen ones settled, and at last.
        every = len(left) in (1, ROUNDS - 1) or min(left[-2:]) > SETTLED * min(left[since:-2], default=np.inf)
        kept = every | np.isin(names, [*active, LEVEL, MODEL])
        offered = replace(offer, curves=tuple(curve for curve in offer.curves if curve.group in names[kept]))
        now = stepped(chosen)
        chosen.weights[own] = 0.0
        given, errors = _linearise(drives, {**task.theta, **now}, offered, moving, chosen.weights[kept])
    fold = np.arange(_parts(drives)) % FOLDS
    without = [given.only(np.flatnonzero(fold != one)) for one in range(FOLDS)]
    return stepped(chosen), chosen.gains, [stepped(choose(some)) for some in without]


def _theta(offer: Learnt, choice: ChosenGroups) -> dict[str, float]:
    """The chosen groups with their weights, by their names in θ."""
    curves = tuple(
        curve._replace(weights=tuple((prior_root(curve) @ weights).tolist()))
        for curve, weights in zip(offer.curves, split_by_curve(offer, choice.weights), strict=True)
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
        if count_blocks(drives, windows) >= drives.rules.discrepancy_blocks:
            before, after = known.get(horizon_s) or (
                squared_distances(drives, theta, windows),
                _cross_validate(drives, theta, folds, windows),
            )
            found[horizon_s] = ratio_over(drives, windows, after, before)
    return found


def _cross_validate(drives: Drives, theta: Theta, folds: Sequence[Theta], windows: Windows) -> Floats:
    """Squared distance at every compared pose (M,), each predicted by the fit that left its block out."""
    squares = np.empty(len(windows.increment))
    fold_of = drives.block[windows.begin] % _parts(drives) % FOLDS
    for number, fold in enumerate(folds):
        own = fold_of == number
        if own.any():
            part = select_windows(windows, own)
            squares[own[windows.window]] = squared_distances(drives, {**theta, **fold}, part)
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
    """A named effect that keeps most of what curves gain."""

    effect: str  # its name
    form: str  # what is special about its form
    theta: Mapping[str, float]  # its values by their names in θ
    share: float  # the share of the gain that it keeps; it was tuned to all windows, the curves to others than these


def match_named_effect(
    drives: Drives, theta: Theta, discrepancy: Discrepancy, taken: Iterable[str]
) -> MatchedEffect | None:
    """Find the named effect, not taken, that removes as much error as the curves, if one keeps most of their gain."""
    windows = cut(drives, FITTED_S)

    def loss(candidate: Candidate, values: Floats) -> float:
        low, high = spans(candidate.free, drives)
        moved = candidate.theta_at(theta, np.clip(values, low, high))
        return float(squared_distances(drives, moved, windows).mean())

    plain = float(squared_distances(drives, theta, windows).mean())
    gained = plain - float(discrepancy.held_out.mean())
    if gained <= 0.0:
        return None
    forms = candidates(drives.robot, theta, taken)
    probed = [min((loss(one, np.array(p)), number, p) for p in one.probes) for number, one in enumerate(forms)]
    tuned = [_tune(forms[number], np.array(probe), loss, drives) for _, number, probe in sorted(probed)[:PROMISING]]
    least, form, values = min(tuned, key=lambda found: found[0])
    share = (plain - least) / gained
    found = form.theta_at({}, values)
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
    """The learnt discrepancy and what it is worth."""

    discrepancy: Discrepancy  # the curves, beside all named effects
    errors: tuple[LearntError, ...]  # what they are worth, by horizon, shortest first; empty where they are not used
    # whether curves beside what is declared alone predict clearly better: then the names are wrong, and the
    # curves are these
    names_doubtful: bool
    looks_like: MatchedEffect | None = None  # the named effect that would do nearly as well as the curves, or None
    # all values of the model with the curves, by name in θ; empty where they are not used
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
    if count_blocks(drives, windows) < drives.rules.fewest_blocks:
        return None
    before, after = (pose_errors(drives, theta, windows) ** 2 for theta in (names, model))
    compared, blocks = ratio_over(drives, windows, after[:, 0], before[:, 0]), blocks_of(drives, windows)
    return LearntError(horizon_s, rmse(after[:, 0], blocks), rmse(after[:, 1], blocks), compared)


def _beside_declared(found: Findings, beside: Discrepancy) -> Discrepancy | None:
    """Curves beside what is declared alone, if there are names and these predict clearly better without them."""
    drives, names = found.model.drives, found.model.theta
    if not found.adopted or not len(beside.held_out):
        return None
    noise, windows = pose_noise(drives, names), cut(drives, FITTED_S)
    if _is_noise(drives, noise, windows, beside.held_out, drives.rules.doubtful_names):
        return None
    alone = fit_discrepancy(drives, found.declared.theta, found.declared.free, beside.held_out)
    return alone if alone.used else None
