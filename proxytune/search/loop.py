"""The one search loop: propose a batch, have it evaluated, go on until something says stop."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from proxytune.search.proposer import Proposer, Trial, Values, batch_at, propose_batch
from proxytune.space import Space

Propose = Callable[[], tuple[Values, ...]]
"""The points of a batch, worked out when asked for: an evaluator that has them already need not ask."""


class Evaluator(Protocol):
    """What a search is made on: it scores points, and remembers what was scored."""

    def trials(self) -> Sequence[Trial]:
        """The finished trials, in order."""
        ...

    def ended(self) -> str:
        """Why the search goes no further, in one phrase; empty while it does."""
        ...

    def evaluate(self, batch: range, propose: Propose) -> None:
        """Score what is left of a batch of trials, counted from 0; `propose` gives the points of all of it."""
        ...


@dataclass(frozen=True)
class Search:
    """What proposals are a function of, apart from the finished trials.

    Attributes:
        space: The box.
        proposer: What proposes.
        seed: Seed of all that is drawn.
        budget: How many trials at most.
        initial: How many of them come from the quasi-random design.
        batch: How many are proposed together.
    """

    space: Space
    proposer: Proposer
    seed: int
    budget: int
    initial: int
    batch: int = 1

    def run(self, evaluator: Evaluator) -> None:
        """Search from wherever the evaluator's trials were left.

        A batch is a function of the seed and the trials before it alone. Where the budget once cut a batch short, the
        rest of it is what it would have been.
        """
        while not evaluator.ended():
            finished = evaluator.trials()
            batch = batch_at(len(finished), self.batch, self.initial)
            batch = range(batch.start, min(batch.stop, self.budget))
            evaluator.evaluate(batch, partial(self._propose, finished[: batch.start], len(batch)))

    def _propose(self, before: Sequence[Trial], count: int) -> tuple[Values, ...]:
        return propose_batch(self.proposer, self.space, before, self.seed, count)
