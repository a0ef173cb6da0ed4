"""Optuna's tree-structured Parzen estimator, where Optuna is installed."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from proxytune.search.engines.engine import Engine, Library, Look
from proxytune.search.proposer import Trial, Values
from proxytune.seeds import proposal_seed
from proxytune.space import Space


@dataclass(frozen=True)
class TreeParzen:
    """Proposes what Optuna's TPE sampler suggests, with its defaults but for the start: the design stands in for it.

    Optuna's study is built anew from the trials at every proposal, in memory, so nothing is remembered. Its sampler
    weighs later trials more, so the order of the trials counts. Pending trials are running ones to it, which it takes
    for bad ("constant liar").
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the seed and the trials in their order; those not pending need a score."""
        import optuna

        drawn = proposal_seed(seed, len(trials))
        with quiet(optuna.logging):
            sampler = optuna.samplers.TPESampler(n_startup_trials=1, seed=drawn, constant_liar=True)
            return suggested(optuna, sampler, space, trials)


def suggested(optuna: Any, sampler: Any, space: Space, trials: Sequence[Trial]) -> Values:
    """What a sampler of Optuna suggests after these trials; pending ones are running to it."""
    box = {i.name: optuna.distributions.FloatDistribution(i.low, i.high) for i in space.intervals}
    study = optuna.create_study(sampler=sampler, direction="minimize")
    for trial in trials:
        theta = space.theta(trial.values)
        state = optuna.trial.TrialState.RUNNING if trial.pending else optuna.trial.TrialState.COMPLETE
        study.add_trial(optuna.trial.create_trial(params=theta, distributions=box, value=trial.score, state=state))
    return space.values(study.ask(box).params)


@contextmanager
def quiet(logging: Any) -> Iterator[None]:
    """Without the lines that Optuna writes: of every study, of what is experimental, of what would be faster."""
    before = logging.get_verbosity()
    logging.set_verbosity(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.set_verbosity(before)


ENGINE = Engine(
    name="tpe",
    label="Optuna's TPE",
    summary="Optuna's tree-structured Parzen estimator with its defaults",
    make=TreeParzen,
    needs=Library(("optuna",), "Optuna", "tpe"),
    look=Look("#009E73", "dashed"),
)
