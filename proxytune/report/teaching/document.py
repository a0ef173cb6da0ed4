"""What `teach --json` prints; its keys are promises."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from proxytune.learning.plv import Curve, Estimate
from proxytune.study.settings import as_document
from proxytune.teaching.experiment import Experiment, TeacherResult, teaching_settings


def teach_document(experiment: Experiment, prpv: Mapping[str, float | None]) -> dict[str, Any]:
    """A learning experiment as plain JSON; None where a figure is undefined or was not reached."""
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
        "settings": {**as_document(experiment.settings), "teaching": _settings(experiment)},
    }


def _lesson(lesson: TeacherResult, prpv: float | None) -> dict[str, Any]:
    worth = lesson.worth
    figures = ("without", "needed", "plv", "factor", "reduction")
    return {
        "theta": {name: low if low == high else [low, high] for name, (low, high) in lesson.proxy.bounds.items()},
        "prpv": prpv,
        "zero_shot": float(lesson.curve.mean[0]),
        **{name: estimate(getattr(worth, name) if worth else None) for name in figures},
        **_curve(lesson.curve),
    }


def estimate(figure: Estimate | None) -> dict[str, Any] | None:
    """A figure with its interval; None where it was not to be had."""
    return None if figure is None else {"value": figure.value, "interval": [figure.low, figure.high]}


def _curve(curve: Curve) -> dict[str, Any]:
    scores = [[None if score != score else score for score in row] for row in curve.scores.tolist()]
    return {"target_samples": list(curve.counts), "scores": scores}


def _settings(experiment: Experiment) -> dict[str, Any]:
    taught = teaching_settings(experiment.settings)
    names = ("learner", "proxy_samples", "seeds", "lesson_s", "level", "tolerance")
    return {
        "target": str(taught.target),
        "target_samples": list(taught.target_samples),
        **{name: getattr(taught, name) for name in names},
        "published": {name: asdict(row) for name, row in taught.published.items()},
        "published_in": taught.published_in,
    }
