"""The worth of the points that an engine visited: how good they are, and what they tell of the truth."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from problems import Objective

from proxytune.identity import meaning_of
from proxytune.search import Knowledge, Trial, Values, code_of, fit_surrogate, learn_theta


@dataclass(frozen=True)
class Reading:
    """What every output of the visited points tells of θ, whichever engine chose them."""

    share: float  # how much of the box the 95 % region is
    holds: bool | None  # whether the truth is in it; None where that is not known
    # for each parameter of the box, whether its 95 % interval holds the truth; None as above
    intervals_hold: Mapping[str, bool] | None
    # how likely a proxy that fits is to be as far from the target; None with too few points to tell
    p_value: float | None
    fits: bool | None  # whether the proxy may have made the target; None as above


@dataclass(frozen=True)
class Judgement:
    """What an engine achieved."""

    # regret of every visited point, in order, or of one no better than those before it a figure that is no less
    # than theirs; None where the trial failed
    regrets: tuple[float | None, ...]
    answer: Values  # the visited point that a study would report
    answer_score: float | None  # its score, free of the noise that the engine has seen; None where it failed
    answer_regret: float | None  # its regret, free of that noise; None where it failed
    error: float | None  # its distance from the truth in widths of the box, None where truth is not known
    reading: Reading | None  # what the points tell of the truth; None where a score has no parts
    code: str  # digest of the code that judged

    @property
    def best_regrets(self) -> tuple[float, ...]:
        """The lowest regret of the points visited so far, after each evaluation; infinite while all have failed."""
        lowest, found = math.inf, []
        for regret in self.regrets:
            lowest = min(lowest, math.inf if regret is None else regret)
            found.append(lowest)
        return tuple(found)

    def evaluations_to(self, tolerance: float) -> int | None:
        """How many evaluations it took to visit a point within the tolerance; None if the budget did not suffice."""
        return next((n for n, regret in enumerate(self.best_regrets, 1) if regret <= tolerance), None)


def judge(objective: Objective, visited: Sequence[Values], seed: int, *, by_outputs: bool) -> Judgement:
    """Judge the points that were visited.

    Args:
        objective: Where.
        visited: The points in order.
        seed: The instance of the problem.
        by_outputs: Whether the answer is the point of lowest expected score composed of its outputs, as a study reports
            it of an engine that learns from them; otherwise it is that of the lowest posterior mean of the score.

    Raises:
        RunError: If no trial has a score.
    """
    trials = [Trial(values, objective.score(values, seed), objective.outcome(values, seed)) for values in visited]
    goal = objective.goal(seed)
    known = None if goal is None else learn_theta(objective.space, trials, goal, seed)
    answer = known.answer if known and by_outputs else fit_surrogate(objective.space, trials).incumbent()[0]
    return Judgement(
        regrets=_regrets(objective, visited, seed),
        answer=answer,
        answer_score=objective.fresh_score(answer, seed),
        answer_regret=objective.fresh_regret(answer, seed),
        error=objective.error(answer, seed),
        reading=None if known is None else _read(known, objective.truth(seed)),
        code=judging_code(),
    )


def _regrets(objective: Objective, visited: Sequence[Values], seed: int) -> tuple[float | None, ...]:
    lowest, found = math.inf, []
    for values in visited:
        regret = objective.regret(values, seed, lowest)
        lowest = min(lowest, math.inf if regret is None else regret)
        found.append(regret)
    return tuple(found)


def _read(known: Knowledge, truth: Values | None) -> Reading:
    held = None
    if truth is not None:
        values = known.space.theta(truth)
        held = {name: bool(low <= values[name] <= high) for name, (low, high) in known.intervals.items()}
    misfit = known.misfit
    holds = None if truth is None else known.holds(truth)
    return Reading(known.posterior.share, holds, held, misfit.p_value, misfit.fits)


def judging_code() -> str:
    """A digest of the code of this judgement: with other code, a run is to be judged again."""
    here = Path(__file__).resolve()
    return f"{meaning_of([here], here.parent)[:12]} {code_of(learn_theta.__module__, fit_surrogate.__module__)}"


def judgement_from(document: Mapping[str, Any]) -> Judgement:
    """The judgement that was written as plain JSON.

    Raises:
        KeyError: If something is missing.
        TypeError: If something is of another kind.
    """
    fields = dict(document)
    reading = fields.pop("reading")
    regrets, answer = (tuple(fields.pop(name)) for name in ("regrets", "answer"))
    return Judgement(regrets=regrets, answer=answer, reading=None if reading is None else Reading(**reading), **fields)
