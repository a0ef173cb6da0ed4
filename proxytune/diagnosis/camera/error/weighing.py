"""What each effect on where things are in the picture is worth; those of no matter leave the model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.error.comparing import compare_displacement, displacement_ratio
from proxytune.diagnosis.camera.error.unseen import unseen_residuals
from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.optics import effects_of
from proxytune.diagnosis.camera.naming.search import Named, cost_of, fit_set
from proxytune.diagnosis.camera.result import Comparison

Floats = NDArray[np.float64]

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


class _Tested(NamedTuple):
    """A fit with its residuals on frames that it is not made from (n,) [pixel]."""

    fit: CameraFit
    residuals: Floats


def weigh_effects(named: Named, seed: int) -> Weighed:
    """Weigh every effect that was named, and fit the camera again without those of no matter."""
    views, cost = named.full.views, cost_of(named.model)
    declared, model, full = (_test(fit) for fit in (named.declared, named.model, named.full))
    without = {effect: _test(_fit_without(named, (effect,))) for effect in named.effects}
    nats = {effect: cost_of(one.fit) - cost for effect, one in without.items()}
    pairs = {effect: (one.residuals, model.residuals) for effect, one in without.items()}
    ratios = {effect: displacement_ratio(views, pair, seed) for effect, pair in pairs.items()}
    dropped = tuple(effect for effect in named.effects if ratios[effect] < MATERIAL)
    kept = tuple(effect for effect in named.effects if effect not in dropped)
    if dropped:
        model = without[dropped[0]] if len(dropped) == 1 else _test(_fit_without(named, dropped))
    pixels = compare_displacement(views, (declared.residuals, model.residuals, full.residuals), seed)
    return Weighed(replace(named, model=model.fit, effects=kept), named.model, pixels, ratios, nats, dropped)


def _test(fit: CameraFit) -> _Tested:
    return _Tested(fit, unseen_residuals(fit.views, fit.state, fit.names))


def _fit_without(named: Named, effects: Sequence[str]) -> CameraFit:
    return fit_set(named.full, [one for one in effects_of(named.model.names) if one not in effects])
