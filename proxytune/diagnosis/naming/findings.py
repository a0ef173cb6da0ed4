"""What a search for missing effects finds: effects tried, adopted and dropped, and the models with them."""

from dataclasses import dataclass
from typing import NamedTuple

from proxytune.diagnosis.model.coordinates import Coordinate
from proxytune.diagnosis.model.fitting import Fit
from proxytune.diagnosis.model.replay import lateness
from proxytune.diagnosis.naming.candidates import Candidate
from proxytune.diagnosis.naming.flexible import Curve
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
