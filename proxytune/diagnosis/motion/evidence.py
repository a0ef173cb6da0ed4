"""Evidence for the effects that a model may lack, and what a search for them comes to.

The evidence for an effect is its gain in held-out log-likelihood [nats],

    G = Σ_b log p(z_b | model with the effect, fitted without block b) − Σ_b log p(z_b | model, fitted without block b),

over blocks b of the drives. `gather_evidence` weighs four kinds of explanation on what one model leaves over: the score
test of every candidate (`screening`), a full refit of the best of them, effects that draw (`random_effects`), and
curves over every signal (`signals`), which stand for effects that have no name.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.answer import Rules
from proxytune.diagnosis.motion.fitting import Fit, fit, held_out_log_likelihood, loss_of
from proxytune.diagnosis.motion.innovations import RANDOM_EFFECTS, Coordinate, lateness, spans
from proxytune.diagnosis.motion.random_effects import RandomEffect, random_effects
from proxytune.diagnosis.motion.screening import Candidate, ScreenedCandidate, candidates, screen
from proxytune.diagnosis.motion.signals import SignalCurve, fit_curves
from proxytune.space import Theta

REFITTED = 6
"""The number of effects that are fitted in full, the most promising first."""
WORTH_FITTING = 0.1
"""Candidates that promise less than this share of the best one are not fitted."""


class TriedEffect(NamedTuple):
    """An effect that was tried, in a form (empty: the plain one): its held-out gain [nats], and its chance."""

    effect: str
    form: str
    gain: float
    p_value: float


@dataclass(frozen=True)
class AdoptedEffect:
    """An effect that was added to the model."""

    effect: str  # its name
    form: str  # the form's name; empty for the plain one
    names: tuple[str, ...]  # its parameters in θ
    free: tuple[Coordinate, ...]  # those of them that were fitted, by coordinate
    gain: float  # evidence for it when it was adopted [nats]
    p_value: float  # how often chance gains as much
    rivals: tuple[Candidate, ...]  # other effects that these drives cannot tell from it, with a form of each
    interval: tuple[float, float] | None = None  # the interval of a random effect's parameter


class Variant(NamedTuple):
    """A model's values in θ, and which of them are free."""

    theta: Theta
    free: tuple[Coordinate, ...]


def without_effect(variant: Variant, effect: AdoptedEffect, rate_hz: float) -> Variant:
    """Take an effect out of a model; the mean lateness of an effect that draws becomes a part of the delay again."""
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
    """The result of a search for missing effects."""

    declared: Fit  # the model with declared parameters only
    model: Fit  # the model with the adopted effects
    adopted: tuple[AdoptedEffect, ...]  # those effects, in the order of adoption
    tried: tuple[TriedEffect, ...]  # every effect tried in the first round, best first
    unnamed_curves: tuple[SignalCurve, ...]  # curves over signals that explain what no named effect does, best first
    curves: tuple[SignalCurve, ...]  # curves over every signal before anything was added, best first
    # effects that were adopted and dropped again, each with the model that it was dropped from
    negligible: tuple[DroppedEffect, ...] = ()


class FittedCandidate(NamedTuple):
    """A model with one effect more, screened or random, fitted in full, and the evidence for it [nats]."""

    gain: float
    fitted: Fit
    screened: ScreenedCandidate | None = None
    random: RandomEffect | None = None


class Evidence(NamedTuple):
    """What speaks for a missing effect in what a model leaves over."""

    screened: list[ScreenedCandidate]  # every form of every effect, by its score test
    fits: dict[str, FittedCandidate]  # the best of these, fitted in full, by the label of their form
    random: tuple[RandomEffect, ...]  # effects that draw: lost and late commands
    curves: list[SignalCurve]  # of motion over every signal, whatever its name


def gather_evidence(model: Fit, taken: set[str], seed: int) -> Evidence:
    """Weigh every effect, but those taken, on what the model leaves over."""
    robot = model.drives.robot
    screened = screen(model, candidates(robot, model.theta, taken), seed)
    fits = _refit(model, _choose_best_forms(screened), {})
    # Random effects need a delay in the model to share their mean lateness with.
    draws = ("delay",) in model.free and not taken & set(RANDOM_EFFECTS)
    random = random_effects(model, seed) if draws else ()
    curves = fit_curves(model)
    best = max((one.gain for one in fits.values()), default=0.0)
    # A leading signal is a hint: the effects that act through it may have looked poor after one step only.
    if curves and exceeds_names(curves[0], best, model.drives.rules):
        traces = ((one, robot.catalogue.effect(one.candidate.effect).trace) for one in screened)
        others = [one for one, trace in traces if trace and curves[0].group.name in trace.cues]
        fits |= _refit(model, others, fits)
    return Evidence(screened, fits, random, curves)


def _choose_best_forms(screened: Sequence[ScreenedCandidate]) -> list[ScreenedCandidate]:
    """Choose the best form of each of the best effects, and its plain form."""
    forms: dict[str, ScreenedCandidate] = {}
    for one in screened:
        forms.setdefault(one.candidate.effect, one)
    best = list(forms.values())[:REFITTED]
    names = {one.candidate.effect for one in best if one.candidate.form}
    return best + [one for one in screened if not one.candidate.form and one.candidate.effect in names]


def _refit(
    model: Fit, chosen: Sequence[ScreenedCandidate], done: Mapping[str, FittedCandidate]
) -> dict[str, FittedCandidate]:
    """Fit the candidates that promise enough and are not fitted yet: from the better of the probe and the step."""
    plain = float(held_out_log_likelihood(model).sum())
    least = max(model.drives.rules.least_gain_nats, WORTH_FITTING * max((one.gain for one in chosen), default=0.0))
    fits: dict[str, FittedCandidate] = {}
    for one in chosen:
        form = one.candidate
        if form.label in done or not one.gain > least:
            continue
        low, high = spans(form.free, model.drives)
        starts = [form.theta_at(model.theta, np.clip(values, low, high)) for values in (one.start, one.probe)]
        start = min(starts, key=lambda start: loss_of(model.drives, start, model.whiten))
        fitted = fit(model.drives, start, model.free + form.free, model.noise)
        fits[form.label] = FittedCandidate(float(held_out_log_likelihood(fitted).sum()) - plain, fitted, one)
    return fits


def exceeds_names(curve: SignalCurve, gain: float, rules: Rules) -> bool:
    """Tell whether a curve gains clearly more than a named effect of this gain [nats]."""
    return curve.gain > rules.curve_factor * gain and curve.gain > gain + rules.curve_margin_nats


def list_tried(evidence: Evidence) -> list[TriedEffect]:
    """List every effect that was weighed, best first; by its full fit where it has one."""
    fitted = {label: one.gain for label, one in evidence.fits.items()}
    named = [
        TriedEffect(form.effect, form.form, fitted.get(form.label, one.held_out), one.p_value)
        for one in evidence.screened
        for form in (one.candidate,)
    ]
    random = [TriedEffect(effect.effect, "", effect.gain, effect.p_value) for effect in evidence.random]
    return sorted(named + random, key=lambda tried: -tried.gain)
