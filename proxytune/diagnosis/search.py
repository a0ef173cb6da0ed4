"""The search for missing effects: fit, look at what is left, adopt, look again."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.candidates import Candidate, candidates
from proxytune.diagnosis.drives import Drives
from proxytune.diagnosis.events import RandomEffect, random_effects
from proxytune.diagnosis.fitting import Coordinate, Fit, fit, loss_of, placed, predictive, span
from proxytune.diagnosis.flexible import Curve, curves
from proxytune.diagnosis.replay import RANDOM_EFFECTS, lateness
from proxytune.diagnosis.screening import Lead, screen
from proxytune.diagnosis.windows import cut, ratio, strays
from proxytune.effects import effect_of
from proxytune.space import Theta

MOST_EFFECTS = 5
"""No more effects are adopted."""

LEAST_GAIN = 15.0
"""Nats that an effect must gain on blocks it was not fitted to."""

CLEAR_GAIN = 30.0
"""Nats that a random effect must gain: its chance is drawn from shifted innovations, which is rough."""

P_VALUE = 0.01
"""Chance must gain as much as rarely as this."""

LEAST_SHARE = 0.01
"""What gains less than this share of all that was gained before may only mend the form of that."""

REFITTED = 6
"""So many effects are fitted in full."""

PLAIN_SHARE = 0.8
"""An effect of both wheels is preferred to one of a single wheel if it gains this share."""

WORTH_FITTING = 0.1
"""Leads that promise less than this share of the best one are not fitted."""

FLEXIBLE_LEAD = 1.2
FLEXIBLE_NATS = 30.0
"""A curve over a signal is believed over named effects when it gains so many times as much, and so many nats more."""

WORTH_ADDING = 0.3
"""Beside a signal that explains more, an effect is added if it explains this share of that."""

NATS_APART = 3.0
COSINE_APART = 0.95
"""Effects closer than this in evidence, or in what they do to the innovations, are rivals."""

RIVAL_SHARE = 0.7
"""Effects are rivals too if the second has this share of the evidence and predicts no worse."""

ERROR_HORIZON_S = 2.0
ERROR_FACTOR = 1.05
"""A model predicts worse if its error over windows of this horizon is shown to be larger by more than this factor: such
an effect is not adopted, whatever the evidence of single steps."""


class Tried(NamedTuple):
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
class Adopted:
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


class Dropped(NamedTuple):
    """An effect that was dropped, and the model that had it."""

    effect: Adopted
    beside: Variant


@dataclass(frozen=True)
class Found:
    """What the search came to.

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
    adopted: tuple[Adopted, ...]
    tried: tuple[Tried, ...]
    remainder: tuple[Curve, ...]
    curves: tuple[Curve, ...]
    immaterial: tuple["Dropped", ...] = ()


class _Round(NamedTuple):
    """One look at what a model leaves over."""

    leads: list[Lead]
    fits: dict[str, tuple[Lead, Fit, float]]
    random: tuple[RandomEffect, ...]
    curves: list[Curve]


Told = Callable[[str], None]
"""Takes a line about what is being done."""


def search(drives: Drives, theta: Theta, declared: tuple[str, ...], seed: int, told: Told) -> Found:
    """Fit what is declared, then add what is missing, one effect at a time.

    Args:
        drives: What to fit to.
        theta: Where declared parameters start from.
        declared: Their names in θ.
        seed: Of the null distributions.
        told: Hears of progress.
    """
    told("fitting what is declared")
    base = fit(drives, theta, tuple((name,) for name in declared))
    model = base
    adopted: list[Adopted] = []
    tried: list[Tried] = []
    first_curves: list[Curve] = []
    remainder: list[Curve] = []
    for number in range(MOST_EFFECTS + 1):
        told(f"looking for what is missing, round {number + 1}")
        taken = set(map(effect_of, declared)) | {effect.effect for effect in adopted}
        looked = _look(model, taken, seed)
        tried = tried or _tried(looked)
        first_curves = first_curves or looked.curves
        least = max(LEAST_GAIN, LEAST_SHARE * sum(effect.gain for effect in adopted))
        best = _best(model, looked, least)
        remainder = _unnamed(looked, max(least, best.gain if best else 0.0))
        if best is None or number == MOST_EFFECTS or (remainder and not _goes_on(adopted, best, remainder)):
            break
        model, adopted = _adopt(model, adopted, best, looked)
        model, adopted = _backward(model, adopted)
    return Found(base, model, tuple(adopted), tuple(tried), tuple(remainder), tuple(first_curves))


