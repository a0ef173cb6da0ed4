"""The search for missing effects: fit, weigh what is left over, adopt, weigh again.

The choice of the effect that is adopted next, if any.
Adopting an effect: the model with it, its rivals, and what no longer pays beside it.
Naming what a model lacks: search, drop what does not matter, and search again where a harmful effect misled.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.motion.drives import Drives
from proxytune.diagnosis.motion.effect_size import drop_immaterial
from proxytune.diagnosis.motion.evidence import (
    AdoptedEffect,
    DroppedEffect,
    Evidence,
    Findings,
    FittedLead,
    TriedEffect,
    Variant,
    curves_beyond_names,
    gather_evidence,
    list_tried,
    without_effect,
)
from proxytune.diagnosis.motion.fitting import Fit, fit, held_out_log_likelihood
from proxytune.diagnosis.motion.innovations import at_edge, lateness
from proxytune.diagnosis.motion.prediction import blocks_of, cut, pose_errors, ratio
from proxytune.diagnosis.motion.random_effects import RandomEffect, size_random_effect
from proxytune.diagnosis.motion.screening import Candidate, Lead
from proxytune.diagnosis.motion.signals import Curve
from proxytune.diagnosis.rules import RULES
from proxytune.effects import effect_of
from proxytune.space import Theta


class Choice(NamedTuple):
    """An effect that may be adopted, and the model with it; either `lead` or `random` is given.

    Attributes:
        gain: Evidence for it [nats].
        fitted: The model with it.
        lead: Where it was seen, None for one that draws.
        random: What it draws, None for any other.
    """

    gain: float
    fitted: Fit
    lead: Lead | None = None
    random: RandomEffect | None = None


def choose_best(model: Fit, evidence: Evidence, least: float) -> Choice | None:
    """The effect with most evidence, if that is more than chance and predicts no worse.

    Args:
        model: The model without it.
        evidence: What speaks for each effect.
        least: Evidence that it needs [nats].
    """
    leads = [one for one in evidence.fits.values() if one.lead.p_value <= RULES.p_value]
    fits = [Choice(one.gain, one.fitted, one.lead) for one in leads]
    named = [choice for choice in fits if not _is_everywhere(choice)]
    rare = [effect for effect in evidence.random if effect.p_value <= RULES.p_value]
    clear = [effect for effect in rare if effect.gain >= RULES.least_random_gain_nats]
    everything: list[Choice | RandomEffect] = [*named, *clear]
    ranked = sorted(everything, key=lambda one: -one.gain)
    # Generators, here and below: a random effect costs a fit, which is made only once its turn comes.
    enough = (fit_choice(model, one) for one in ranked if one.gain >= least)
    best = next((choice for choice in enough if predicts_no_worse(choice.fitted, model)), None)
    if best is None:
        return None
    plain = next((choice for choice in named if _is_plain_form_of(choice, best)), best)
    return plain if not _is_at_edge(plain) else _prefer_inside(model, plain, ranked)


def fit_choice(model: Fit, effect: Choice | RandomEffect) -> Choice:
    """The choice of an effect; the model with a random effect is fitted here."""
    return effect if isinstance(effect, Choice) else Choice(effect.gain, _fit_random(model, effect), random=effect)


def _prefer_inside(model: Fit, best: Choice, ranked: Sequence[Choice | RandomEffect]) -> Choice:
    """The first that gains nearly as much as the best, is not at an end of its range, and predicts no worse."""
    near = (fit_choice(model, one) for one in ranked if one.gain > RULES.inside_share * best.gain)
    inside = next((choice for choice in near if not _is_at_edge(choice)), None)
    return inside if inside is not None and predicts_no_worse(inside.fitted, best.fitted) else best


def _is_everywhere(choice: Choice) -> bool:
    """Whether an effect of a place acts where most of the drives were: then it is no matter of place."""
    if choice.lead is None:
        return False
    name, catalogue = choice.lead.candidate.effect, choice.fitted.drives.robot.catalogue
    trace = catalogue.effect(name).trace
    if trace is None or not trace.placed:
        return False
    _, x, y, radius = (choice.fitted.theta[name] for name in catalogue.theta_names(name))
    places = choice.fitted.drives.poses[:, 0, :2]
    return float((np.hypot(*(places - (x, y)).T) < radius).mean()) > RULES.patch_share


def _is_at_edge(choice: Choice) -> bool:
    """Whether one of its values was fitted to an end of its range: the effect then stands for something else."""
    free = choice.lead.candidate.free if choice.lead else ()
    robot = choice.fitted.drives.robot
    return any(at_edge(name, choice.fitted.theta[name], robot) for names in free for name in names)


def _is_plain_form_of(choice: Choice, best: Choice) -> bool:
    """Whether it is the best effect's form for both wheels alike, at little loss of evidence."""
    if choice.lead is None or best.lead is None or choice is best or choice.lead.candidate.form:
        return False
    same = choice.lead.candidate.effect == best.lead.candidate.effect
    return same and choice.gain > RULES.plain_share * best.gain


