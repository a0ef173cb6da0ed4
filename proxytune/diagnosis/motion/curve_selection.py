"""Which groups of curves a discrepancy has: forward selection with a ridge of one scale a group, on parts left out.

From the squares of the errors and of the curves' columns, summed by part (`sum_squares`), `choose_groups` gives the
weights of the groups that pay. Nothing is replayed here: leaving a part out is a solution of normal equations.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.answer import Rules
from proxytune.diagnosis.motion.curve_offer import CORRELATED
from proxytune.diagnosis.motion.drives import Floats, Whole, sum_by
from proxytune.diagnosis.motion.prediction import Slopes
from proxytune.effects import LEVEL, PLACE

RIDGES = (1e-3, 1e-2, 1e-1, 1.0)
"""Pulls towards no curve that are tried, as shares of what an average weight of the group is held by."""
FIRMEST_ONLY = {"speed_and_turn": 0.1}
"""Curves over two signals with independent weights are never pulled less: most of their knots are seldom visited."""
CORRELATED_PULL = 3e-4
"""Correlated weights hold each other: each is pulled by this share of what all of its group are held by."""
FREE, MODEL_PULL = 1e-6, 1e-2
"""The level is hardly pulled; the model's own values are, so that the level takes what both could."""
MODEL = "model"
"""The columns of the model's own values, which move along with the curves: a curve takes back no delay."""
ROBUST = 1.5
"""Errors beyond so many medians count less and less."""


class Sums(NamedTuple):
    """Weighted squares by part: of columns with each other, (K, K) each, with the errors (P, K), of the errors (P,)."""

    hessian: Sequence[Floats]
    gradient: Floats
    size: Floats

    def only(self, chosen: Whole) -> "Sums":
        """Some of the parts."""
        return Sums([self.hessian[number] for number in chosen], self.gradient[chosen], self.size[chosen])

    def of(self, columns: Whole) -> "Sums":
        """Some of the columns."""
        return Sums([one[np.ix_(columns, columns)] for one in self.hessian], self.gradient[:, columns], self.size)


class ChosenGroups(NamedTuple):
    """The weights of all columns, 0 where a group was not chosen, and the squared error that each group took away."""

    weights: Floats
    gains: Mapping[str, float]


def sum_squares(slopes: Slopes, weights: Floats, part: Whole, parts: int) -> Sums:
    """Sum over the poses of each part, linearised round these weights; errors are counted from weights of 0."""
    errors = slopes.residuals + slopes.columns @ weights
    size = np.sqrt((slopes.residuals**2).sum(axis=1))
    trust = 1.0 / np.sqrt(1.0 + (size / (ROBUST * np.median(size) + 1e-12)) ** 2)
    hessian = []
    for number in range(parts):
        own = part == number
        columns = slopes.columns[own].reshape(-1, slopes.columns.shape[2])
        hessian.append((columns * np.repeat(trust[own], 3)[:, None]).T @ columns)
    gradient = sum_by(part, np.einsum("mck,mc,m->mk", slopes.columns, errors, trust), parts)
    return Sums(hessian, gradient, sum_by(part, (errors**2).sum(axis=1) * trust, parts))


def choose_groups(given: Sums, groups: Mapping[str, slice], rules: Rules, *, rare: bool = False) -> ChosenGroups:
    """Add groups one by one, the best first, while they pay on parts left out; level and model are always there.

    A group pays if it surely makes the errors of most parts less; one of rare moments, if it takes much of all error.
    A map gives way to a curve over x or y, which is one too, if that is within one standard error of it.
    """
    mean, nothing = np.sum([hessian.diagonal() for hessian in given.hessian], axis=0), 1e-12 * given.size.mean()
    unit = {
        name: float(CORRELATED_PULL * mean[own].sum() if name in CORRELATED else mean[own].mean())
        for name, own in groups.items()
    }

    def pays(before: Floats, after: Floats) -> bool:
        # Errors of parts differ by orders of magnitude: each counts by its ratio.
        less = -np.diff(np.log(np.maximum((before, after), nothing)), axis=0)[0]
        sure = less.sum() > rules.group_t * np.sqrt(len(less)) * less.std(ddof=1)
        much = rare and after.sum() < (1.0 - rules.rare_group_share) * before.sum()
        return bool((sure or much) and after.sum() < (1.0 - rules.group_share) * before.sum())

    always = {LEVEL: FREE * unit.get(LEVEL, 0.0), MODEL: MODEL_PULL * mean[groups.get(MODEL, slice(0))]}
    pulls: dict[str, float | Floats] = {name: pull + 1e-9 for name, pull in always.items() if name in groups}
    gains: dict[str, float] = {}
    held = _hold_nothing(given)
    for name, pull in pulls.items():
        held = _hold(given, held, groups[name], pull)
    (losses,) = _held_out_losses(given, held, slice(0), np.zeros(1))
    level = {LEVEL: float((given.size - losses).sum())} if LEVEL in pulls and pays(given.size, losses) else {}
    while True:
        tried = {name: _try_group(given, held, groups[name], name, unit[name]) for name in groups if name not in pulls}
        paying = {name: found for name, found in tried.items() if pays(losses, found[1])}
        if not paying:
            break
        best = min(paying, key=lambda name: float(paying[name][1].sum()))
        if best == PLACE:
            nested = {name: paying[name][1] for name in "xy" if name in paying}
            alike = [name for name, after in nested.items() if _does_as_well(after, paying[best][1])]
            best = min(alike, key=lambda name: float(nested[name].sum()), default=best)
        pulls[best], after = paying[best]
        gains[best] = float((losses - after).sum())
        losses, held = after, _hold(given, held, groups[best], pulls[best])
    weights = np.zeros(len(mean))
    total = held.inside.sum(axis=0) + np.diag(held.penalty)
    weights[held.columns] = np.linalg.solve(total, given.gradient.sum(axis=0)[held.columns])
    return ChosenGroups(weights, gains or level)


