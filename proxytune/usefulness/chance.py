"""Chance: the PRPV of a proxy that ranks the agents at random."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, compare
from proxytune.usefulness.prpv import prpv_of_means
from proxytune.usefulness.resampling import in_blocks

LEVEL = 0.05
"""Chance explains a PRPV as low as is found by chance at least so often."""


@dataclass(frozen=True)
class Chance:
    """PRPV when the proxy's scores are handed out to the agents at random.

    Attributes:
        mean: Mean over permutations.
        deviation: Standard deviation over permutations.
        p_value: How probable a PRPV as low as the proxy's is by chance, the proxy's own order counted as one.
        permutations: How many were drawn.
        inputs: What was compared, with its sample sizes.
    """

    mean: float
    deviation: float
    p_value: float
    permutations: int
    inputs: Comparison

    @property
    def explains(self) -> bool:
        """Whether a random ranking does as well too often to be ruled out."""
        return self.p_value >= LEVEL


def chance(
    *, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric], permutations: int = 1000, seed: int = 0
) -> Chance:
    """Permute which agent got which of the proxy's scores; the metrics of one agent stay together.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    in_proxy, on_target = inputs.means
    rng = np.random.default_rng(seed)
    shuffled = in_proxy[np.stack([rng.permutation(len(in_proxy)) for _ in range(permutations)])]
    values = in_blocks(lambda proxy, _: prpv_of_means(proxy, on_target, inputs.metrics), shuffled, shuffled)
    as_low = (values <= prpv_of_means(in_proxy, on_target, inputs.metrics)).sum()
    p_value = float((1 + as_low) / (1 + permutations))
    return Chance(float(values.mean()), float(values.std(ddof=1)), p_value, permutations, inputs)
