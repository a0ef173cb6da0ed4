"""What proposes the next θ: a pure function of the space, the finished trials and the seed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.space import Space

Values = tuple[float, ...]
"""A point of the search box: one value per parameter, in the order of the box."""

Compose = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Scores, shape (…,), of outcomes, shape (…, outputs)."""


@dataclass(frozen=True)
class Trial:
    """A finished trial: where it was, and the score that is to be made small.

    Attributes:
        values: The point, in the order of the box.
        score: Its score, or None where the trial failed.
        outcome: What the score was computed from, one value per output; None where the trial failed, or where the
            score has no such parts.
    """

    values: Values
    score: float | None
    outcome: Values | None = None


class Proposer(Protocol):
    """Chooses where to look next, remembering nothing: that is what makes resuming exact."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point; the same for the same trials in the order in which they were made."""
        ...


def with_failures_as_worst(trials: Sequence[Trial]) -> list[Trial]:
    """The trials, a failed one with score and outcome of the worst, so that a search moves away from it.

    None at all if no trial has a score.
    """
    scored = [(trial.score, trial.values, trial.outcome) for trial in trials if trial.score is not None]
    if not scored:
        return []
    score, _, outcome = max(scored, key=lambda found: found[:2])
    return [replace(trial, score=score, outcome=outcome) if trial.score is None else trial for trial in trials]


def proposal_seed(seed: int, count: int) -> int:
    """The seed of what is drawn for the proposal after so many trials."""
    return int(np.random.SeedSequence([seed, count]).generate_state(1)[0])
