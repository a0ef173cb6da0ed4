"""Scikit-optimize as it comes out of the box, for comparison only."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from proxytune.search.engine import Engine, Look
from proxytune.search.loop import Trial, Values
from proxytune.seeds import proposal_seed
from proxytune.space import Space


@dataclass(frozen=True)
class ScikitOptimize:
    """Proposes what `skopt.gp_minimize` with its defaults does, built anew from the trials at every proposal.

    One thing differs from an uninterrupted run of it: the gains by which its three acquisition functions are drawn
    (`gp_hedge`) are not carried over, so each is drawn alike. A pending trial counts as the lowest score, which is what
    it does when it is asked for several points ("cl_min").
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the seed and the trials in their order; those not pending need a score."""
        # Takes a second to load, and only this engine needs it.
        from skopt import Optimizer

        box = [(interval.low, interval.high) for interval in space.intervals]
        optimizer = Optimizer(
            box,
            n_initial_points=0,
            acq_optimizer_kwargs={"n_points": 10_000, "n_restarts_optimizer": 5},
            random_state=proposal_seed(seed, len(trials)),
        )
        lowest = min(trial.score for trial in trials if trial.score is not None)
        scores = [lowest if trial.pending else trial.score for trial in trials]
        with threadpool_limits(limits=1), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer.tell([list(trial.values) for trial in trials], scores)
            proposed = optimizer.ask()
        pairs = zip(space.intervals, proposed, strict=True)
        return tuple(min(max(float(value), i.low), i.high) for i, value in pairs)


ENGINE = Engine(
    name="skopt",
    label="scikit-optimize",
    summary="scikit-optimize's gp_minimize with its defaults",
    make=ScikitOptimize,
    in_studies=False,
    look=Look("#CC79A7", "dashed"),
)
