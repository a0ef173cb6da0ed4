"""What `teach --json` prints; its keys are promises."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from proxytune.learning import Curve, Distribution, Estimate
from proxytune.study import as_document
from proxytune.teaching import Agreement, Experiment, Predictivity, TeacherResult, observe, teaching_settings


def teach_document(experiment: Experiment, prpv: Mapping[str, Predictivity | None]) -> dict[str, Any]:
    """A learning experiment as plain JSON; None where a figure is undefined or was not reached."""
    found = observe(experiment, prpv)
    return {
        "name": experiment.settings.name,
        "best_score": experiment.best_score,
        "convergence": {
            "level": experiment.when.level,
            "tolerance": experiment.when.tolerance,
            "threshold": experiment.when.threshold,
            "settled": experiment.settled,
        },
        "without": _curve(experiment.without),
        "proxies": {lesson.name: _lesson(lesson, prpv.get(lesson.name)) for lesson in experiment.teachers},
        "kendall_tau": {
            "zero_shot": _agreement(found.zero_shot if found else None),
            "prpv": _agreement(found.prpv if found else None),
        },
        "saves_though_it_predicts_by_chance": list(found.poor_predictors) if found else [],
        "settings": {**as_document(experiment.settings), "teaching": _settings(experiment)},
    }


def _agreement(found: Agreement | None) -> dict[str, Any] | None:
    """How far a ranking agrees with that by PLV."""
    if found is None:
        return None
    pairs = [list(pair) for pair in found.reversed]
    return {"value": found.tau, "interval": [found.low, found.high], "contrary_pairs": pairs}


def _lesson(lesson: TeacherResult, prpv: Predictivity | None) -> dict[str, Any]:
    worth = lesson.worth
    figures = ("without", "needed", "plv", "factor", "reduction")
    return {
        "theta": theta_of(lesson.proxy),
        "prpv": prpv.prpv if prpv else None,
        "prpv_interval": list(prpv.interval) if prpv and prpv.interval else None,
        "prpv_chance": {"mean": prpv.chance.mean, "p_value": prpv.chance.p_value} if prpv else None,
        "zero_shot": lesson.zero_shot.value,
        "zero_shot_interval": [lesson.zero_shot.low, lesson.zero_shot.high],
        **{name: estimate(getattr(worth, name) if worth else None) for name in figures},
        "plv_cost": estimate(lesson.cost),
        **_curve(lesson.curve),
    }


def theta_of(proxy: Distribution) -> dict[str, Any]:
    """p(θ): a number where a parameter is fixed, else its bounds."""
    return {name: low if low == high else [low, high] for name, (low, high) in proxy.bounds.items()}


def estimate(figure: Estimate | None) -> dict[str, Any] | None:
    """A figure with its interval; None where it was not to be had."""
    return None if figure is None else {"value": figure.value, "interval": [figure.low, figure.high]}


def _curve(curve: Curve) -> dict[str, Any]:
    scores = [[None if score != score else score for score in row] for row in curve.scores.tolist()]
    return {"target_samples": list(curve.counts), "scores": scores, "examinations": len(curve.examined)}


def _settings(experiment: Experiment) -> dict[str, Any]:
    taught = teaching_settings(experiment.settings)
    names = ("learner", "proxy_samples", "seeds", "lesson_s", "level", "tolerance", "examinations")
    lessons = ("rehearsal", "proxy_lessons", "target_lessons")
    return {
        "target": str(taught.target),
        "target_samples": list(taught.target_samples),
        **{name: getattr(taught, name) for name in (*names, *lessons)},
        "costs": asdict(taught.costs),
        "published": {name: asdict(row) for name, row in taught.published.items()},
        "published_in": taught.published_in,
    }
