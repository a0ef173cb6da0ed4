"""JSON document of a study, as `study --json` prints it; its keys are promises."""

from collections.abc import Mapping, Sequence
from typing import Any

from proxytune.learning import LearningEstimate
from proxytune.report.scores import score_document
from proxytune.report.study.sentence import study_sentence
from proxytune.report.wording import Ends
from proxytune.search import Information, Knowledge
from proxytune.storage import TrialRecord
from proxytune.study import PRPV, Confirmation, Preflight, StudyResult, settings_document
from proxytune.usefulness import Estimate

OF_EPISODES = ("prpv", "prpv_normalised", "prpv_interval", "ppv")
"""Keys of the scores of a trial's episodes that stand beside its θ, and of fresh ones."""


def study_document(result: StudyResult) -> dict[str, Any]:
    """A study's result as plain JSON; None where a figure is undefined."""
    settings, target = result.study.settings, result.study.target
    return {
        "name": settings.name,
        "sentence": study_sentence(result),
        "best": _best(result),
        **_worth(result),
        **knowledge_document(result.knowledge),
        "truth": None if result.truth is None else dict(result.truth),
        "cautions": list(result.cautions),
        "importance": {
            one.name: {"share": one.share, "interval": list(one.interval), "alone": one.alone}
            for one in result.importances
        },
        "preflight": _preflight(result.preflight),
        "stopped": result.stopped or None,
        "earlier": result.earlier,
        "low_fidelity": result.low_fidelity,
        "cut_off": {"trials": len(result.pruned), "episodes": result.spared[0], "seconds": result.spared[1]},
        "trials": [_trial(trial) for trial in result.trials],
        "failures": list(result.failures),
        "target": {
            "path": str(settings.target),
            "files": [str(path) for path in settings.targets],
            "agents": len(target.agents),
            "episodes_per_agent": [int(target.counts.min()), int(target.counts.max())],
        },
        "settings": dict(settings_document(settings)),
    }


def _best(result: StudyResult) -> dict[str, Any]:
    """The answer, what is known of it, and its measures in the trial's own episodes and in fresh ones."""
    best, learnt, measures = result.best, result.knowledge, score_document(result.best.assessment)
    ppv = result.expected.ppv if result.expected else None
    return {
        "index": best.trial.number or None,
        "theta": dict(best.trial.theta),
        "theta_interval": intervals_document(learnt.intervals),
        "region_share": float(learnt.posterior.share),
        "unidentified": list(learnt.unidentified),
        **{key: measures[key] for key in OF_EPISODES},
        "objective": {"name": result.study.objective.name, "value": result.value_of(best.trial)},
        "fresh": _fresh(result.confirmation, by_prpv=result.study.objective == PRPV),
        "expected_prpv": estimate_document(result.expected.prpv.value if result.expected else None),
        "expected_ppv": estimate_document(ppv.value if ppv else None),
        "posterior_mean": best.posterior_mean,
        "posterior_deviation": best.posterior_deviation,
        "usefulness": measures,
    }


def _worth(result: StudyResult) -> dict[str, Any]:
    """Levels that PRPV of the answer is held against: of its fresh episodes where they were driven."""
    measures, ppv = score_document(result.judged), result.expected.ppv if result.expected else None
    nominal = result.nominal
    levels = ("noise_floor", "noise_floor_interval", "noise_floor_kind", "at_noise_floor", "chance", "chance_deviation")
    return {
        **{key: measures[key] for key in (*levels, "p_value", "notes")},
        "excess": estimate_document(result.excess),
        "excess_ppv": estimate_document(ppv.excess if ppv else None),
        "nominal": nominal
        and {"theta": dict(nominal.theta), "expected_prpv": estimate_document(nominal.expected.prpv.value)},
        "cannot_be_told_from_perfect": bool(result.perfect),
    }


def estimate_document(found: Estimate | LearningEstimate | None) -> dict[str, Any] | None:
    """A figure with its interval; None where it is not known."""
    return None if found is None else {"value": found.value, "interval": [found.low, found.high]}


def pairs_document(prpv: float | None) -> int | None:
    """PRPV as the whole number of pairs that it counts; None where it was not measured."""
    return None if prpv is None else round(prpv)


def _fresh(confirmation: Confirmation | None, *, by_prpv: bool) -> dict[str, Any] | None:
    """Scores of fresh episodes of the answer and of its rivals."""
    if confirmation is None:
        return None
    measures = score_document(confirmation.answer.assessment) if confirmation.answer.assessment else {}
    return {
        **{key: measures.get(key) for key in OF_EPISODES},
        "optimism": confirmation.answer.optimism,
        "episodes": confirmation.episodes,
        "repetitions": confirmation.repetitions,
        "candidates": [
            {
                "index": one.trial.number or None,
                "prpv": pairs_document(one.trial.prpv),
                "fresh_prpv": [pairs_document(score) for score in one.scores if by_prpv],
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
    cut = {"prpv_at_least": trial.bound, "prpv_estimate": trial.estimate, "agents": list(trial.decided)}
    return {
        "index": trial.number,
        "theta": dict(trial.theta),
        "prpv": pairs_document(trial.prpv),
        "ppv": trial.ppv,
        "measures": dict(trial.measures),
        "failed_episodes": trial.failed_episodes,
        "failure": trial.failure or None,
        "cut_off": cut if trial.state == "cut" else None,
    }


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
        "information": information_document(learnt.information),
    }


def information_document(told: Sequence[Information]) -> dict[str, Any]:
    """The shares of agents and metrics in what is told of each parameter, and what limits it."""
    return {
        one.name: {
            "agents": {name: float(share) for name, share in one.agents},
            "metrics": {name: float(share) for name, share in one.metrics},
            "limit": one.limit,
        }
        for one in told
    }


def intervals_document(intervals: Mapping[str, Ends]) -> dict[str, list[float]]:
    """The ends of each parameter's interval."""
    return {name: [float(low), float(high)] for name, (low, high) in intervals.items()}
