"""Scikit-optimize as it comes out of the box, for comparison only."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

from skopt import Optimizer
from threadpoolctl import threadpool_limits

from proxytune.search.proposer import Trial, Values, proposal_seed
from proxytune.space import Space


@dataclass(frozen=True)
class ScikitOptimize:
    """Proposes what `skopt.gp_minimize` with its defaults does, built anew from the trials at every proposal.

    One thing differs from an uninterrupted run of it: the gains by which its three acquisition functions are drawn
    (`gp_hedge`) are not carried over, so each is drawn alike.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the trials in their order and the seed alone; every trial needs a score."""
        box = [(interval.low, interval.high) for interval in space.intervals]
        optimizer = Optimizer(
            box,
            n_initial_points=0,
            acq_optimizer_kwargs={"n_points": 10_000, "n_restarts_optimizer": 5},
            random_state=proposal_seed(seed, len(trials)),
        )
        with threadpool_limits(limits=1), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer.tell([list(trial.values) for trial in trials], [trial.score for trial in trials])
            proposed = optimizer.ask()
        pairs = zip(space.intervals, proposed, strict=True)
        return tuple(min(max(float(value), i.low), i.high) for i, value in pairs)
