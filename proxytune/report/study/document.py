"""What `study --json` prints; its keys are promises."""

from typing import Any

from proxytune.report.scores.document import document_of
from proxytune.report.study.finding import finding_of
from proxytune.report.study.knowledge_document import intervals_document, knowledge_document
from proxytune.report.study.verdict import sentence
from proxytune.search import Importance
from proxytune.storage import TrialRecord
from proxytune.study import PRPV, Confirmation, Preflight, StudyResult, as_document


def study_document(result: StudyResult) -> dict[str, Any]:
    """A study's result as plain JSON; None where a figure is undefined."""
    return {
        "name": result.study.settings.name,
        "sentence": sentence(finding_of(result)),
        "best": _best(result),
        **_worth(result),
        **knowledge_document(result.knowledge),
        "truth": None if result.truth is None else dict(result.truth),
        "cautions": list(result.cautions),
        "importance": {one.name: _importance(one) for one in result.importances},
        "preflight": _preflight(result.preflight),
        "stopped": result.stopped or None,
        "cut_off": {"trials": len(result.cut), "episodes": result.spared[0], "seconds": result.spared[1]},
        "trials": [_trial(trial) for trial in result.trials],
        "failures": list(result.failures),
        "target": _target(result),
        "settings": dict(as_document(result.study.settings)),
    }


def _best(result: StudyResult) -> dict[str, Any]:
    """The answer, what is known of it, and its measures in the trial's own episodes and in fresh ones."""
    best, learnt, measures = result.best, result.knowledge, document_of(result.best.assessment)
    shared = ("prpv", "prpv_normalised", "prpv_interval", "ppv")
    return {
        "index": best.trial.number,
        "theta": dict(best.trial.theta),
        "theta_interval": intervals_document(learnt.intervals),
        "region_share": float(learnt.posterior.share),
        "unidentified": list(learnt.unidentified),
        **{key: measures[key] for key in shared},
        "objective": {"name": result.study.objective.name, "value": result.value_of(best.trial)},
        "fresh": _fresh(result.confirmation, by_prpv=result.study.objective == PRPV),
        "posterior_mean": best.posterior_mean,
        "posterior_deviation": best.posterior_deviation,
        "usefulness": measures,
    }


def _worth(result: StudyResult) -> dict[str, Any]:
    """What PRPV of the answer is held against: of its fresh episodes where they were driven."""
    measures = document_of(result.judged)
    levels = ("noise_floor", "noise_floor_interval", "noise_floor_kind", "at_noise_floor", "chance", "chance_deviation")
    return {
        **{key: measures[key] for key in (*levels, "p_value", "notes")},
        "cannot_be_told_from_perfect": bool(result.perfect),
    }


def _importance(one: Importance) -> dict[str, Any]:
    return {"share": one.share, "interval": list(one.interval), "alone": one.alone}


def _fresh(confirmation: Confirmation | None, *, by_prpv: bool) -> dict[str, Any] | None:
    """What fresh episodes say of the answer and of its rivals."""
    if confirmation is None:
        return None
    measures = document_of(confirmation.answer.assessment) if confirmation.answer.assessment else {}
    return {
        **{key: measures.get(key) for key in ("prpv", "prpv_normalised", "prpv_interval", "ppv")},
        "optimism": confirmation.answer.optimism,
        "episodes": confirmation.episodes,
        "candidates": [
            {
                "index": one.trial.number,
                "prpv": round(one.trial.prpv or 0.0),
                "fresh_prpv": [None if score is None else round(score) for score in one.scores if by_prpv],
                "fresh_scores": list(one.scores),
            }
            for one in confirmation.candidates
        ],
    }


def _preflight(preflight: Preflight | None) -> dict[str, Any] | None:
    if preflight is None:
        return None
    keys = ("moves", "p_value", "metric", "change", "noise", "pairs")
    moved = {one.interval.name: {key: getattr(one, key) for key in keys} for one in preflight.movements}
    return {
        "base": dict(preflight.base),
        "episodes": preflight.episodes,
        "parameters": moved,
        "warnings": list(preflight.warnings),
    }


def _trial(trial: TrialRecord) -> dict[str, Any]:
    return {
        "index": trial.number,
        "theta": dict(trial.theta),
        "prpv": None if trial.prpv is None else round(trial.prpv),
        "ppv": trial.ppv,
        "measures": dict(trial.measures),
        "failed_episodes": trial.failed_episodes,
        "failure": trial.failure or None,
        "cut_off": _cut(trial),
    }


def _cut(trial: TrialRecord) -> dict[str, Any] | None:
    if trial.state != "cut":
        return None
    return {"prpv_at_least": trial.bound, "prpv_estimate": trial.estimate, "agents": list(trial.decided)}


def _target(result: StudyResult) -> dict[str, Any]:
    target = result.study.target
    counts = [int(target.counts.min()), int(target.counts.max())]
    settings = result.study.settings
    files = {"path": str(settings.target), "files": [str(path) for path in settings.targets]}
    return {**files, "agents": len(target.agents), "episodes_per_agent": counts}
