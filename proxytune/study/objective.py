"""What a study makes small or large: a measure of how far proxy and target agree on the agents."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from proxytune.scores import Array, Metric, ScoreTable
from proxytune.study.settings import StudySettings
from proxytune.usefulness import ppv, prpv
from proxytune.usefulness.prpv import prpv_of_means

OfMeans = Callable[[Array, Array, Sequence[Metric]], Array]
"""A measure of mean scores in the proxy (…, agents, metrics) and on the target (agents, metrics): shape (…)."""


@dataclass(frozen=True)
class Objective:
    """A measure as the objective of a study.

    Attributes:
        name: What study.toml calls it.
        label: What people call it.
        maximise: Whether more of it is better.
        of_means: The measure.
    """

    name: str
    label: str
    maximise: bool
    of_means: OfMeans

    def cost(self, value: float | None) -> float | None:
        """The measure as something to be made small."""
        return value if value is None or not self.maximise else -value

    def measure(self, *, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> dict[str, float | None]:
        """PRPV, PPV and this measure of a proxy, by name; None where one is undefined.

        Raises:
            ScoresError: If an agent is missing on one side, or a metric is unknown.
        """
        ranking = prpv(proxy=proxy, target=target, metrics=metrics)
        predicting = ppv(proxy=proxy, target=target, metrics=metrics)
        own = float(self.of_means(*ranking.inputs.means, metrics))
        return {
            self.name: own if math.isfinite(own) else None,
            "prpv": float(ranking.value),
            "ppv": predicting.value,
        }


PRPV = Objective("prpv", "PRPV", False, prpv_of_means)


def objective_of(settings: StudySettings) -> Objective:
    """The measure that the trials of a study are scored by; a study of learning value is narrowed by PRPV."""
    return PRPV
