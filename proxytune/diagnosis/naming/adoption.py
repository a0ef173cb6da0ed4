"""Adopting an effect: the model with it, its rivals, and what no longer pays beside it."""

import numpy as np

from proxytune.diagnosis.model.events import RandomEffect
from proxytune.diagnosis.model.fitting import Fit, fit, held_out_log_likelihood
from proxytune.diagnosis.naming.candidates import Candidate
from proxytune.diagnosis.naming.choice import Choice, predicts_no_worse
from proxytune.diagnosis.naming.evidence import Evidence, FittedLead
from proxytune.diagnosis.naming.findings import AdoptedEffect, Variant, without_effect
from proxytune.diagnosis.naming.screening import Lead
from proxytune.diagnosis.rules import RULES


def adopt(adopted: list[AdoptedEffect], best: Choice, evidence: Evidence) -> list[AdoptedEffect]:
    """The effects of a model and one more, with the rivals that the same evidence leaves it.

    Args:
        adopted: The effects so far.
        best: The effect that is adopted.
        evidence: What spoke for it and for all others.
    """
    return [*adopted, _adopt_random(best.random, evidence) if best.random else _adopt_lead(best, evidence)]


def _adopt_lead(best: Choice, evidence: Evidence) -> AdoptedEffect:
    assert best.lead is not None
    candidate = best.lead.candidate
    names = tuple(dict.fromkeys([name for names in candidate.free for name in names] + list(candidate.fixed)))
    rivals = _rivals(best.lead, best.fitted, best.gain, evidence)
    return AdoptedEffect(candidate.effect, candidate.form, names, candidate.free, best.gain, best.lead.p_value, rivals)


def _adopt_random(effect: RandomEffect, evidence: Evidence) -> AdoptedEffect:
    least = min(effect.gain - RULES.rival_nats, RULES.rival_share * effect.gain)
    close = [other for other in evidence.random if other.effect != effect.effect and other.gain > least]
    rivals = tuple(Candidate(other.effect, "", ((other.parameter,),), {}, (0.0,), ((other.value,),)) for other in close)
    return AdoptedEffect(
        effect.effect, "", (effect.parameter,), (), effect.gain, effect.p_value, rivals, interval=effect.interval
    )


def _rivals(best: Lead, chosen: Fit, gain: float, evidence: Evidence) -> tuple[Candidate, ...]:
    rivals: dict[str, Candidate] = {}
    for lead in evidence.leads:
        other = evidence.fits.get(lead.candidate.label)
        close = other is not None and (other.gain > gain - RULES.rival_nats or _is_as_good(other, gain, chosen))
        if lead.candidate.effect != best.candidate.effect and (close or _cosine(lead, best) > RULES.rival_cosine):
            rivals.setdefault(lead.candidate.effect, lead.candidate)
    return tuple(rivals.values())


def _is_as_good(other: FittedLead, gain: float, chosen: Fit) -> bool:
    """Whether another effect has most of the evidence and predicts no worse, block by block."""
    return other.gain >= RULES.rival_share * gain and predicts_no_worse(other.fitted, chosen)


def _cosine(one: Lead, other: Lead) -> float:
    size = float(np.linalg.norm(one.column) * np.linalg.norm(other.column))
    return float(one.column @ other.column) / size if size > 0.0 else 0.0


def drop_idle(model: Fit, adopted: list[AdoptedEffect]) -> tuple[Fit, list[AdoptedEffect]]:
    """Drop the first effect that no longer pays beside the one adopted last; at most one a round.

    Random effects stay: they move no mean, so the likelihood of the mean cannot speak for them.
    """
    for effect in adopted[:-1]:
        if effect.free and len(adopted) > 1:
            rest = without_effect(Variant(model.theta, model.free), effect, model.drives.rate_hz)
            without = fit(model.drives, rest.theta, rest.free, model.noise)
            if (
                float(held_out_log_likelihood(model).sum() - held_out_log_likelihood(without).sum())
                < RULES.least_gain_nats
            ):
                return without, [other for other in adopted if other is not effect]
    return model, adopted