class _Held(NamedTuple):
    """Columns held by penalties, and what they take of all: solved for once, for all that may come."""

    columns: Whole  # (K,), in the order in which they came
    penalty: Floats  # (K,)
    own: Floats  # the squares of each part with all N columns (P, K, N)
    inside: Floats  # and with each other (P, K, K)
    rest: Floats  # those of all other parts (P, K, N)
    answer: Floats  # the weights that take all columns and the errors of all other parts (P, K, N + 1)


def _hold_nothing(given: Sums) -> _Held:
    parts, width = given.gradient.shape
    none = np.empty((parts, 0, width + 1))
    return _Held(np.arange(0), none[0, :, 0], none[:, :, :-1], none[:, :, :0], none[:, :, :-1], none)


def _hold(given: Sums, held: _Held, group: slice, pull: float | Floats) -> _Held:
    """Hold a group too, with one pull or one for each column; what is held is eliminated by Schur's complement."""
    own = np.stack([hessian[group] for hessian in given.hessian])
    rest = _of_others(own)
    left = np.concatenate((rest, _of_others(given.gradient)[:, group, None]), axis=2)
    left -= rest[:, :, held.columns] @ held.answer
    last = np.linalg.solve(left[:, :, group] + pull * np.eye(own.shape[1]), left)
    answer = np.concatenate((held.answer - held.answer[:, :, group] @ last, last), axis=1)
    columns = np.append(held.columns, np.arange(group.start, group.stop))
    penalty = np.append(held.penalty, np.broadcast_to(pull, own.shape[1]))
    own, rest = (np.concatenate(two, axis=1) for two in ((held.own, own), (held.rest, rest)))
    return _Held(columns, penalty, own, own[:, :, columns], rest, answer)


def _of_others(own: Floats) -> Floats:
    """The sums over all other parts, for each part (P, …)."""
    return np.asarray(own.sum(axis=0) - own)


def _try_group(given: Sums, held: _Held, own: slice, name: str, unit: float) -> tuple[float, Floats]:
    """The hardest pull of a group within one standard error of its best, and the losses of the parts with it."""
    pulls = np.array([ridge for ridge in RIDGES if ridge >= FIRMEST_ONLY.get(name, 0.0)]) * unit + 1e-9
    found = _held_out_losses(given, held, own, pulls)
    best = min(found, key=np.sum)
    return next(
        (pull, losses)
        for pull, losses in zip(pulls[::-1].tolist(), found[::-1], strict=True)
        if _does_as_well(losses, best)
    )


def _does_as_well(losses: Floats, best: Floats) -> bool:
    """Tell whether losses of parts (P,) are within one standard error of the best."""
    worse = losses - best
    return bool(worse.sum() <= np.sqrt(len(worse)) * worse.std(ddof=1))


def _held_out_losses(given: Sums, held: _Held, own: slice, pulls: Floats) -> Floats:
    """The squared error of each part with weights from all others, own columns under each pull (R,): (R, P)."""
    inside = np.stack([hessian[own, own] for hessian in given.hessian])
    across, answer, alone = held.own[:, :, own], held.answer[:, :, own], held.answer[:, :, -1:]
    back, gradient = np.swapaxes(held.rest[:, :, own], 1, 2), given.gradient[:, :, None]
    left = _of_others(inside) - back @ answer
    right = _of_others(gradient[:, own]) - back @ alone
    last = np.concatenate([np.linalg.solve(left + pull * np.eye(left.shape[1]), right) for pull in pulls], axis=2)
    first = alone - answer @ last
    bent = held.inside @ first + 2.0 * (across @ last) - 2.0 * gradient[:, held.columns]
    more = inside @ last - 2.0 * gradient[:, own]
    return np.asarray(given.size + (first * bent).sum(axis=1).T + (last * more).sum(axis=1).T)
