"""The quasi-random design that all engines share, and what comes after it."""

from collections.abc import Sequence
from dataclasses import dataclass

from proxytune.search.design import design_point
from proxytune.search.proposer import Proposer, Trial, Values, with_failures_as_worst
from proxytune.space import Space


@dataclass(frozen=True)
class AfterDesign:
    """A proposer that is asked only once the quasi-random design is through and something has a score.

    It is told of a failed trial as if that had the worst score seen. Where it proposes a pending point once more, the
    design goes on in its place: what is tried together differs.

    Attributes:
        inner: The proposer.
        initial: How many trials come from the design.
    """

    inner: Proposer
    initial: int

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point: of the design, or what the inner proposer says."""
        told = with_failures_as_worst(trials)
        if len(trials) < self.initial or not told:
            return design_point(space, len(trials), seed)
        values = self.inner.propose(space, told, seed)
        again = any(trial.pending and trial.values == values for trial in trials)
        return design_point(space, len(trials), seed) if again else values
