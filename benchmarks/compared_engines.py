"""Search engines that are compared and that no study may name: scikit-optimize's, Optuna's, BoTorch's, as they come."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from emulator import EMULATOR
from threadpoolctl import threadpool_limits

from proxytune.arrays import Floats
from proxytune.search import Goal, registry
from proxytune.search.engine import Engine, Look, from_unit, unit_points
from proxytune.search.loop import Trial, Values
from proxytune.search.optuna_bridge import quiet, suggested
from proxytune.search.surrogate import unit_array
from proxytune.seeds import proposal_seed
from proxytune.space import Space

SAMPLES = 128
RESTARTS, RAW_SAMPLES = 10, 512
COMPOSED_SAMPLES, CHOICES, BLOCK = 64, 512, 256
PERTURBED = 4
"""So many of the visited points are perturbed."""
PERTURBATIONS = (0.01, 0.2)
"""Standard deviations between these, in widths of the box."""


@contextmanager
def on_one_thread() -> Iterator[None]:
    """Hold PyTorch and the numerical libraries to one thread.

    With several the last bit of a sum is anybody's guess, and a proposal would be too.
    """
    import torch

    before = torch.get_num_threads()
    with threadpool_limits(limits=1):
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(before)


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


SKOPT = Engine(
    name="skopt",
    label="scikit-optimize",
    summary="scikit-optimize's gp_minimize with its defaults",
    make=ScikitOptimize,
    in_studies=False,
    look=Look("#CC79A7", "dashed"),
)


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


GPSAMPLER = Engine(
    name="gpsampler",
    label="Optuna's GPSampler",
    summary="Optuna's Gaussian-process sampler with its defaults",
    make=OptunaGP,
    in_studies=False,
    look=Look("#56B4E9", "dashed"),
)


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
        _fitted(known, merits[:, None]), known, sampler=sampler, prune_baseline=True, X_pending=awaited
    )
    bounds = torch.tensor([[0.0], [1.0]], dtype=torch.double).repeat(1, visited.shape[1])
    found, _ = optimize_acqf(
        wanted, bounds, q=1, num_restarts=RESTARTS, raw_samples=RAW_SAMPLES, options={"seed": seed}
    )
    return np.asarray(found[0].numpy(), dtype=float)


def _fitted(known: Any, standardised: Floats) -> Any:
    """A process of each column (trials, columns)."""
    import torch
    from botorch.fit import fit_gpytorch_mll
    from botorch.models import SingleTaskGP
    from gpytorch.mlls import ExactMarginalLogLikelihood

    model = SingleTaskGP(known, torch.tensor(standardised, dtype=torch.double), outcome_transform=None)
    fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    return model


QLOGNEI = Engine(
    name="qlognei",
    label="BoTorch's qLogNEI",
    summary="BoTorch's noisy expected improvement over its SingleTaskGP, with their defaults",
    make=BotorchNEI,
    in_studies=False,
    look=Look("0.15", "dashdot"),
)


@dataclass(frozen=True)
class BotorchComposite:
    """Proposes where BoTorch's qLogNoisyExpectedImprovement of PRPV is highest, composed of a SingleTaskGP per output.

    The models have their defaults, each a kernel of its own, and standardised outputs; those that PRPV does not depend
    on are left out. PRPV of their joint draws is a GenericMCObjective: a count, which has no gradient to climb, so the
    acquisition function is maximised over a finite set as BoTorch does it where there is none
    (`optimize_acqf_discrete`): half of it a Sobol cloud, half perturbations of the visited points of lowest PRPV. What
    a trial does not know of an output is the mean of those that do.
    """

    goal: Goal

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the seed and the trials in their order; those not pending need an outcome."""
        import torch

        unit, pending = unit_array(space, [t.values for t in trials]), np.array([t.pending for t in trials])
        outputs = _filled(np.array([t.outcome for t in trials if not t.pending], dtype=float), self.goal.values)
        drawn = proposal_seed(seed, len(trials)) % 2**31
        with on_one_thread(), torch.random.fork_rng(devices=[]), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            torch.manual_seed(drawn)
            return from_unit(space, _most_improving_composed(self.goal, unit[~pending], outputs, unit[pending], drawn))


