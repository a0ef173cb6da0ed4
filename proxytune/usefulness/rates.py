"""Success rates: metrics of zeros and ones, each agent's rate with an interval of its own, and how often agents tie."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison
from proxytune.usefulness.standing import stand

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Rate:
    """The share of an agent's episodes that succeeded.

    Attributes:
        value: The share.
        low: Lower end of Wilson's 95 % interval, which takes episodes for independent.
        high: Upper end.
        episodes: How many there were.
    """

    value: float
    low: float
    high: float
    episodes: int


@dataclass(frozen=True)
class SuccessRates:
    """One metric of zeros and ones on both sides.

    Attributes:
        metric: Its name.
        proxy: Rate of each agent in the proxy.
        target: The same on the target.
        ties: How many pairs of agents tie, in the proxy and on the target.
        pairs: How many pairs there are.
    """

    metric: str
    proxy: Mapping[str, Rate]
    target: Mapping[str, Rate]
    ties: tuple[int, int]
    pairs: int

    @property
    def note(self) -> str:
        """How many pairs tie and what that does; empty where none does."""
        if not any(self.ties):
            return ""
        count = f"{self.ties[0]} of {self.pairs} pairs of agents tie in the proxy, {self.ties[1]} on the target"
        return f"{self.metric} is a success rate: {count}; a tie counts half: on one side alone it adds 1 to PRPV"


def success_rates(inputs: Comparison) -> tuple[SuccessRates, ...]:
    """The metrics that are nothing but zeros and ones, and not all alike, in their order."""
    return tuple(
        _rates(inputs, metric, column) for column, metric in enumerate(inputs.metrics) if _is_rate(inputs, column)
    )


def _is_rate(inputs: Comparison, column: int) -> bool:
    known = [np.unique(side.values[side.driven][:, column]) for side in (inputs.proxy, inputs.target)]
    return bool(np.array_equal(np.union1d(*known), (0.0, 1.0)))


def _rates(inputs: Comparison, metric: Metric, column: int) -> SuccessRates:
    proxy, target = (_of_agents(side, column) for side in (inputs.proxy, inputs.target))
    ties = _ties(inputs.proxy, metric, column), _ties(inputs.target, metric, column)
    agents = len(inputs.agents)
    return SuccessRates(metric.name, proxy, target, ties, agents * (agents - 1) // 2)


def _of_agents(table: ScoreTable, column: int) -> dict[str, Rate]:
    # Loading scipy.stats takes longer than all else of most commands.
    from scipy.stats import binomtest

    rates = {}
    for row, agent in enumerate(table.agents):
        episodes = int(table.counts[row])
        test = binomtest(round(float(np.nansum(table.values[row, :, column]))), episodes)
        ends = test.proportion_ci(CONFIDENCE, method="wilson")
        rates[agent] = Rate(float(test.statistic), float(ends.low), float(ends.high), episodes)
    return rates


def _ties(table: ScoreTable, metric: Metric, column: int) -> int:
    merits, tie = metric.merits(table.means[:, column])
    agents = len(merits)
    return agents * (agents - 1) // 2 - int(stand(merits, float(tie[0])).below.sum())
