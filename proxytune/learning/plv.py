"""Proxy learning value: how many target samples a proxy saves (Courchesne et al. 2021, equation 5).

With η the target samples that a learner needs to converge, without a proxy (∅) and after the proxy S,

    PLV(S) = η(∅) − η(S)                                                                                     (eq. 5)

`sample_needs` gives η draw by draw from the posterior of all learning curves (curve_model.py), and `teaching_value`
PLV, factor and reduction with their 95 % intervals. Where examinations are chosen (`AdaptiveDesign`), the next ones are
those that are expected to take most from the variance of PLV: a pure function of the scores that are known. `Published`
is what others found of proxies of the same names, to stand beside what is measured here.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.arrays import Floats
from proxytune.learning.curve_model import POSTERIOR_DRAWS, CurveDraws, LearningCurve, crossing, doublings, draw_curves
from proxytune.settings import Section

NONE = "none"
"""The name of the learner without a proxy, which no proxy may have; it knows nothing before its first target sample."""
LEVELS = (0.025, 0.975)
"""Ends of a 95 % interval, as quantiles of draws."""
ROUNDING = 1e-9


@dataclass(frozen=True)
class Convergence:
    """The rule by which a learner counts as having converged in the target."""

    level: float  # the score it has to reach: what it converges to without a proxy, unless stated otherwise
    tolerance: float  # how far below that level still counts as there

    @property
    def threshold(self) -> float:
        """The lowest mean score that counts."""
        return self.level - self.tolerance


@dataclass(frozen=True)
class LearningEstimate:
    """A figure with its 95 % interval; None where it was not reached, or where the interval's end was not."""

    value: float | None
    low: float | None
    high: float | None

    @property
    def above_zero(self) -> bool:
        """True if its whole interval lies above 0; how far above may be unknown."""
        return self.low is not None and self.low > 0.0

    @property
    def at_most_zero(self) -> bool:
        """True if no part of its interval lies above 0."""
        return self.high is not None and self.high <= 0.0


@dataclass(frozen=True)
class TeachingValue:
    """The worth of a proxy as a teacher."""

    without: LearningEstimate  # target samples needed without it, η(∅)
    needed: LearningEstimate  # target samples needed with it, η(S)
    plv: LearningEstimate  # η(∅) − η(S): below zero where the proxy harms; none where either is not reached
    factor: LearningEstimate  # η(∅) / η(S); None also where none are needed
    reduction: LearningEstimate  # PLV as a share of η(∅)


@dataclass(frozen=True)
class SampleNeeds:
    """The target samples that each learner needs, draw by draw from the posterior of the learning curves."""

    curves: Mapping[str, LearningCurve]  # the scores that the examinations gave, by name
    draws: CurveDraws  # the mean curves
    when: Convergence  # when a learner counts as converged; its level is the posterior's mean where none was stated
    # what the learner without a proxy gains over the last doubling of samples; None where it has learnt nothing
    # before that
    gain: float | None
    needed: Mapping[str, Floats]  # η by name (draws,); infinite where it is not reached up to the largest count

    @property
    def settled(self) -> bool:
        """True if the learner without a proxy converges: over the last doubling it gains no more than the tolerance."""
        return self.gain is not None and self.gain <= self.when.tolerance

    @property
    def last(self) -> float:
        """The largest number of target samples."""
        return float(self.draws.counts[-1])

    def fewest(self, name: str) -> Floats:
        """The fewest target samples that a learner may need, draw by draw.

        One that knows nothing at 0 and has converged at the first count may have needed a single sample.
        """
        needed, untaught = self.needed[name], np.isnan(self.draws.scores[name][:, 0])
        return np.where(untaught & (needed <= self.draws.first), 1.0, np.minimum(needed, self.last))


def sample_needs(
    curves: Mapping[str, LearningCurve],
    *,
    best_score: float,
    tolerance: float,
    level: float | None = None,
    draws: int = POSTERIOR_DRAWS,
) -> SampleNeeds:
    """Infer the target samples that each learner needs, from the posterior of all learning curves together.

    No score is expected beyond that of a flawless examination, nor below its negative. Without a level, what the
    learner without a proxy comes to counts as converged, up to the tolerance.
    """
    # A family's own scores may lie beyond those of one that drives.
    scores = np.concatenate([curve.scores[np.isfinite(curve.scores)] for curve in curves.values()])
    bounds = float(min(-best_score, scores.min())), float(max(best_score, scores.max()))
    drawn = draw_curves(curves, bounds, draws)
    alone = drawn.scores[NONE]
    levels = alone[:, -1] if level is None else np.full(len(alone), level)
    needed = {
        name: crossing(drawn.counts, drawn.scores[name], levels - tolerance, drawn.first) for name in drawn.scores
    }
    when = Convergence(float(levels.mean()) if level is None else level, tolerance)
    return SampleNeeds(curves, drawn, when, _last_gain(drawn, alone), needed)


