"""The choice of groups of curves by ridge regression, one scale a group, on blocks that are left out."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.window_slopes import Slopes
from proxytune.diagnosis.measured.drives import Floats, Whole, sum_by
from proxytune.diagnosis.rules import RULES
from proxytune.effects.learnt.features import LEVEL

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