def _goes_on(adopted: list[Adopted], best: "_Choice", remainder: list[Curve]) -> bool:
    """Whether an effect is worth adding though some signal explains more: not as the first, for it might be wrong."""
    return bool(adopted) and best.gain > FLEXIBLE_NATS and best.gain > WORTH_ADDING * remainder[0].gain


def _look(model: Fit, taken: set[str], seed: int) -> _Round:
    nominal = model.drives.robot.figures
    leads = screen(model, candidates(nominal, model.theta, taken), seed)
    fits = _refit(model, _worth_fitting(leads), {})
    random = () if taken & set(RANDOM_EFFECTS) else _random(model, seed)
    found = curves(model)
    best = max((gain for _, _, gain in fits.values()), default=0.0)
    if found and _leads(found[0], best):
        others = [lead for lead in leads if lead.candidate.effect in found[0].group.effects]
        fits |= _refit(model, others, fits)
    return _Round(leads, fits, random, found)


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
        if label not in done and lead.gain > max(LEAST_GAIN, WORTH_FITTING * best):
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


class _Choice(NamedTuple):
    gain: float
    lead: Lead | None
    fitted: Fit | None
    random: RandomEffect | None


def _best(model: Fit, looked: _Round, least: float) -> _Choice | None:
    """The effect with most evidence, if that is more than chance and predicts no worse."""
    named = [
        _Choice(gain, lead, fitted, None) for lead, fitted, gain in looked.fits.values() if lead.p_value <= P_VALUE
    ]
    clear = [effect for effect in looked.random if effect.p_value <= P_VALUE and effect.gain >= CLEAR_GAIN]
    chancy = [_Choice(effect.gain, None, None, effect) for effect in clear]
    ranked = sorted(named + chancy, key=lambda choice: -choice.gain)
    enough = (choice for choice in ranked if choice.gain >= least)
    best = next((choice for choice in enough if choice.fitted is None or _no_worse(choice.fitted, model)), None)
    if best is None:
        return None
    plain = [choice for choice in named if _is_plain_form_of(choice, best)]
    return plain[0] if plain else best


def _is_plain_form_of(choice: _Choice, best: _Choice) -> bool:
    """Whether it says the same of both wheels what the best says of one, at little loss."""
    if choice.lead is None or best.lead is None or choice is best or choice.lead.candidate.form:
        return False
    same = choice.lead.candidate.effect == best.lead.candidate.effect
    return same and choice.gain > PLAIN_SHARE * best.gain


def _leads(curve: Curve, gain: float) -> bool:
    return curve.gain > FLEXIBLE_LEAD * gain and curve.gain > gain + FLEXIBLE_NATS


def _unnamed(looked: _Round, gain: float) -> list[Curve]:
    """Curves over signals that say clearly more than any named effect."""
    return [curve for curve in looked.curves if _leads(curve, gain)]


def _tried(looked: _Round) -> list[Tried]:
    fitted = {label: gain for label, (_, _, gain) in looked.fits.items()}
    named = [
        Tried(lead.candidate.effect, lead.candidate.form, fitted.get(lead.candidate.label, lead.held_out), lead.p_value)
        for lead in looked.leads
    ]
    chancy = [Tried(effect.effect, "", effect.gain, effect.p_value) for effect in looked.random]
    return sorted(named + chancy, key=lambda tried: -tried.gain)


