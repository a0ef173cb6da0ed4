"""What `score --json` prints; its keys are promises."""

from collections.abc import Callable, Mapping
from typing import Any

from proxytune.usefulness import ALL, MEASURES, PPV, PRPV, Assessment, Measure, Measured, Selection


def document_of(assessment: Assessment) -> dict[str, Any]:
    """Every figure of one proxy as plain JSON; None where one is undefined, and a note says why."""
    inner, noise, random = assessment.prpv_interval, assessment.noise_floor, assessment.chance
    found = {measure: measure.measured(assessment) for measure in MEASURES}
    values = {measure.key: _per_metric(measure, one, _value) for measure, one in found.items()}
    return {
        PRPV.key: values[PRPV.key],
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
        PPV.key: values[PPV.key],
        "beta": dict(assessment.ppv.beta),
        **values,
        "intervals": _intervals(found) if assessment.intervals else None,
        "pairs": [{"better": pair.better, "worse": pair.worse, "flip": pair.flip} for pair in assessment.prpv.pairs],
        "success_rates": {
            rates.metric: {
                agent: {"proxy": vars(rates.proxy[agent]), "target": vars(rates.target[agent])}
                for agent in assessment.inputs.agents
            }
            for rates in assessment.success_rates
        },
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


def _per_metric(measure: Measure, found: Mapping[str, Measured], plain: Callable[[Measured], Any]) -> Any:
    """One plain value, or one for each metric by its name."""
    return {metric: plain(one) for metric, one in found.items()} if measure.per_metric else plain(found[ALL])


def _value(one: Measured) -> float | None:
    return one.value


def _interval(one: Measured) -> list[float] | None:
    return one.interval and list(one.interval)


def _intervals(found: Mapping[Measure, Mapping[str, Measured]]) -> dict[str, Any]:
    """Intervals of the measures beside PRPV, which has keys of its own."""
    return {measure.key: _per_metric(measure, one, _interval) for measure, one in found.items() if measure is not PRPV}


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
