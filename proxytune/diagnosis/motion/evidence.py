"""The evidence in what a model leaves over: leads, the best of them fitted, random effects, curves over signals.

What a search for missing effects finds: effects tried, adopted and dropped, and the models with them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.motion.fitting import Fit, fit, held_out_log_likelihood, loss_of
from proxytune.diagnosis.motion.innovations import RANDOM_EFFECTS, Coordinate, lateness, span, theta_at
from proxytune.diagnosis.motion.random_effects import RandomEffect, random_effects
from proxytune.diagnosis.motion.screening import Candidate, Lead, candidates, screen
from proxytune.diagnosis.motion.signals import Curve, fit_curves
from proxytune.diagnosis.rules import RULES
from proxytune.effects import Catalogue, Cue
from proxytune.space import Theta


class TriedEffect(NamedTuple):
    """An effect that was tried.

    Attributes:
        effect: Its name.
        form: What is special about the form.
        gain: Evidence: log-likelihood gained on blocks it was not fitted to [nats].
        p_value: How often chance gains as much.
    """

    effect: str
    form: str
    gain: float
    p_value: float


@dataclass(frozen=True)
class AdoptedEffect:
    """An effect that was added to the model.

    Attributes:
        effect: Its name.
        form: What is special about the form.
        names: Its parameters in θ.
        free: Those of them that were fitted, by coordinate.
        gain: Evidence for it when it was adopted [nats].
        p_value: How often chance gains as much.
        rivals: Other effects that these drives cannot tell from it, with a form of each.
        interval: The interval of a random effect's parameter.
    """

    effect: str
    form: str
    names: tuple[str, ...]
    free: tuple[Coordinate, ...]
    gain: float
    p_value: float
    rivals: tuple[Candidate, ...]
    interval: tuple[float, float] | None = None


class Variant(NamedTuple):
    """A model's values in θ, and which of them are free."""

    theta: Theta
    free: tuple[Coordinate, ...]


def without_effect(variant: Variant, effect: AdoptedEffect, rate_hz: float) -> Variant:
    """A model without an effect; the mean lateness of an effect that draws becomes a part of the delay again."""
    theta = {name: value for name, value in variant.theta.items() if name not in effect.names}
    late = lateness(variant.theta, rate_hz) - lateness(theta, rate_hz)
    if late > 0.0:
        theta["delay"] = theta.get("delay", 0.0) + late
    return Variant(theta, tuple(coordinate for coordinate in variant.free if coordinate not in effect.free))


class DroppedEffect(NamedTuple):
    """An effect that was dropped, the model that had it, and whether it is shown to have done harm to predictions."""

    effect: AdoptedEffect
    beside: Variant
    harmful: bool = False


@dataclass(frozen=True)
class Findings:
    """What a search for missing effects finds.

    Attributes:
        declared: The model with declared parameters only.
        model: The model with the adopted effects.
        adopted: Those effects, in the order of adoption.
        tried: Every effect tried in the first round, best first.
        remainder: Curves over signals that explain what no named effect does, best first.
        curves: Curves over every signal before anything was added, best first.
        immaterial: Effects that were adopted and dropped again, each with the model that it was dropped from.
    """

    declared: Fit
    model: Fit
    adopted: tuple[AdoptedEffect, ...]
    tried: tuple[TriedEffect, ...]
    remainder: tuple[Curve, ...]
    curves: tuple[Curve, ...]
    immaterial: tuple[DroppedEffect, ...] = ()


REFITTED = 6
"""The number of effects that are fitted in full, the most promising first."""

WORTH_FITTING = 0.1
"""Leads that promise less than this share of the best one are not fitted."""


class FittedLead(NamedTuple):
    """A lead fitted in full.

    Attributes:
        lead: The form and where it was seen.
        fitted: The model with it.
        gain: Evidence for it [nats].
    """

    lead: Lead
    fitted: Fit
    gain: float


class Evidence(NamedTuple):
    """What speaks for each missing effect, in what one model leaves over.

    Attributes:
        leads: One step towards every form of every effect, best first.
        fits: The best of them fitted in full, by label.
        random: Effects that draw.
        curves: Curves over every signal, best first.
    """

    leads: list[Lead]
    fits: dict[str, FittedLead]
    random: tuple[RandomEffect, ...]
    curves: list[Curve]