def _filled(outputs: Floats, target: Floats) -> Floats:
    """Outputs (trials, outputs), each unknown one the mean of the trials that know it, or the target's."""
    known = ~np.isnan(outputs)
    means = np.where(known, outputs, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.where(known, outputs, np.where(known.any(axis=0), means, target))


def _most_improving_composed(goal: Goal, visited: Floats, outputs: Floats, pending: Floats, seed: int) -> Floats:
    """Where a composed score lower than those seen is most expected, in the unit cube, pending points being there."""
    import torch
    from botorch.acquisition.logei import qLogNoisyExpectedImprovement
    from botorch.acquisition.objective import GenericMCObjective
    from botorch.optim.optimize import optimize_acqf_discrete
    from botorch.sampling.normal import SobolQMCNormalSampler

    scores, counting = goal.compose(outputs), _counting(goal, outputs)
    middle, scale = outputs[:, counting].mean(axis=0), outputs[:, counting].std(axis=0)
    scale, spread = np.where(scale > 0.0, scale, 1.0), scores.std() or 1.0

    def merit(drawn: Any, **_where: Any) -> Any:
        every = np.zeros((*drawn.shape[:-1], outputs.shape[1]))
        every[..., counting] = middle + scale * drawn.numpy()
        return torch.from_numpy(-goal.compose(every) / spread)

    known, choices = (torch.tensor(one, dtype=torch.double) for one in (visited, _choices(visited, scores, seed)))
    wanted = qLogNoisyExpectedImprovement(
        _fitted(known, (outputs[:, counting] - middle) / scale),
        known,
        sampler=SobolQMCNormalSampler(torch.Size([COMPOSED_SAMPLES]), seed=seed),
        objective=GenericMCObjective(merit),
        prune_baseline=True,
        X_pending=torch.tensor(pending, dtype=torch.double) if len(pending) else None,
    )
    found, _ = optimize_acqf_discrete(wanted, q=1, choices=choices, max_batch_size=BLOCK)
    return np.asarray(found[0].numpy(), dtype=float)


def _counting(goal: Goal, outputs: Floats) -> Any:
    """The columns that the score depends on, by moving each far up and far down: others are modelled for nothing."""
    far = 1.0 + 2.0 * np.abs(outputs).max()
    moved = [np.where(np.eye(outputs.shape[1])[:, None, :] > 0.0, side * far, outputs) for side in (-1.0, 1.0)]
    return np.flatnonzero(np.any([goal.compose(one) != goal.compose(outputs) for one in moved], axis=(0, 2)))


def _choices(visited: Floats, scores: Floats, seed: int) -> Floats:
    """A Sobol cloud, and as many normal perturbations of the points of lowest score, narrow ones and wide ones."""
    generator, dimensions = np.random.default_rng(seed), visited.shape[1]
    best = visited[np.argsort(scores, kind="stable")[:PERTURBED]]
    widths = np.exp(generator.uniform(*np.log(PERTURBATIONS), (CHOICES, 1)))
    around = best[np.arange(CHOICES) % len(best)] + widths * generator.standard_normal((CHOICES, dimensions))
    return np.concatenate([unit_points(dimensions, CHOICES, seed), np.clip(around, 0.0, 1.0)])


BOTORCH_COMPOSITE = Engine(
    name="botorch_composite",
    label="BoTorch, composite",
    summary="BoTorch's noisy expected improvement of PRPV composed of a SingleTaskGP of every output",
    make=BotorchComposite,
    learns_from="outputs",
    in_studies=False,
    look=Look("0.15", "dashed"),
)

PEERS = (SKOPT, GPSAMPLER, QLOGNEI, BOTORCH_COMPOSITE, EMULATOR)
"""Engines that are here to be compared; of what they need, requirements.txt tells."""
BOTORCH = (("botorch",), "BoTorch")
NEEDED = {
    GPSAMPLER.name: (("optuna", "torch"), "Optuna and PyTorch"),
    QLOGNEI.name: BOTORCH,
    BOTORCH_COMPOSITE.name: BOTORCH,
}
"""What some of them import, and what people call it."""
ENGINES = (*registry.ENGINES, *PEERS)
NAMES = tuple(engine.name for engine in ENGINES)


def engine_of(name: str, beside: Path | None = None) -> Engine:
    """The engine of this name: one of the peers, or whatever a study may name.

    Raises:
        InputError: If there is no such engine, or it is none.
    """
    peer = next((engine for engine in PEERS if engine.name == name), None)
    return peer or registry.engine_of(name, beside)


def why_not(name: str, *, composed: bool, beside: Path | None = None) -> str:
    """Why an engine cannot be compared, in one phrase; empty if it can.

    Args:
        name: Of the engine.
        composed: Whether the score is computed from outcomes that are known.
        beside: The folder whose modules come before the installed ones.
    """
    modules, library = NEEDED.get(name, ((), ""))
    if not all(find_spec(module) for module in modules):
        verb = "are" if len(modules) > 1 else "is"
        remedy = "pip install -r benchmarks/requirements.txt, or use another engine"
        return f"'{name}' needs {library}, which {verb} not installed; {remedy}"
    if name in [engine.name for engine in PEERS]:
        return registry.why_not_engine(engine_of(name), composed=composed)
    return registry.why_not(name, composed=composed, beside=beside)
