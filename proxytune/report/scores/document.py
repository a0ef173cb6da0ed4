"""What `score --json` prints; its keys are promises."""

from collections.abc import Mapping
from typing import Any

from proxytune.usefulness import Assessment, Selection


def document_of(assessment: Assessment) -> dict[str, Any]:
    """Every figure of one proxy as plain JSON; None where one is undefined, and a note says why."""
    inner, noise, random = assessment.prpv_interval, assessment.noise_floor, assessment.chance
    return {
        "prpv": assessment.prpv.value,
        "prpv_normalised": assessment.prpv.normalised,
        "prpv_interval": _ends(inner.low, inner.high),
        "expected_prpv": inner.expected,
        "noise_floor": noise.value,
        "noise_floor_interval": _ends(noise.low, noise.high),
        "noise_floor_kind": noise.kind,
        "at_noise_floor": assessment.at_noise_floor,
        "chance": random.mean,
        "chance_deviation": random.deviation,
        "p_value": random.p_value,
        "ppv": assessment.ppv.value,
        "beta": dict(assessment.ppv.beta),
        "srcc": dict(assessment.srcc.value),
        "kendall_tau": dict(assessment.kendall_tau.value),
        "mmrv": dict(assessment.mmrv.value),
        "intervals": _intervals(assessment),
        "pairs": [{"better": pair.better, "worse": pair.worse, "flip": pair.flip} for pair in assessment.prpv.pairs],
        "agents": list(assessment.inputs.agents),
        "metrics": [str(metric) for metric in assessment.inputs.metrics],
        "episodes": _episodes(assessment),
        "notes": list(assessment.notes),
    }


def document_of_ranking(assessments: Mapping[str, Assessment], selection: Selection) -> dict[str, Any]:
    """Every figure of several proxies, best first, and of the differences between them."""
    ranked = enumerate(selection.ranking, start=1)
    differences = [
        {
            "better": pair.better,
            "worse": pair.worse,
            "difference": pair.value,
            "interval": _ends(pair.low, pair.high),
            "beyond_noise": pair.beyond_noise,
        }
        for pair in selection.differences
    ]
    return {
        "proxies": [{"proxy": name, "rank": rank, **document_of(assessments[name])} for rank, (name, _) in ranked],
        "differences": differences,
        "notes": [f"no intervals of the differences: {selection.reason}"] if selection.reason else [],
    }


def _intervals(assessment: Assessment) -> dict[str, Any] | None:
    """Intervals of the measures beside PRPV; None where episodes are not repeated."""
    inner = assessment.intervals
    if inner is None:
        return None
    per_metric = {"srcc": inner.srcc, "kendall_tau": inner.kendall_tau, "mmrv": inner.mmrv}
    named = {
        measure: {metric: ends and list(ends) for metric, ends in found.items()}
        for measure, found in per_metric.items()
    }
    return {"ppv": inner.ppv and list(inner.ppv), **named}


def _episodes(assessment: Assessment) -> dict[str, Any]:
    """Fewest and most episodes of an agent on each side."""
    inputs = assessment.inputs
    return {
        "proxy": list(inputs.proxy_episodes),
        "target": list(inputs.target_episodes),
        "paired": inputs.paired,
        "resamples": assessment.prpv_interval.resamples,
    }


def _ends(low: float | None, high: float | None) -> list[float] | None:
    return None if low is None or high is None else [low, high]
