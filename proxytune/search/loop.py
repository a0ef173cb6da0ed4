"""The one search loop: propose a batch, have it evaluated, go on until something says stop.

A `Proposer` chooses the next θ as a pure function of the box, the finished trials and the seed; an `Evaluator` scores
it and remembers; `Search.run` is the loop. Which trials are proposed together follows from their numbers alone, and so
does what a batch is proposed from: the trials before it (`batch_at`). Neither the budget nor the moment at which a
search was stopped has a say in it. A `Goal` is the target as an engine sees it that learns from every output.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.space import Space

Values = tuple[float, ...]
"""A point of the search box: one value per parameter, in the order of the box."""
Compose = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Scores, shape (…,), of outcomes, shape (…, outputs)."""


@dataclass(frozen=True)
class Trial:
    """A trial: where it was, and the score that is to be made small."""

    values: Values  # the point, in the order of the box
    score: float | None  # its score, or None where the trial failed or is pending
    # what the score was computed from, one value per output; None where the trial failed or is pending, or where
    # the score has no such parts
    outcome: Values | None = None
    pending: bool = False  # whether it has been proposed and is not finished
    # which placement noise it was driven under: trials with the same number share theirs, 0 the study's
    placement: int = 0
    low_fidelity: bool = False  # whether it is of a cheaper proxy, whose outputs tell of this one's and are not those


class Proposer(Protocol):
    """Chooses where to look next, remembering nothing: that is what makes resuming exact."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point; the same for the same trials in the order in which they were made, pending ones last."""


def batch_at(index: int, size: int, initial: int) -> range:
    """The trials, counted from 0, that are proposed together with this one.

    The design makes batches of its own, the last of which may be short; those of the engine begin after it.
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

    Pending ones stay as they are, and those of a cheaper proxy. None at all if no trial has a score.
    """
    scored = [(trial.score, trial.values, trial.outcome) for trial in trials if trial.score is not None]
    if not scored:
        return []
    score, _, outcome = max(scored, key=lambda found: found[:2])
    kept = [trial.pending or trial.low_fidelity or trial.score is not None for trial in trials]
    pairs = zip(trials, kept, strict=True)
    return [trial if keep else replace(trial, score=score, outcome=outcome) for trial, keep in pairs]


BatchPoints = Callable[[], tuple[Values, ...]]
"""The points of a batch, worked out when asked for: an evaluator that has them already need not ask."""


class Evaluator(Protocol):
    """The evaluator of a search: it scores points, and remembers what was scored."""

    def trials(self) -> Sequence[Trial]:
        """The finished trials, in order."""

    def ended(self) -> str:
        """The reason why the search goes no further, in one phrase; empty while it does."""

    def evaluate(self, batch: range, propose: BatchPoints) -> None:
        """Score what is left of a batch of trials, counted from 0; `propose` gives the points of all of it."""


@dataclass(frozen=True)
class Search:
    """All that proposals are a function of, apart from the finished trials."""

    space: Space  # the box
    proposer: Proposer  # what proposes
    seed: int  # seed of all that is drawn
    budget: int  # how many trials at most
    initial: int  # how many of them come from the quasi-random design
    batch: int = 1  # how many are proposed together

    def run(self, evaluator: Evaluator) -> None:
        """Search from wherever the evaluator's trials were left.

        A batch is a function of the seed and the trials before it alone. Where the budget once cut a batch short, the
        rest of it is what it would have been.
        """
        while not evaluator.ended():
            finished = evaluator.trials()
            batch = batch_at(len(finished), self.batch, self.initial)
            batch = range(batch.start, min(batch.stop, self.budget))
            before, count = finished[: batch.start], len(batch)
            evaluator.evaluate(batch, partial(propose_batch, self.proposer, self.space, before, self.seed, count))


@dataclass(frozen=True, eq=False)
class Goal:
    """The target as a search sees it."""

    outputs: tuple[tuple[str, str], ...]  # agent and metric of each output of a trial
    values: Floats  # what each output is on the target, shape (outputs,); NaN where that is not known
    # variance of the difference between a trial and the target at the same θ, by placement noise on both sides,
    # shape (outputs,)
    noise: Floats
    compose: Compose  # the score (PRPV) of outputs (…, outputs)

    def __post_init__(self) -> None:
        count = len(self.outputs)
        if self.values.shape != (count,) or self.noise.shape != (count,):
            raise ValueError(f"{count} outputs, but values {self.values.shape} and noise {self.noise.shape}")
