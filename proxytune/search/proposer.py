"""What proposes the next θ: a pure function of the space, the finished trials, the seed and the size of a batch.

Which trials are proposed together follows from their numbers alone, and so does what a batch is proposed from: the
trials before it. Neither the budget nor the moment at which a search was stopped has a say in it.
"""

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
    """A trial: where it was, and the score that is to be made small.

    Attributes:
        values: The point, in the order of the box.
        score: Its score, or None where the trial failed or is pending.
        outcome: What the score was computed from, one value per output; None where the trial failed or is pending, or
            where the score has no such parts.
        pending: Whether it has been proposed and is not finished.
    """

    values: Values
    score: float | None
    outcome: Values | None = None
    pending: bool = False


class Proposer(Protocol):
    """Chooses where to look next, remembering nothing: that is what makes resuming exact."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point; the same for the same trials in the order in which they were made, pending ones last."""
        ...


def batch_at(index: int, size: int, initial: int) -> range:
    """Which trials, counted from 0, are proposed together with this one.

    The design makes batches of its own, the last of which may be short; those of the engine begin after it.

    Args:
        index: Of a trial.
        size: How many trials make a batch.
        initial: How many trials come from the design.
    """
    first = 0 if index < initial else initial
    base = index - (index - first) % size
    return range(base, min(base + size, initial) if index < initial else base + size)


def propose_batch(
    proposer: Proposer, space: Space, finished: Sequence[Trial], seed: int, count: int
) -> tuple[Values, ...]:
    """So many points after these trials, each proposed while those before it are pending."""
    trials = list(finished)
    for _ in range(count):
        trials.append(Trial(proposer.propose(space, trials, seed), None, pending=True))
    return tuple(trial.values for trial in trials[len(finished) :])


def with_failures_as_worst(trials: Sequence[Trial]) -> list[Trial]:
    """The trials, a failed one with score and outcome of the worst, so that a search moves away from it.

    Pending ones stay as they are. None at all if no trial has a score.
    """
    scored = [(trial.score, trial.values, trial.outcome) for trial in trials if trial.score is not None]
    if not scored:
        return []
    score, _, outcome = max(scored, key=lambda found: found[:2])
    kept = [trial.pending or trial.score is not None for trial in trials]
    pairs = zip(trials, kept, strict=True)
    return [trial if keep else replace(trial, score=score, outcome=outcome) for trial, keep in pairs]
