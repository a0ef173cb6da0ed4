"""The agent whose place among the others was wrong before and is right after."""

from typing import Any

import numpy as np

from proxytune.closing.closed import Closed
from proxytune.scores import Array
from proxytune.usefulness import Assessment
from proxytune.usefulness.prpv import dominance


def righted(closed: Closed) -> dict[str, Any] | None:
    """The agent that most wrongly ordered pairs lose, a held-out one where there are any; None where none loses any."""
    if closed.after is None:
        return None
    both = closed.held_out or (closed.before.result.judged, closed.after.result.judged)
    before, after = map(wrong_pairs, both)
    agents = both[0].inputs.agents
    gains = [before[agent] - after[agent] for agent in agents]
    if max(gains) <= 0.0:
        return None
    agent = agents[int(np.argmax(gains))]
    return {"agent": agent, "wrong_pairs_before": before[agent], "wrong_pairs_after": after[agent]}


def wrong_pairs(assessment: Assessment) -> dict[str, float]:
    """How many pairs with each agent proxy and target order differently; a tie of one side alone counts half."""
    inputs = assessment.inputs
    proxy, target = (_dominance(table.means, assessment) for table in (inputs.proxy, inputs.target))
    return dict(zip(inputs.agents, np.abs(proxy - target).sum(axis=1).tolist(), strict=True))


def _dominance(means: Array, assessment: Assessment) -> Array:
    return dominance(means, assessment.inputs.metrics)
