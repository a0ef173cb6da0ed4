"""Can the proxy be like the target at all? The target's distance from the model, held against that of left-out trials.

At its best θ the target is so far from what the trials predict: the mean deviance T of its outputs. The trials are from
the proxy itself, so each of them, left out and given the noise of a target, tells how large T is when a proxy fits.
Their spread makes the threshold; nothing is assumed of how outputs are correlated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from proxytune.search.goal import Goal
from proxytune.search.likelihood import Likelihood, deviance
from proxytune.search.output_model import OutputModel, fit_outputs
from proxytune.search.proposer import Trial
from proxytune.search.region import posterior_of
from proxytune.search.surrogate import Array

LEVEL = 0.05
MOST = 24
"""So many trials at most are left out, spread evenly over the search."""
FEWEST = 6
POINTS = 512


@dataclass(frozen=True)
class Misfit:
    """Whether some θ explains the target's outputs.

    Attributes:
        deviance: Mean deviance of the target's outputs at its best θ; None where no output tells of θ.
        expected: The same of trials left out, their middle: what a proxy that fits has.
        p_value: How likely a proxy that fits is to be as far off; None with too few trials to tell.
    """

    deviance: float | None
    expected: float | None
    p_value: float | None

    @property
    def fits(self) -> bool | None:
        """Whether the proxy may have made the target; None where that cannot be told."""
        return None if self.p_value is None else self.p_value >= LEVEL


def misfit_of(model: OutputModel, trials: Sequence[Trial], goal: Goal, seed: int) -> Misfit:
    """Hold the target's deviance against that of trials left out, a function of the trials and the seed alone.

    Args:
        model: Fitted to the trials.
        trials: Finished trials.
        goal: The target.
        seed: Seeds the noise that is given to trials left out.
    """
    found = _least_deviance(model, goal)
    known = sorted((trial for trial in trials if trial.outcome is not None), key=lambda trial: trial.values)
    whole = [row for row, trial in enumerate(known) if not np.isnan(trial.outcome or ()).any()]
    if len(whole) < FEWEST or found is None:
        return Misfit(found, None, None)
    chosen = [whole[place] for place in np.unique(np.linspace(0, len(whole) - 1, MOST).round().astype(int))]
    normal = np.random.default_rng(seed).standard_normal((len(known), len(goal.values)))
    ours = np.log([_left_out(model, known, goal, row, normal[row]) or np.nan for row in chosen])
    ours = ours[~np.isnan(ours)]
    if len(ours) < FEWEST:
        return Misfit(found, None, None)
    spread = max(float(ours.std(ddof=1)), 1e-9) * np.sqrt(1.0 + 1.0 / len(ours))
    away = (np.log(found) - ours.mean()) / spread
    return Misfit(found, float(np.exp(ours.mean())), float(student.sf(away, len(ours) - 1)))


def _left_out(model: OutputModel, known: Sequence[Trial], goal: Goal, row: int, normal: Array) -> float | None:
    """The least deviance of one trial as a target, given the others and the kernel of them all."""
    others = fit_outputs(model.space, [*known[:row], *known[row + 1 :]], model.kernel)
    values = np.array(known[row].outcome) + normal * np.sqrt(goal.noise)
    # The target may lack outputs, and then these tell nothing here either.
    return _least_deviance(others, replace(goal, values=np.where(np.isnan(goal.values), np.nan, values)))


def _least_deviance(model: OutputModel, goal: Goal) -> float | None:
    likelihood = Likelihood(model, goal)
    if not likelihood.columns.size:
        return None
    mode = posterior_of(likelihood.log, len(model.space.intervals), POINTS).mode
    distance, _ = likelihood.standardised(mode[None])
    return float(deviance(distance).mean()) + 1e-12
