"""Where the next examinations tell most about PLV: a pure function of the scores that are known."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.learning.curve_model import places
from proxytune.learning.curves import Array, Curve
from proxytune.learning.plv import SampleNeeds

BEYOND = 1.5
"""An η that is not reached is weighed as if it lay at so many times the largest count."""
APART = 2
"""Somebody may be examined at every so many places of the drawn curves."""
FIRST_COUNTS, FIRST_REPETITIONS = 4, 2
"""What is examined before anything is known."""


class Examination(NamedTuple):
    """One examination: of which learning curve, in which repetition, after how many target samples."""

    curve: str
    repetition: int
    samples: int


Scores = Mapping[Examination, float]


@dataclass(frozen=True)
class Spending:
    """How examinations are spent.

    Attributes:
        none: The name of the learner without a proxy, which knows nothing before its first target sample.
        counts: The grid of numbers of target samples, rising from 0; any number from its second on may be examined.
        repetitions: The most repetitions there may be.
        batch: How many examinations are chosen at once.
    """

    none: str
    counts: tuple[int, ...]
    repetitions: int
    batch: int


@dataclass(frozen=True)
class _Cells:
    """Where somebody may be examined: curve by number and name, count, and drawn mean scores (draws, cells)."""

    number: NDArray[np.intp]
    name: tuple[str, ...]
    count: NDArray[np.intp]
    drawn: Array


def curves_of(counts: Sequence[int], scores: Scores) -> dict[str, Curve]:
    """Scores as learning curves, by name, each over the grid of counts and what was examined between these."""
    return {name: _curve(counts, name, scores) for name in dict.fromkeys(one.curve for one in scores)}


def _curve(counts: Sequence[int], name: str, scores: Scores) -> Curve:
    own = [one for one in scores if one.curve == name]
    all_counts = sorted({*counts, *(one.samples for one in own)})
    table = np.full((1 + max(one.repetition for one in own), len(all_counts)), np.nan)
    for one in own:
        table[one.repetition, all_counts.index(one.samples)] = scores[one]
    return Curve(tuple(all_counts), table)


def first_examinations(names: Sequence[str], spending: Spending) -> list[Examination]:
    """What is examined before anything is known: counts from the first to the last, in two repetitions."""
    return [
        Examination(name, repetition, count)
        for repetition in range(min(FIRST_REPETITIONS, spending.repetitions))
        for name in names
        for count in _spread_counts(spending.counts, first=int(name == spending.none))
    ]


def _spread_counts(counts: tuple[int, ...], first: int) -> list[int]:
    """Counts spread over the grid from the place of the first one to the last."""
    places_ = np.linspace(first, len(counts) - 1, FIRST_COUNTS).round().astype(int)
    return [counts[place] for place in sorted(set(places_.tolist()))]


def next_examinations(needs: SampleNeeds, names: Sequence[str], spending: Spending) -> list[Examination]:
    """Choose the examinations that are expected to take most from the variance of all proxies' PLV, one by one.

    What a score would tell is taken from how the drawn mean curve there goes with the drawn PLVs, as in linear
    regression; the next is chosen for what is left of the variance.

    Args:
        needs: What the scores known so far say.
        names: The curves that may be examined. PLV is that of the proxies among them; without one, it is how many
            samples are needed without a proxy that is to be known.
        spending: How examinations are spent.

    Returns:
        A batch of them; fewer where every repetition of every count has been examined.
    """
    cells, wanted = _cells(needs, names, spending), _finite_plv(needs, names, spending.none)
    targets = wanted.shape[1]
    joint = np.cov(np.column_stack((wanted, cells.drawn)), rowvar=False)
    noise = needs.draws.model.noise_at(cells.number, places(cells.count.astype(float), needs.draws.first))
    done = {
        Examination(name, int(repetition), curve.counts[place])
        for name, curve in needs.curves.items()
        for repetition, place in curve.examined
    }
    chosen: list[Examination] = []
    while len(chosen) < spending.batch:
        tells = np.sum(joint[:targets, targets:] ** 2, axis=0) / (np.diag(joint)[targets:] + noise)
        ordered = np.argsort(-tells, kind="stable").tolist()
        free = ((cell, _next_of(cells, cell, done, spending)) for cell in ordered)
        best, examination = next(((cell, one) for cell, one in free if one), (0, None))
        if examination is None:
            break
        chosen.append(examination)
        done.add(examination)
        column = joint[:, targets + best]
        joint = joint - np.outer(column, column) / (column[targets + best] + noise[best])
    return chosen


def _cells(needs: SampleNeeds, names: Collection[str], spending: Spending) -> _Cells:
    """Every place of the drawn curves at which somebody may be examined."""
    counts, scores = needs.draws.counts.round().astype(int), needs.draws.scores
    open_ = {
        counts[place]: place
        # Of places of one count the last one: before the first count a learner without a proxy is not drawn
        for place in (*range(0, len(counts) - 1, APART), len(counts) - 1)
        if not place or counts[place] >= spending.counts[1]
    }
    cells = [
        (number, name, place)
        for number, name in enumerate(needs.curves)
        for count, place in open_.items()
        if name in names and (count or name != spending.none) and np.isfinite(scores[name][0, place])
    ]
    drawn = np.column_stack([scores[name][:, place] for _, name, place in cells])
    at = np.array([place for _, _, place in cells])
    return _Cells(np.array([number for number, _, _ in cells]), tuple(name for _, name, _ in cells), counts[at], drawn)


def _finite_plv(needs: SampleNeeds, names: Sequence[str], none: str) -> Array:
    """PLV of every proxy in every draw (draws, proxies), what is not reached taken as some way beyond the grid."""
    needed = {name: np.minimum(samples, BEYOND * needs.last) for name, samples in needs.needed.items()}
    proxies = [name for name in names if name != none]
    return np.column_stack([needed[none] - needed[name] for name in proxies] or [needed[none]])


def _next_of(cells: _Cells, cell: int, done: Collection[Examination], spending: Spending) -> Examination | None:
    """The examination here in the repetition in which this learner has been examined least; None if all are done."""
    name, count = cells.name[cell], int(cells.count[cell])
    often = Counter(one.repetition for one in done if one.curve == name)
    possible = (Examination(name, number, count) for number in range(spending.repetitions))
    free = [one for one in possible if one not in done]
    return min(free, key=lambda one: (often[one.repetition], one.repetition), default=None)