def gather_evidence(model: Fit, taken: set[str], seed: int) -> Evidence:
    """Weigh every effect that the model does not have yet on what it leaves over.

    Args:
        model: The model, fitted.
        taken: Names of the effects that it has, or is not to have.
        seed: Of the null distributions.
    """
    robot = model.drives.robot
    leads = screen(model, candidates(robot, model.theta, taken), seed)
    fits = _fit_leads(model, _choose_leads(leads), {})
    random = () if taken & set(RANDOM_EFFECTS) else _find_random(model, seed)
    found = fit_curves(model)
    best = max((one.gain for one in fits.values()), default=0.0)
    # A leading signal is a hint: the effects that act through it may have looked poor after one step only.
    if found and leads_over(found[0], best):
        others = [lead for lead in leads if found[0].group.name in _cues(robot.catalogue, lead.candidate.effect)]
        fits |= _fit_leads(model, others, fits)
    return Evidence(leads, fits, random, found)


def _cues(catalogue: Catalogue, effect: str) -> tuple[Cue, ...]:
    trace = catalogue.effect(effect).trace
    return trace.cues if trace else ()


def _choose_leads(leads: Sequence[Lead]) -> list[Lead]:
    """The best form of each of the best effects, and its plain form."""
    forms: dict[str, Lead] = {}
    for lead in leads:
        forms.setdefault(lead.candidate.effect, lead)
    best = list(forms.values())[:REFITTED]
    names = {lead.candidate.effect for lead in best if lead.candidate.form}
    return best + [lead for lead in leads if not lead.candidate.form and lead.candidate.effect in names]


def _find_random(model: Fit, seed: int) -> tuple[RandomEffect, ...]:
    """Random effects, if the model has a delay to share their mean lateness with."""
    return random_effects(model, seed) if ("delay",) in model.free else ()


def _fit_leads(model: Fit, leads: Sequence[Lead], done: Mapping[str, FittedLead]) -> dict[str, FittedLead]:
    """Fit the leads that are worth it and not done yet."""
    plain = float(held_out_log_likelihood(model).sum())
    best = max((lead.gain for lead in leads), default=0.0)
    fits: dict[str, FittedLead] = {}
    for lead in leads:
        label = lead.candidate.label
        if label not in done and lead.gain > max(RULES.least_gain_nats, WORTH_FITTING * best):
            fitted = fit(model.drives, _start(model, lead), model.free + lead.candidate.free, model.noise)
            fits[label] = FittedLead(lead, fitted, float(held_out_log_likelihood(fitted).sum()) - plain)
    return fits


def _start(model: Fit, lead: Lead) -> Theta:
    """The better of the probe and where the step from it leads."""
    theta = {**model.theta, **lead.candidate.fixed}
    low, high = np.array([span(coordinate, model.drives.robot) for coordinate in lead.candidate.free]).T
    starts = [
        theta_at(theta, lead.candidate.free, np.clip(np.array(values), low, high))
        for values in (lead.start, lead.probe)
    ]
    return min(starts, key=lambda start: loss_of(model.drives, start, model.whiten))


def leads_over(curve: Curve, gain: float) -> bool:
    """Whether a curve gains clearly more than a named effect of this gain [nats]."""
    return curve.gain > RULES.curve_factor * gain and curve.gain > gain + RULES.curve_margin_nats


def curves_beyond_names(evidence: Evidence, gain: float) -> list[Curve]:
    """The curves over signals that gain clearly more than the best named effect, of this gain [nats]."""
    return [curve for curve in evidence.curves if leads_over(curve, gain)]


def list_tried(evidence: Evidence) -> list[TriedEffect]:
    """Every effect that was weighed, best first."""
    fitted = {label: one.gain for label, one in evidence.fits.items()}
    named = [
        TriedEffect(
            lead.candidate.effect, lead.candidate.form, fitted.get(lead.candidate.label, lead.held_out), lead.p_value
        )
        for lead in evidence.leads
    ]
    random = [TriedEffect(effect.effect, "", effect.gain, effect.p_value) for effect in evidence.random]
    return sorted(named + random, key=lambda tried: -tried.gain)