def _fit_random(model: Fit, effect: RandomEffect) -> Fit:
    """The model with an effect that draws.

    The delay gives up the mean lateness of the draws, which it had to stand for without the effect.
    """
    theta = {**model.theta, effect.parameter: effect.value}
    late = lateness(theta, model.drives.rate_hz) - lateness(model.theta, model.drives.rate_hz)
    theta["delay"] = max(0.0, model.theta["delay"] - late)
    return fit(model.drives, theta, model.free, model.noise)


def predicts_no_worse(one: Fit, other: Fit) -> bool:
    """Whether one model's error over windows is not shown to be larger than the other's beyond the guard's factor."""
    windows = cut(other.drives, RULES.guard_horizon_s)
    if len(windows.begin) < 2:
        return True  # drives too short for windows: single steps are all there is to go by
    squares = [pose_errors(fitted.drives, fitted.theta, windows)[:, 0] ** 2 for fitted in (one, other)]
    return ratio(squares[0], squares[1], blocks_of(other.drives, windows)).interval[0] <= RULES.guard_factor


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


Report = Callable[[str], None]
"""Takes a line about each step, for people who wait."""


def fit_declared(drives: Drives, theta: Theta, declared: tuple[str, ...]) -> Fit:
    """Fit the model with declared parameters only, from where θ has them."""
    return fit(drives, theta, tuple((name,) for name in declared))


def search(base: Fit, seed: int, report: Report, without: Collection[str] = ()) -> Findings:
    """Add what a model is missing, one effect at a time.

    Args:
        base: The model, fitted.
        seed: Of the null distributions.
        report: Takes a line about each step, as it begins.
        without: Effects that are not to be added.
    """
    declared = {effect_of(name) for coordinate in base.free for name in coordinate} | set(without)
    model = base
    adopted: list[AdoptedEffect] = []
    tried: list[TriedEffect] = []
    first_curves: list[Curve] = []
    remainder: list[Curve] = []
    for number in range(RULES.most_effects + 1):
        report(f"looking for what is missing, round {number + 1}")
        taken = declared | {effect.effect for effect in adopted}
        evidence = gather_evidence(model, taken, seed)
        tried = tried or list_tried(evidence)
        first_curves = first_curves or evidence.curves
        least = max(RULES.least_gain_nats, RULES.least_gain_share * sum(effect.gain for effect in adopted))
        best = choose_best(model, evidence, least)
        remainder = curves_beyond_names(evidence, max(least, best.gain if best else 0.0))
        # One round more than there may be effects: the last one only says what is still left over.
        if (
            best is None
            or number == RULES.most_effects
            or (remainder and not _is_worth_adding(adopted, best, remainder))
        ):
            break
        if best.random is not None:
            best = fit_choice(model, size_random_effect(model, best.random, seed))
        model, adopted = drop_idle(best.fitted, adopt(adopted, best, evidence))
    return Findings(base, model, tuple(adopted), tuple(tried), tuple(remainder), tuple(first_curves))


def _is_worth_adding(adopted: list[AdoptedEffect], best: Choice, remainder: list[Curve]) -> bool:
    """Whether an effect is worth adding although a signal explains more; the first never is, for it might be wrong."""
    least = max(RULES.curve_margin_nats, RULES.share_of_curve * remainder[0].gain)
    return bool(adopted) and best.gain > least


def name_effects(base: Fit, seed: int, report: Report) -> Findings:
    """Search for what a model is missing, and drop what does not matter.

    What was chosen beside an effect that does harm may be wrong. So the search is then made once more without that
    effect, and taken where it predicts no worse.

    Args:
        base: The model with declared parameters only, fitted.
        seed: Of the null distributions and of draws.
        report: Takes a line about each step, as it begins.
    """
    first, misled = _search_and_weigh(base, seed, report, ())
    if not misled:
        return first
    names = tuple(dropped.effect.effect for dropped in misled)
    report(f"searching again without {', '.join(names)}")
    again, _ = _search_and_weigh(base, seed, report, names)
    return (
        replace(again, immaterial=again.immaterial + misled) if predicts_no_worse(again.model, first.model) else first
    )


def _search_and_weigh(
    base: Fit, seed: int, report: Report, without: tuple[str, ...]
) -> tuple[Findings, tuple[DroppedEffect, ...]]:
    """Search, drop what does not matter, and tell which effects did harm while others were chosen beside them."""
    found = search(base, seed, report, without)
    report("weighing what each effect is worth")
    kept = drop_immaterial(found, seed)
    order = [effect.effect for effect in found.adopted]
    last = max((order.index(effect.effect) for effect in kept.adopted), default=-1)
    harmful = (dropped for dropped in kept.immaterial if dropped.harmful)
    return kept, tuple(dropped for dropped in harmful if order.index(dropped.effect.effect) < last)
