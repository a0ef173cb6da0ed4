"""Optuna's Gaussian-process sampler, where Optuna and PyTorch are installed; for comparison only."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from proxytune.search.one_thread import on_one_thread
from proxytune.search.proposer import Trial, Values, proposal_seed
from proxytune.search.tree_parzen import quiet
from proxytune.space import Space


@dataclass(frozen=True)
class OptunaGP:
    """Proposes what Optuna's GPSampler suggests, with its defaults but for the start: the design stands in for it.

    Optuna's study is built anew from the trials at every proposal, in memory, so nothing is remembered: what an
    uninterrupted sampler carries over, the kernel of its last fit as a start of the next, is not.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the trials in their order and the seed alone; every trial needs a score."""
        import optuna

        box: dict[str, Any] = {i.name: optuna.distributions.FloatDistribution(i.low, i.high) for i in space.intervals}
        with quiet(optuna.logging), warnings.catch_warnings(), on_one_thread():
            warnings.simplefilter("ignore")
            sampler = optuna.samplers.GPSampler(seed=proposal_seed(seed, len(trials)), n_startup_trials=1)
            study = optuna.create_study(sampler=sampler, direction="minimize")
            for trial in trials:
                theta = space.theta(trial.values)
                study.add_trial(optuna.trial.create_trial(params=theta, distributions=box, value=trial.score))
            return space.values(study.ask(box).params)
