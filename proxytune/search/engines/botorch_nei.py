"""BoTorch's noisy expected improvement, where BoTorch is installed; for comparison only."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proxytune.arrays import Floats
from proxytune.search.engine import Engine, Library, Look, from_unit
from proxytune.search.loop import Trial, Values
from proxytune.search.optuna_bridge import on_one_thread
from proxytune.search.surrogate import unit_array
from proxytune.seeds import proposal_seed
from proxytune.space import Space

SAMPLES = 128
RESTARTS, RAW_SAMPLES = 10, 512


@dataclass(frozen=True)
class BotorchNEI:
    """Proposes the maximum of BoTorch's qLogNoisyExpectedImprovement over its SingleTaskGP, both with their defaults.

    Parameters are scaled to the unit cube and scores standardised, as BoTorch asks for. The model is fitted anew from
    the trials at every proposal, in double precision on one thread. Pending points are so to BoTorch too.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the seed and the trials in their order; those not pending need a score."""
        import torch

        unit, pending = unit_array(space, [t.values for t in trials]), np.array([t.pending for t in trials])
        scores = np.array([trial.score for trial in trials if not trial.pending], dtype=float)
        spread = scores.std() or 1.0
        drawn = proposal_seed(seed, len(trials)) % 2**31
        with on_one_thread(), torch.random.fork_rng(devices=[]), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            torch.manual_seed(drawn)
            merits = (scores.mean() - scores) / spread
            return from_unit(space, _most_improving(unit[~pending], merits, unit[pending], drawn))


def _most_improving(visited: Floats, merits: Floats, pending: Floats, seed: int) -> Floats:
    """Where a larger merit than those seen is most expected, in the unit cube, those pending being there too."""
    import torch
    from botorch.acquisition.logei import qLogNoisyExpectedImprovement
    from botorch.optim.optimize import optimize_acqf
    from botorch.sampling.normal import SobolQMCNormalSampler

    known = torch.tensor(visited, dtype=torch.double)
    sampler = SobolQMCNormalSampler(torch.Size([SAMPLES]), seed=seed)
    awaited = torch.tensor(pending, dtype=torch.double) if len(pending) else None
    wanted = qLogNoisyExpectedImprovement(
        _fitted(known, merits), known, sampler=sampler, prune_baseline=True, X_pending=awaited
    )
    bounds = torch.tensor([[0.0], [1.0]], dtype=torch.double).repeat(1, visited.shape[1])
    found, _ = optimize_acqf(
        wanted, bounds, q=1, num_restarts=RESTARTS, raw_samples=RAW_SAMPLES, options={"seed": seed}
    )
    return np.asarray(found[0].numpy(), dtype=float)


def _fitted(known: Any, merits: Floats) -> Any:
    import torch
    from botorch.fit import fit_gpytorch_mll
    from botorch.models import SingleTaskGP
    from gpytorch.mlls import ExactMarginalLogLikelihood

    model = SingleTaskGP(known, torch.tensor(merits, dtype=torch.double)[:, None], outcome_transform=None)
    fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    return model


ENGINE = Engine(
    name="qlognei",
    label="BoTorch's qLogNEI",
    summary="BoTorch's noisy expected improvement over its SingleTaskGP, with their defaults",
    make=BotorchNEI,
    in_studies=False,
    needs=Library(("botorch",), "BoTorch", "peers"),
    look=Look("0.15", "dashdot"),
)
