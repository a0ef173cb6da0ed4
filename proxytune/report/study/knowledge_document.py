"""What is known of θ, as `study --json` has it; its keys are promises."""

from collections.abc import Mapping
from typing import Any

from proxytune.report.numbers import Ends
from proxytune.search import Information, Knowledge


def knowledge_document(learnt: Knowledge) -> dict[str, Any]:
    """Misfit, pairs that trade, what is as good by PRPV, and who tells what; plain numbers, texts and truth values."""
    misfit, (share, ends) = learnt.misfit, learnt.as_good
    return {
        "misfit": {
            "p_value": misfit.p_value,
            "fits": None if misfit.fits is None else bool(misfit.fits),
            "deviance": misfit.deviance,
            "expected_deviance": misfit.expected,
        },
        "trades": [[one, other, float(correlation)] for one, other, correlation in learnt.trades],
        "as_good": {"region_share": float(share), "theta_interval": intervals_document(ends)},
        "information": {one.name: _information(one) for one in learnt.information},
    }


def intervals_document(intervals: Mapping[str, Ends]) -> dict[str, list[float]]:
    """The ends of each parameter's interval."""
    return {name: [float(low), float(high)] for name, (low, high) in intervals.items()}


def _information(one: Information) -> dict[str, Any]:
    return {
        "agents": {name: float(share) for name, share in one.agents},
        "metrics": {name: float(share) for name, share in one.metrics},
        "limit": one.limit,
    }