def _adopt(model: Fit, adopted: list[Adopted], best: _Choice, looked: _Round) -> tuple[Fit, list[Adopted]]:
    if best.random is not None:
        return _adopt_random(model, adopted, best.random, looked)
    assert best.lead is not None
    assert best.fitted is not None
    candidate = best.lead.candidate
    names = tuple(dict.fromkeys([name for names in candidate.free for name in names] + list(candidate.fixed)))
    rivals = _rivals(best.lead, best.fitted, best.gain, looked)
    new = Adopted(candidate.effect, candidate.form, names, candidate.free, best.gain, best.lead.p_value, rivals)
    return best.fitted, [*adopted, new]


def _adopt_random(
    model: Fit, adopted: list[Adopted], effect: RandomEffect, looked: _Round
) -> tuple[Fit, list[Adopted]]:
    """Add an effect that draws; its mean lateness has so far passed for a part of the delay."""
    theta = {**model.theta, effect.parameter: effect.value}
    late = lateness(theta, model.drives.rate_hz) - lateness(model.theta, model.drives.rate_hz)
    theta["delay"] = max(0.0, model.theta["delay"] - late)
    fitted = fit(model.drives, theta, model.free, model.noise)
    least = min(effect.gain - NATS_APART, RIVAL_SHARE * effect.gain)
    close = [other for other in looked.random if other is not effect and other.gain > least]
    rivals = tuple(Candidate(other.effect, "", ((other.parameter,),), {}, (0.0,), ((other.value,),)) for other in close)
    new = Adopted(
        effect.effect, "", (effect.parameter,), (), effect.gain, effect.p_value, rivals, interval=effect.interval
    )
    return fitted, [*adopted, new]


def _rivals(best: Lead, chosen: Fit, gain: float, looked: _Round) -> tuple[Candidate, ...]:
    found: dict[str, Candidate] = {}
    for lead in looked.leads:
        other = looked.fits.get(lead.candidate.label)
        close = other is not None and (other[2] > gain - NATS_APART or _as_good(other, gain, chosen))
        if lead.candidate.effect != best.candidate.effect and (close or _cosine(lead, best) > COSINE_APART):
            found.setdefault(lead.candidate.effect, lead.candidate)
    return tuple(found.values())


def _as_good(other: tuple[Lead, Fit, float], gain: float, chosen: Fit) -> bool:
    """Whether it has most of the evidence and predicts no worse, block by block."""
    return other[2] >= RIVAL_SHARE * gain and _no_worse(other[1], chosen)


def _no_worse(one: Fit, other: Fit) -> bool:
    """Whether one model's error over windows is not shown to be larger than the other's by more than ERROR_FACTOR."""
    windows = cut(other.drives, ERROR_HORIZON_S)
    if len(windows.begin) < 2:
        return True
    squares = [strays(fitted.drives, fitted.theta, windows)[:, 0] ** 2 for fitted in (one, other)]
    blocks = other.drives.block[windows.begin][windows.window]
    return ratio(squares[0], squares[1], blocks).interval[0] <= ERROR_FACTOR


def _cosine(one: Lead, other: Lead) -> float:
    size = float(np.linalg.norm(one.column) * np.linalg.norm(other.column))
    return float(one.column @ other.column) / size if size > 0.0 else 0.0


def _backward(model: Fit, adopted: list[Adopted]) -> tuple[Fit, list[Adopted]]:
    """Drop what no longer pays beside the effect adopted last."""
    for effect in adopted[:-1]:
        if effect.free and len(adopted) > 1:
            without = _dropped(model, effect)
            if float(predictive(model).sum() - predictive(without).sum()) < LEAST_GAIN:
                return without, [other for other in adopted if other is not effect]
    return model, adopted


def _dropped(model: Fit, effect: Adopted) -> Fit:
    theta = {name: value for name, value in model.theta.items() if name not in effect.names}
    free = tuple(coordinate for coordinate in model.free if coordinate not in effect.free)
    return fit(model.drives, theta, free, model.noise)
