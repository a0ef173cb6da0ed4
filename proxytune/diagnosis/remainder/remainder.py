"""The learnt remainder: what no named effect explains, as curves over features; used only if shown to help."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from proxytune.diagnosis.horizon.polish import HORIZONS_S
from proxytune.diagnosis.horizon.window_slopes import FITTED_S, slopes_of
from proxytune.diagnosis.horizon.windows import Ratio, Windows, blocks_of, cut, pose_errors, ratio, select_windows
from proxytune.diagnosis.measured.drives import Drives, Floats, Whole
from proxytune.diagnosis.remainder.group_choice import Choice, Sums, choose, sums
from proxytune.diagnosis.remainder.offers import offer_curves
from proxytune.diagnosis.rules import RULES
from proxytune.effects.learnt.effect import Learnt
from proxytune.effects.learnt.features import GROUPS, LEVEL
from proxytune.effects.learnt.table import learnt_theta
from proxytune.space import Theta

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
