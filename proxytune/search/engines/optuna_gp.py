"""Optuna's Gaussian-process sampler, where Optuna and PyTorch are installed; for comparison only."""

from collections.abc import Sequence
from dataclasses import dataclass

from proxytune.search.engine import Engine, Library, Look
from proxytune.search.loop import Trial, Values
from proxytune.search.optuna_bridge import on_one_thread, quiet, suggested
from proxytune.seeds import proposal_seed
from proxytune.space import Space


@dataclass(frozen=True)
class OptunaGP:
    """Proposes what Optuna's GPSampler suggests, with its defaults but for the start: the design stands in for it.

    Optuna's study is built anew from the trials at every proposal, in memory, so nothing is remembered: what an
    uninterrupted sampler carries over, the kernel of its last fit as a start of the next, is not.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the seed and the trials in their order; those not pending need a score."""
        import optuna

        with quiet(optuna.logging), on_one_thread():
            sampler = optuna.samplers.GPSampler(seed=proposal_seed(seed, len(trials)), n_startup_trials=1)
            return suggested(optuna, sampler, space, trials)


ENGINE = Engine(
    name="gpsampler",
    label="Optuna's GPSampler",
    summary="Optuna's Gaussian-process sampler with its defaults",
    make=OptunaGP,
    in_studies=False,
    needs=Library(("optuna", "torch"), "Optuna and PyTorch", "peers"),
    look=Look("#56B4E9", "dashed"),
)
