"""What each effect on where things are in the picture is worth; those of no matter leave the model."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from proxytune.diagnosis.camera.error.comparing import compare_displacement
from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.optics import effects_of
from proxytune.diagnosis.camera.naming.search import Named, cost_of, fit_set
from proxytune.diagnosis.camera.result import Comparison

MATERIAL = 1.03
"""An effect matters if the error on unseen frames is larger by this factor without it."""


@dataclass(frozen=True)
class Weighed:
    """A camera with those effects alone that matter.

    Attributes:
        named: The fits; the model's without what was dropped.
        with_dropped: The model as it was named, with what was dropped.
        pixels: Errors on unseen frames, before and after.
        ratios: Error without each effect over the error with all that were named, the dropped ones too.
        nats: What leaving each of these out costs.
        dropped: Effects that there is evidence for, and which hardly change the error.
    """

    named: Named
    with_dropped: CameraFit
    pixels: Comparison
    ratios: Mapping[str, float]
    nats: Mapping[str, float]
    dropped: tuple[str, ...]


def weigh_effects(named: Named, seed: int) -> Weighed:
    """Weigh every effect that was named, and fit the camera again without those of no matter."""
    pixels, ratios = compare_displacement(named, seed)
    dropped = tuple(effect for effect in named.effects if ratios[effect] < MATERIAL)
    nats = {effect: _cost_without(named, effect) for effect in named.effects}
    if not dropped:
        return Weighed(named, named.model, pixels, ratios, nats, ())
    kept = tuple(effect for effect in named.effects if effect not in dropped)
    declared = effects_of(named.declared.names)
    left = replace(named, model=fit_set(named.full, (*declared, *kept)), effects=kept)
    return Weighed(left, named.model, compare_displacement(left, seed)[0], ratios, nats, dropped)


def _cost_without(named: Named, effect: str) -> float:
    kept = [one for one in effects_of(named.model.names) if one != effect]
    return cost_of(fit_set(named.full, kept)) - cost_of(named.model)
