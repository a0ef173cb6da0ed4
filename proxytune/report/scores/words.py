"""What `score` says first, and what to do next."""

from collections.abc import Mapping

from proxytune.report.numbers import listed, short
from proxytune.usefulness import Assessment, NoiseFloor, Selection


def score_answer(assessments: Mapping[str, Assessment], selection: Selection | None, *, target: str) -> str:
    """How low PRPV is and what that is worth; of several proxies which is best, and of which others beyond noise."""
    if selection is None:
        ((proxy, assessment),) = assessments.items()
        return _answer(assessment, proxy, target)
    best = selection.ranking[0][0]
    worse = [pair.worse for pair in selection.differences if pair.better == best and pair.beyond_noise]
    beyond = f"beyond noise better than {listed(worse)}" if worse else "not beyond noise better than any other"
    return f"{best} ranks the agents most like {target}, {beyond}. {_answer(assessments[best], best, target)}"


def score_next_step(assessments: Mapping[str, Assessment], selection: Selection | None) -> str:
    """The step that brings most."""
    if selection is None:
        (assessment,) = assessments.values()
        return _next_step(assessment)
    best = selection.ranking[0][0]
    if all(pair.beyond_noise for pair in selection.differences if pair.better == best):
        return f"use {best}, or tune its parameters with `python -m proxytune study`."
    return "score more agents or more episodes, to tell the best proxies apart."


def _answer(assessment: Assessment, proxy: str, target: str) -> str:
    """How low PRPV is, and what that is worth."""
    prpv, inner = assessment.prpv, assessment.prpv_interval
    ends = "" if inner.low is None or inner.high is None else f" ({_ends(inner.low, inner.high)})"
    score = f"has a PRPV (proxy relative predictivity value) of {prpv.value}{ends}, of at most {prpv.range[1]}"
    return f"As a proxy of {target}, {proxy} {score}: {_worth(assessment)}."


def _worth(assessment: Assessment) -> str:
    random, floor = assessment.chance, assessment.noise_floor
    chance = f"{short(random.mean)} ± {short(random.deviation)}, p = {random.p_value:.2g}"
    if random.explains:
        return f"no better than chance ({chance})"
    if assessment.at_noise_floor:
        return f"no difference from the target can be seen (noise floor {_floor(floor)})"
    perfect = f"; a perfect proxy scores {_floor(floor)}" if floor.kind == "same starts" and _floor(floor) else ""
    return f"better than chance ({chance}){perfect}"


def _floor(floor: NoiseFloor) -> str:
    if floor.value is None or floor.low is None or floor.high is None:
        return ""
    return f"{short(floor.value)} ({_ends(floor.low, floor.high)})"


def _ends(low: float, high: float) -> str:
    return f"{short(low)} to {short(high)}"


def _next_step(assessment: Assessment) -> str:
    """The step that brings most."""
    if assessment.prpv_interval.low is None:
        return "score every agent in at least two episodes on both sides, which gives intervals."
    if assessment.chance.explains:
        return "score more agents, or agents whose scores differ more, until chance can be excluded."
    if assessment.at_noise_floor:
        return "use this proxy; to see a difference from the target, score more starts."
    return "see below which pairs it ranks wrongly; tune its parameters with `python -m proxytune study`."
