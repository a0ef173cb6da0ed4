"""Optuna's tree-structured Parzen estimator, where Optuna is installed."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from proxytune.search.proposer import Trial, Values, proposal_seed
from proxytune.space import Space


@dataclass(frozen=True)
class TreeParzen:
    """Proposes what Optuna's TPE sampler suggests, with its defaults but for the start: the design stands in for it.

    Optuna's study is built anew from the trials at every proposal, in memory, so nothing is remembered. Its sampler
    weighs later trials more, so the order of the trials counts.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the trials in their order and the seed alone; every trial needs a score."""
        import optuna

        box: dict[str, Any] = {i.name: optuna.distributions.FloatDistribution(i.low, i.high) for i in space.intervals}
        sampler = optuna.samplers.TPESampler(n_startup_trials=1, seed=proposal_seed(seed, len(trials)))
        with quiet(optuna.logging):
            study = optuna.create_study(sampler=sampler, direction="minimize")
            for trial in trials:
                theta = space.theta(trial.values)
                study.add_trial(optuna.trial.create_trial(params=theta, distributions=box, value=trial.score))
            return space.values(study.ask(box).params)


@contextmanager
def quiet(logging: Any) -> Iterator[None]:
    """Without the lines that Optuna writes for every study it makes, and of what would make it faster."""
    before = logging.get_verbosity()
    logging.set_verbosity(logging.ERROR)
    try:
        yield
    finally:
        logging.set_verbosity(before)
