"""Points drawn evenly and independently: what every search has to beat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.search.design import from_unit
from proxytune.search.engines.engine import Engine, Look
from proxytune.search.proposer import Trial, Values
from proxytune.seeds import proposal_seed
from proxytune.space import Space


@dataclass(frozen=True)
class RandomPoints:
    """Proposes points drawn evenly over the box, whatever the scores."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the number of trials and the seed alone."""
        generator = np.random.default_rng(proposal_seed(seed, len(trials)))
        return from_unit(space, generator.random(len(space.intervals)))


ENGINE = Engine(
    name="random",
    label="random points",
    summary="points drawn evenly over the box; learns nothing",
    make=RandomPoints,
    look=Look("0.55", "dotted"),
)
