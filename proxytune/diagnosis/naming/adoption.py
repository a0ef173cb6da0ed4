"""Adopting an effect: the model with it, its rivals, and what no longer pays beside it."""

import numpy as np

from proxytune.diagnosis.model.events import RandomEffect
from proxytune.diagnosis.model.fitting import Fit, fit, predictive
from proxytune.diagnosis.naming.candidates import Candidate
from proxytune.diagnosis.naming.choice import Choice, no_worse
from proxytune.diagnosis.naming.found import Adopted, Variant, lacking
from proxytune.diagnosis.naming.round import Round
from proxytune.diagnosis.naming.screening import Lead
from proxytune.diagnosis.rules import RULES


def adopt(adopted: list[Adopted], best: Choice, looked: Round) -> list[Adopted]:
    """The effects of a model with another, which has its rivals."""
    return [*adopted, _drawn(best.random, looked) if best.random else _steady(best, looked)]


def _steady(best: Choice, looked: Round) -> Adopted:
    assert best.lead is not None
    candidate = best.lead.candidate
    names = tuple(dict.fromkeys([name for names in candidate.free for name in names] + list(candidate.fixed)))
    rivals = _rivals(best.lead, best.fitted, best.gain, looked)
    return Adopted(candidate.effect, candidate.form, names, candidate.free, best.gain, best.lead.p_value, rivals)


def _drawn(effect: RandomEffect, looked: Round) -> Adopted:
    least = min(effect.gain - RULES.rival_nats, RULES.rival_share * effect.gain)
    close = [other for other in looked.random if other.effect != effect.effect and other.gain > least]
    rivals = tuple(Candidate(other.effect, "", ((other.parameter,),), {}, (0.0,), ((other.value,),)) for other in close)
    return Adopted(
        effect.effect, "", (effect.parameter,), (), effect.gain, effect.p_value, rivals, interval=effect.interval
    )


def _rivals(best: Lead, chosen: Fit, gain: float, looked: Round) -> tuple[Candidate, ...]:
    found: dict[str, Candidate] = {}
    for lead in looked.leads:
        other = looked.fits.get(lead.candidate.label)
        close = other is not None and (other[2] > gain - RULES.rival_nats or _as_good(other, gain, chosen))
        if lead.candidate.effect != best.candidate.effect and (close or _cosine(lead, best) > RULES.rival_cosine):
            found.setdefault(lead.candidate.effect, lead.candidate)
    return tuple(found.values())


def _as_good(other: tuple[Lead, Fit, float], gain: float, chosen: Fit) -> bool:
    """Whether it has most of the evidence and predicts no worse, block by block."""
    return other[2] >= RULES.rival_share * gain and no_worse(other[1], chosen)


def _cosine(one: Lead, other: Lead) -> float:
    size = float(np.linalg.norm(one.column) * np.linalg.norm(other.column))
    return float(one.column @ other.column) / size if size > 0.0 else 0.0


def without_idle(model: Fit, adopted: list[Adopted]) -> tuple[Fit, list[Adopted]]:
    """Drop what no longer pays beside the effect adopted last."""
    for effect in adopted[:-1]:
        if effect.free and len(adopted) > 1:
            rest = lacking(Variant(model.theta, model.free), effect, model.drives.rate_hz)
            without = fit(model.drives, rest.theta, rest.free, model.noise)
            if float(predictive(model).sum() - predictive(without).sum()) < RULES.least_gain_nats:
                return without, [other for other in adopted if other is not effect]
    return model, adopted
