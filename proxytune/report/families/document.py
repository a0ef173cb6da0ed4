"""What `study --json` prints of several families; its keys are promises."""

from typing import Any

from proxytune.report.families.words import families_sentence
from proxytune.report.study.knowledge_document import intervals_document
from proxytune.report.teaching.document import estimate
from proxytune.study import Choice, ComparedFamilies, Lesson, TunedFamily, as_document


def families_document(compared: ComparedFamilies) -> dict[str, Any]:
    """Several tuned families as plain JSON; None where a figure is undefined."""
    costs = compared.seconds_per_episode()
    return {
        "name": compared.settings.name,
        "sentence": families_sentence(compared),
        "best": {
            "predict": _choice(compared.predicts),
            "teach": _choice(compared.teaches) if compared.settings.teaching else None,
            "cheapest": _choice(compared.cheapest),
        },
        "seconds_per_family": compared.settings.stop.wall_time_s,
        "families": {
            one.name: {**_family(one, costs[one.name]), **_lesson(compared.lessons.get(one.name))}
            for one in compared.families
        },
        "differences": _differences(compared),
        "settings": dict(as_document(compared.settings)),
    }


def _choice(choice: Choice) -> dict[str, Any]:
    return {"family": choice.best, "cannot_be_told_from": list(choice.alike)}


def _family(one: TunedFamily, cost: tuple[float, float, float]) -> dict[str, Any]:
    result = one.result
    settings = result.study.settings
    return {
        "family": settings.family,
        "domain": dict(settings.domain.values),
        "theta": dict(one.theta),
        "theta_interval": intervals_document(result.knowledge.intervals),
        "prpv": round(result.best.trial.prpv or 0.0),
        "fresh": _fresh(one),
        "seconds_per_episode": cost[0],
        "seconds_per_episode_interval": list(cost[1:]),
        "trials": len(result.trials),
        "seconds": one.seconds,
        "stopped": result.stopped or None,
        "cannot_be_told_from_perfect": bool(result.perfect),
        "fits": result.knowledge.misfit.fits,
        "folder": str(settings.home),
    }


def _fresh(one: TunedFamily) -> dict[str, Any]:
    fresh = one.fresh
    if fresh is None:
        return {"prpv": None, "prpv_interval": None, "noise_floor": None, "chance": None}
    inner = fresh.prpv_interval
    return {
        "prpv": fresh.prpv.value,
        "prpv_interval": _ends(inner.low, inner.high),
        "noise_floor": fresh.noise_floor.value,
        "chance": fresh.chance.mean,
    }


def _lesson(lesson: Lesson | None) -> dict[str, Any]:
    if lesson is None:
        return dict.fromkeys(("plv", "plv_interval", "needed", "more", "zero_shot", "cannot_teach"))
    return {
        "plv": lesson.plv.value if lesson.plv else None,
        "plv_interval": [lesson.plv.low, lesson.plv.high] if lesson.plv else None,
        "needed": estimate(lesson.needed),
        "more": estimate(lesson.more),
        "zero_shot": lesson.zero_shot,
        "cannot_teach": lesson.failure or None,
    }


def _differences(compared: ComparedFamilies) -> list[dict[str, Any]]:
    """PRPV of every two, the better first; the intervals hold for all at once."""
    return [
        {
            "better": one.better,
            "worse": one.worse,
            "difference": one.value,
            "interval": _ends(one.low, one.high),
            "beyond_noise": one.beyond_noise,
        }
        for one in (compared.selection.differences if compared.selection else ())
    ]


def _ends(low: float | None, high: float | None) -> list[float] | None:
    return None if low is None or high is None else [low, high]