def _last_gain(drawn: CurveDraws, alone: Floats) -> float | None:
    """The gain of the learner without a proxy over the last doubling of samples; None if it begins within that."""
    if 2.0 * drawn.first > drawn.counts[-1] * (1.0 + ROUNDING):
        return None
    # Where the first count is half the last one, the place drawn next to it may lie before anything is learnt
    half = max(np.flatnonzero(2.0 * drawn.counts <= drawn.counts[-1])[-1], np.argmax(np.isfinite(alone[0])))
    return float(alone[:, -1].mean() - alone[:, half].mean())


def teaching_value(needs: SampleNeeds, proxy: str) -> TeachingValue:
    """The worth of a proxy as a teacher, with 95 % intervals.

    Where convergence is not reached, η is known to lie beyond the largest count: ends that this leaves open are None.
    """
    return TeachingValue(
        without=samples_needed(needs, NONE),
        needed=samples_needed(needs, proxy),
        plv=more_needed(needs, more=NONE, less=proxy),
        factor=estimate_figure(lambda alone, taught: alone / taught, needs, more=NONE, less=proxy),
        reduction=estimate_figure(lambda alone, taught: 1.0 - taught / alone, needs, more=NONE, less=proxy),
    )


def samples_needed(needs: SampleNeeds, name: str) -> LearningEstimate:
    """The target samples that a learner needs, with its 95 % interval; None beyond the largest count."""
    needed = needs.needed[name]
    return _ends(least=needs.fewest(name), middle=needed, most=needed)


def more_needed(needs: SampleNeeds, *, more: str, less: str) -> LearningEstimate:
    """The target samples that one learner needs more than another, with the 95 % interval."""
    return estimate_figure(lambda one, other: one - other, needs, more=more, less=less)  # eq. (5)


def estimate_figure(
    figure: Callable[[Floats, Floats], Floats], needs: SampleNeeds, *, more: str, less: str
) -> LearningEstimate:
    """A figure of what two learners need, with the ends of its 95 % interval that the grid's two ends leave possible.

    Draw by draw, it rises with the η of the one that needs more and falls with that of the other.
    """
    first, second = needs.needed[more], needs.needed[less]
    reached = np.isfinite(second)
    with np.errstate(invalid="ignore", divide="ignore"):
        least = np.where(reached, figure(needs.fewest(more), second), -np.inf)
        most = figure(first, needs.fewest(less))
        # Even a figure that is bounded is not known where the first is not
        known = np.where(np.isfinite(first), figure(first, second), np.inf)
    return _ends(least=least, middle=np.where(reached, known, -np.inf), most=most)


def mean_score(needs: SampleNeeds, name: str, place: int) -> LearningEstimate:
    """The mean score of a learner at a place of the drawn curves; None before anything can have been learnt."""
    scores = needs.draws.scores[name][:, place]
    return LearningEstimate(*(_finite(float(end)) for end in (scores.mean(), *np.quantile(scores, LEVELS))))


def _ends(*, least: Floats, middle: Floats, most: Floats) -> LearningEstimate:
    """The median of a figure, and its 95 % interval from the least and the most that it may be in each draw."""
    ends = (_quantile(middle, 0.5), _quantile(least, LEVELS[0]), _quantile(most, LEVELS[1]))
    return LearningEstimate(*(_finite(end) for end in ends))


def _quantile(values: Floats, level: float) -> float:
    """The value at a level, without interpolating towards infinity; NaN where nothing is known."""
    known = np.sort(values[~np.isnan(values)])
    return float(known[round(level * (len(known) - 1))]) if len(known) else np.nan


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


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


ExaminationScores = Mapping[Examination, float]


@dataclass(frozen=True)
class AdaptiveDesign:
    """The adaptive design of examinations."""

    # the grid of numbers of target samples, rising from 0; any number from its second on may be examined
    counts: tuple[int, ...]
    repetitions: int  # the most repetitions there may be
    batch: int  # how many examinations are chosen at once


def curves_of(counts: Sequence[int], scores: ExaminationScores) -> dict[str, LearningCurve]:
    """Scores as learning curves, by name, each over the grid of counts and what was examined between these."""
    return {name: _curve(counts, name, scores) for name in dict.fromkeys(one.curve for one in scores)}


def _curve(counts: Sequence[int], name: str, scores: ExaminationScores) -> LearningCurve:
    own = [one for one in scores if one.curve == name]
    all_counts = sorted({*counts, *(one.samples for one in own)})
    table = np.full((1 + max(one.repetition for one in own), len(all_counts)), np.nan)
    for one in own:
        table[one.repetition, all_counts.index(one.samples)] = scores[one]
    return LearningCurve(tuple(all_counts), table)


