"""The choice of the effect that is adopted next, if any."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.windows import blocks_of, cut, pose_errors, ratio
from proxytune.diagnosis.model.coordinates import at_edge
from proxytune.diagnosis.model.events import RandomEffect
from proxytune.diagnosis.model.fitting import Fit, fit
from proxytune.diagnosis.model.replay import lateness
from proxytune.diagnosis.naming.evidence import Evidence
from proxytune.diagnosis.naming.screening import Lead
from proxytune.diagnosis.rules import RULES


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
