"""One look at what a model leaves over: leads, the best of them fitted in full, random effects, curves over signals."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.model.coordinates import placed, span
from proxytune.diagnosis.model.events import RandomEffect, random_effects
from proxytune.diagnosis.model.fitting import Fit, fit, loss_of, predictive
from proxytune.diagnosis.model.replay import RANDOM_EFFECTS
from proxytune.diagnosis.naming.candidates import candidates
from proxytune.diagnosis.naming.flexible import Curve, curves
from proxytune.diagnosis.naming.found import Tried
from proxytune.diagnosis.naming.screening import Lead, screen
from proxytune.diagnosis.rules import RULES
from proxytune.space import Theta

REFITTED = 6
"""So many effects are fitted in full."""

WORTH_FITTING = 0.1
"""Leads that promise less than this share of the best one are not fitted."""


class Round(NamedTuple):
    """One look at what a model leaves over."""

    leads: list[Lead]
    fits: dict[str, tuple[Lead, Fit, float]]
    random: tuple[RandomEffect, ...]
    curves: list[Curve]


def look(model: Fit, taken: set[str], seed: int) -> Round:
    """Look at what a model leaves over, for effects that it does not have yet."""
    nominal = model.drives.robot.figures
    leads = screen(model, candidates(nominal, model.theta, taken), seed)
    fits = _refit(model, _worth_fitting(leads), {})
    random = () if taken & set(RANDOM_EFFECTS) else _random(model, seed)
    found = curves(model)
    best = max((gain for _, _, gain in fits.values()), default=0.0)
    if found and leads_over(found[0], best):
        others = [lead for lead in leads if lead.candidate.effect in found[0].group.effects]
        fits |= _refit(model, others, fits)
    return Round(leads, fits, random, found)


def _worth_fitting(leads: Sequence[Lead]) -> list[Lead]:
    """The best form of each of the best effects, and its plain form."""
    forms: dict[str, Lead] = {}
    for lead in leads:
        forms.setdefault(lead.candidate.effect, lead)
    best = list(forms.values())[:REFITTED]
    names = {lead.candidate.effect for lead in best if lead.candidate.form}
    return best + [lead for lead in leads if not lead.candidate.form and lead.candidate.effect in names]


def _random(model: Fit, seed: int) -> tuple[RandomEffect, ...]:
    """Random effects, if the model has a delay to share their mean lateness with."""
    return random_effects(model, seed) if ("delay",) in model.free else ()


def _refit(
    model: Fit, leads: Sequence[Lead], done: dict[str, tuple[Lead, Fit, float]]
) -> dict[str, tuple[Lead, Fit, float]]:
    """Fit leads in full, with their evidence."""
    plain = float(predictive(model).sum())
    best = max((lead.gain for lead in leads), default=0.0)
    fits = {}
    for lead in leads:
        label = lead.candidate.label
        if label not in done and lead.gain > max(RULES.least_gain_nats, WORTH_FITTING * best):
            fitted = fit(model.drives, _start(model, lead), model.free + lead.candidate.free, model.noise)
            fits[label] = (lead, fitted, float(predictive(fitted).sum()) - plain)
    return fits


def _start(model: Fit, lead: Lead) -> Theta:
    """The better of the probe and where the step from it leads."""
    theta = {**model.theta, **lead.candidate.fixed}
    low, high = np.array([span(coordinate) for coordinate in lead.candidate.free]).T
    starts = [
        placed(theta, lead.candidate.free, np.clip(np.array(values), low, high)) for values in (lead.start, lead.probe)
    ]
    return min(starts, key=lambda start: loss_of(model.drives, start, model.whiten))


def leads_over(curve: Curve, gain: float) -> bool:
    """Whether a curve says clearly more than a named effect of this gain."""
    return curve.gain > RULES.curve_factor * gain and curve.gain > gain + RULES.curve_margin_nats


def unnamed(looked: Round, gain: float) -> list[Curve]:
    """Curves over signals that say clearly more than any named effect."""
    return [curve for curve in looked.curves if leads_over(curve, gain)]


def tried_of(looked: Round) -> list[Tried]:
    """Every effect that was looked at, best first."""
    fitted = {label: gain for label, (_, _, gain) in looked.fits.items()}
    named = [
        Tried(lead.candidate.effect, lead.candidate.form, fitted.get(lead.candidate.label, lead.held_out), lead.p_value)
        for lead in looked.leads
    ]
    chancy = [Tried(effect.effect, "", effect.gain, effect.p_value) for effect in looked.random]
    return sorted(named + chancy, key=lambda tried: -tried.gain)
