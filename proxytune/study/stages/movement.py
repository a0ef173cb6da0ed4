"""What moving one parameter from the centre of the box to its ends does, against what placement noise does."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import wilcoxon

from proxytune.space import Interval

LEVEL = 0.05
"""Of all tests of one parameter together."""
LOOKS = 2
"""How often a parameter may be tested, each time on more starts."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Movement:
    """What moving one parameter across its box does to the metrics.

    Attributes:
        interval: The parameter and its box.
        p_value: How likely noise alone is to change a metric as much, corrected for all tests; the lowest of them.
        metric: The metric of that test.
        change: Median over agents and starts of how much the parameter changes it.
        noise: Median of how much noise does.
        pairs: Over how many agents and starts; failed episodes are left out.
        dead: Whether no metric of any of their episodes changed at all.
    """

    interval: Interval
    p_value: float
    metric: str
    change: float
    noise: float
    pairs: int
    dead: bool

    @property
    def moves(self) -> bool:
        """Whether the parameter changes a metric beyond noise."""
        return self.p_value < LEVEL

    @property
    def warning(self) -> str:
        """What is wrong with the parameter and what to do, in one line; empty if nothing is."""
        if self.moves:
            return ""
        name, box = self.interval.name, f"[{self.interval.low:g}, {self.interval.high:g}]"
        if not self.pairs:
            return f"pre-flight: '{name}' cannot be tested: every agent fails somewhere in {box}; narrow its box"
        if self.dead:
            remedy = "remove it from [parameters], add agents that depend on it, or widen its box"
            return f"pre-flight: '{name}' changes nothing at all across {box}; {remedy}"
        remedy = "add agents that depend on it, starts or metrics, or widen its box"
        return f"pre-flight: '{name}' is not shown to change a metric across {box} by {self.pairs} pairs; {remedy}"


def judge(interval: Interval, names: Sequence[str], values: Array) -> Movement:
    """What the test that tells most says of a parameter.

    Args:
        interval: The parameter.
        names: The metrics.
        values: Shape (agents × places, 4, metrics): the base again, the base, the lower and the upper end.
    """
    changes = np.abs(values[:, [0, 2, 3]] - values[:, [1]])
    tests = [(_larger(changes[:, end, m], changes[:, 0, m]), end, m) for end in (1, 2) for m in range(len(names))]
    p_value, end, m = min(tests)
    middle = np.median(changes[:, [0, end], m], axis=0) if len(changes) else (0.0, 0.0)
    return Movement(
        interval=interval,
        p_value=min(1.0, p_value * len(tests) * LOOKS),
        metric=names[m],
        change=float(middle[1]),
        noise=float(middle[0]),
        pairs=len(changes),
        dead=not changes[:, 1:].any(),
    )


def _larger(changes: Array, noise: Array) -> float:
    """How likely the signed ranks of |change| − |noise| are if neither is the larger."""
    apart = changes - noise
    # Left to itself scipy permutes where there are ties, which takes more than a second a test.
    return float(wilcoxon(apart, alternative="greater", method="approx").pvalue) if apart.any() else 1.0
