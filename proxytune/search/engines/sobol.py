"""The quasi-random design gone on with: it fills the box evenly and learns nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

from proxytune.search.design import design_point
from proxytune.search.engines.engine import Engine, Look
from proxytune.search.proposer import Trial, Values
from proxytune.space import Space


@dataclass(frozen=True)
class Sobol:
    """Proposes the next point of the scrambled Sobol sequence, whatever the scores."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the number of trials and the seed alone."""
        return design_point(space, len(trials), seed)


ENGINE = Engine(
    name="sobol",
    label="Sobol sequence",
    summary="the quasi-random design gone on with; learns nothing",
    make=Sobol,
    look=Look("0.55", "dashdot"),
)