def first_examinations(names: Sequence[str], design: AdaptiveDesign) -> list[Examination]:
    """The examinations before anything is known: counts from the first to the last, in two repetitions."""

    def spread(first: int) -> list[int]:
        """Counts spread over the grid from the place of the first one to the last."""
        places = np.linspace(first, len(design.counts) - 1, FIRST_COUNTS).round().astype(int)
        return [design.counts[place] for place in sorted(set(places.tolist()))]

    return [
        Examination(name, repetition, count)
        for repetition in range(min(FIRST_REPETITIONS, design.repetitions))
        for name in names
        for count in spread(first=int(name == NONE))
    ]


def next_examinations(needs: SampleNeeds, names: Sequence[str], design: AdaptiveDesign) -> list[Examination]:
    """Choose the examinations that are expected to take most from the variance of all proxies' PLV, one by one.

    What a score would tell is taken from how the drawn mean curve there goes with the drawn PLVs, as in linear
    regression; the next is chosen for what is left of the variance. PLV is that of the proxies among the names; without
    one, it is how many samples are needed without a proxy that is to be known. There are fewer than a batch where every
    repetition of every count has been examined.
    """
    cells, drawn = _cells(needs, names, design)
    # What is not reached is taken as some way beyond the grid.
    needed = {name: np.minimum(samples, BEYOND * needs.last) for name, samples in needs.needed.items()}
    alone = needed[NONE]
    wanted = np.column_stack([alone - needed[name] for name in names if name != NONE] or [alone])
    targets = wanted.shape[1]
    joint = np.cov(np.column_stack((wanted, drawn)), rowvar=False)
    numbers, counts = np.array([(number, count) for number, _, count in cells]).T
    noise = needs.draws.model.noise_at(numbers, doublings(counts.astype(float), needs.draws.first))
    done = {
        Examination(name, int(repetition), curve.counts[place])
        for name, curve in needs.curves.items()
        for repetition, place in curve.examined
    }
    chosen: list[Examination] = []
    while len(chosen) < design.batch:
        tells = np.sum(joint[:targets, targets:] ** 2, axis=0) / (np.diag(joint)[targets:] + noise)
        ordered = np.argsort(-tells, kind="stable").tolist()
        free = ((cell, _next_of(cells[cell], done, design)) for cell in ordered)
        best, examination = next(((cell, one) for cell, one in free if one), (0, None))
        if examination is None:
            break
        chosen.append(examination)
        done.add(examination)
        column = joint[:, targets + best]
        joint = joint - np.outer(column, column) / (column[targets + best] + noise[best])
    return chosen


def _cells(
    needs: SampleNeeds, names: Collection[str], design: AdaptiveDesign
) -> tuple[list[tuple[int, str, int]], Floats]:
    """All that may be examined: curve by number and name, and count; and the mean scores drawn there (draws, cells)."""
    counts, scores = needs.draws.counts.round().astype(int), needs.draws.scores
    open_ = {
        counts[place]: place
        # Of places of one count the last one: before the first count a learner without a proxy is not drawn
        for place in (*range(0, len(counts) - 1, APART), len(counts) - 1)
        if not place or counts[place] >= design.counts[1]
    }
    places = [
        (number, name, place)
        for number, name in enumerate(needs.curves)
        for count, place in open_.items()
        if name in names and (count or name != NONE) and np.isfinite(scores[name][0, place])
    ]
    drawn = np.column_stack([scores[name][:, place] for _, name, place in places])
    return [(number, name, int(counts[place])) for number, name, place in places], drawn


def _next_of(cell: tuple[int, str, int], done: Collection[Examination], design: AdaptiveDesign) -> Examination | None:
    """The examination here in the repetition in which this learner has been examined least; None if all are done."""
    _, name, count = cell
    often = Counter(one.repetition for one in done if one.curve == name)
    possible = (Examination(name, number, count) for number in range(design.repetitions))
    free = [one for one in possible if one not in done]
    return min(free, key=lambda one: (often[one.repetition], one.repetition), default=None)


KEYS = ("zero_shot", "samples", "reduction")


@dataclass(frozen=True)
class Published:
    """A row of somebody's table: score before any target sample, samples to converge, and the share saved."""

    zero_shot: float
    samples: int
    reduction: float


def read_published(section: Section, known: Mapping[str, object]) -> Mapping[str, Published]:
    """Read the rows, each named as a proxy of the study or as learning without one."""
    section.only((NONE, *known))
    return {name: _row(section.section(name)) for name in section.values}


def _row(section: Section) -> Published:
    section.only(KEYS)
    return Published(
        zero_shot=section.number("zero_shot"),
        samples=section.whole("samples", low=0, high=10**12),
        reduction=section.number("reduction", low=-1e6, high=1.0),
    )
