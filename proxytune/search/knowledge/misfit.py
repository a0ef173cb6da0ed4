"""Can the proxy be like the target at all? How far the target is from the model, against trials left out."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from proxytune.search.knowledge.left_out import LeftOut, least_deviance
from proxytune.search.knowledge.likelihood import Likelihood
from proxytune.search.knowledge.region import Posterior

LEVEL = 0.05
LEAST = 1e-12
"""A deviance of which the logarithm can be taken."""


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


def misfit_of(likelihood: Likelihood, posterior: Posterior, left_out: LeftOut) -> Misfit:
    """Hold the target's deviance at its most probable θ against that of trials left out.

    The logarithms of these are taken for normal, so the p-value is Student's for one more of them.

    Args:
        likelihood: Of the target.
        posterior: Its θ.
        left_out: What left-out trials say.
    """
    if not likelihood.columns.size:
        return Misfit(None, None, None)
    found = least_deviance(likelihood, posterior)
    if not left_out.enough:
        return Misfit(found, None, None)
    ours = np.log(left_out.deviances + LEAST)
    spread = max(float(ours.std(ddof=1)), 1e-9) * np.sqrt(1.0 + 1.0 / len(ours))
    away = (np.log(found + LEAST) - ours.mean()) / spread
    return Misfit(found, float(np.exp(ours.mean())), float(student.sf(away, len(ours) - 1)))
