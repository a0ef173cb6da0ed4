"""The engine `outcomes`: it learns from every output of a trial, not from PRPV alone.

In turn it draws θ from what is known of it, and looks where the score composed of the outputs is expected to improve
most. Draws find the θ that made the target and escape what a greedy search sticks to; expected improvement keeps PRPV
the goal where the proxy cannot be like the target whatever θ is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from proxytune.search.design import from_unit
from proxytune.search.engines.composite import most_improving
from proxytune.search.engines.engine import Engine, Look
from proxytune.search.goal import Goal
from proxytune.search.knowledge.likelihood import Likelihood
from proxytune.search.knowledge.output_model import fit_outputs
from proxytune.search.knowledge.region import posterior_of
from proxytune.search.proposer import Trial, Values
from proxytune.seeds import proposal_seed
from proxytune.space import Space


@dataclass(frozen=True)
class Outcomes:
    """Proposes draws from the posterior of θ and the θ of highest expected improvement, in turn.

    Attributes:
        goal: The target.
    """

    goal: Goal

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the trials and the seed alone.

        Raises:
            RunError: If no trial has an outcome.
        """
        drawn = proposal_seed(seed, len(trials))
        with threadpool_limits(limits=1):
            if len(trials) % 2:
                return most_improving(space, trials, self.goal, drawn)
            likelihood = Likelihood(fit_outputs(space, trials), self.goal)
            posterior = posterior_of(likelihood.log, len(space.intervals))
            return from_unit(space, posterior.draw(drawn))


ENGINE = Engine(
    name="outcomes",
    label="outcomes",
    summary="in turn, a draw from what is known of θ and the θ whose PRPV is expected to improve most",
    make=Outcomes,
    learns_from="outputs",
    look=Look("#D55E00"),
)
