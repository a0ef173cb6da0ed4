"""BoTorch's noisy expected improvement, where BoTorch is installed; for comparison only."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.search.design import from_unit, to_unit
from proxytune.search.one_thread import on_one_thread
from proxytune.search.proposer import Trial, Values, proposal_seed
from proxytune.space import Space

Array = NDArray[np.float64]

SAMPLES = 128
RESTARTS, RAW_SAMPLES = 10, 512


@dataclass(frozen=True)
class BotorchNEI:
    """Proposes the maximum of BoTorch's qLogNoisyExpectedImprovement over its SingleTaskGP, both with their defaults.

    Parameters are scaled to the unit cube and scores standardised, as BoTorch asks for. The model is fitted anew from
    the trials at every proposal, in double precision on one thread.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the trials in their order and the seed alone; every trial needs a score."""
        import torch

        visited = np.array([to_unit(space, trial.values) for trial in trials])
        scores = np.array([trial.score for trial in trials], dtype=float)
        spread = scores.std() or 1.0
        drawn = proposal_seed(seed, len(trials)) % 2**31
        with on_one_thread(), torch.random.fork_rng(devices=[]), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            torch.manual_seed(drawn)
            return from_unit(space, _most_improving(visited, (scores.mean() - scores) / spread, drawn))


def _most_improving(visited: Array, merits: Array, seed: int) -> Array:
    """Where a larger merit than those seen is most expected, in the unit cube."""
    import torch
    from botorch.acquisition.logei import qLogNoisyExpectedImprovement
    from botorch.optim.optimize import optimize_acqf
    from botorch.sampling.normal import SobolQMCNormalSampler

    known = torch.tensor(visited, dtype=torch.double)
    sampler = SobolQMCNormalSampler(torch.Size([SAMPLES]), seed=seed)
    wanted = qLogNoisyExpectedImprovement(_fitted(known, merits), known, sampler=sampler, prune_baseline=True)
    bounds = torch.tensor([[0.0], [1.0]], dtype=torch.double).repeat(1, visited.shape[1])
    found, _ = optimize_acqf(
        wanted, bounds, q=1, num_restarts=RESTARTS, raw_samples=RAW_SAMPLES, options={"seed": seed}
    )
    return np.asarray(found[0].numpy(), dtype=float)


def _fitted(known: Any, merits: Array) -> Any:
    import torch
    from botorch.fit import fit_gpytorch_mll
    from botorch.models import SingleTaskGP
    from gpytorch.mlls import ExactMarginalLogLikelihood

    model = SingleTaskGP(known, torch.tensor(merits, dtype=torch.double)[:, None], outcome_transform=None)
    fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    return model
