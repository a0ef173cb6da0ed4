"""What a camera's fits and the look of its pictures come to."""

from collections.abc import Sequence
from dataclasses import dataclass

from proxytune.diagnosis.camera.error.comparing import compare_brightness
from proxytune.diagnosis.camera.error.weighing import MATERIAL, Weighed
from proxytune.diagnosis.camera.gathering import Gathered
from proxytune.diagnosis.camera.laying import describe_map
from proxytune.diagnosis.camera.look.appearance import Appearance, changes
from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.optics import READOUT, effects_of
from proxytune.diagnosis.camera.naming.checks import matched_share
from proxytune.diagnosis.camera.naming.gate import Leftover, find_leftover
from proxytune.diagnosis.camera.naming.search import Named
from proxytune.diagnosis.camera.naming.visibility import ALWAYS, hidden_effects, next_views
from proxytune.diagnosis.camera.result import CameraDiagnosis, CameraEffect, Comparison, estimate_of
from proxytune.diagnosis.result import Estimate
from proxytune.effects import PARAMETERS, effect_of


@dataclass(frozen=True)
class Evidence:
    """All that a verdict goes by.

    Attributes:
        gathered: The frames.
        weighed: The camera's fits, and what each effect is worth.
        look: Brightness and sharpness of the pictures.
        declared: Effects that were tuned in any case.
        notes: What is to be said of how frames and poses match.
    """

    gathered: Gathered
    weighed: Weighed
    look: Appearance
    declared: tuple[str, ...]
    notes: tuple[str, ...]


def conclude(found: Evidence, seed: int) -> CameraDiagnosis:
    """Give the verdict, with everything that it goes by."""
    named, look = found.weighed.named, found.look
    tuned = tuple(name for name, one in look.figures.items() if effect_of(name) in found.declared and one.identified)
    grey, on_look = _compare_look(found, tuned, seed)
    effects = _geometric(found, named.effects) + on_look
    gates, hidden = (find_leftover(named.declared), find_leftover(named.model)), _hidden(found)
    return CameraDiagnosis(
        verdict=_verdict(gates[1], look, named=bool(effects)),
        declared=_estimates(named.declared, found.declared) | _figures(look, tuned),
        theta=_estimates(named.model, (*found.declared, *named.effects))
        | _stated(named)
        | _figures(look, (*tuned, *(name for effect in on_look for name in effect.names))),
        effects=effects,
        immaterial=_geometric(found, found.weighed.dropped),
        dropped=_estimates(found.weighed.with_dropped, found.weighed.dropped),
        candidates=named.alone,
        pixels=found.weighed.pixels,
        grey=grey,
        gates=gates,
        blemishes=look.blemishes,
        could_not_be_seen=hidden,
        next_views=next_views(hidden, repeated=look.grain.still_pairs > 0),
        laid=describe_map(named.model),
        matched=matched_share(named.model),
        notes=found.notes,
        named=named,
        gathered=found.gathered,
    )


def _compare_look(found: Evidence, tuned: Sequence[str], seed: int) -> tuple[Comparison, tuple[CameraEffect, ...]]:
    """Brightness before and after, and the effects that were added for how pictures look.

    Exposure is one of them where the error without it is larger.
    """
    look = found.look
    changed = tuple(effect for effect in changes(look) if effect not in found.declared)
    looks = (look_values(look, tuned), look_values(look, (*tuned, *_names(look, changed))))
    grey, ratios = compare_brightness(found.gathered, found.weighed.named, looks, seed)
    added = tuple(effect for effect in changed if effect != "exposure" or ratios[effect] >= MATERIAL)
    return grey, _on_look(look, added, ratios)


def look_values(look: Appearance, names: Sequence[str]) -> dict[str, float]:
    """Values of the look's figures by name in θ, within their bounds."""
    return {name: PARAMETERS[name].clipped(look.figures[name].value) for name in names}


def _geometric(found: Evidence, effects: Sequence[str]) -> tuple[CameraEffect, ...]:
    """Effects on where things are in the picture, as they are told."""
    return tuple(_told(found.weighed, effect) for effect in effects)


def _told(weighed: Weighed, effect: str) -> CameraEffect:
    named = weighed.named
    names = tuple(name for name in named.full.names if effect_of(name) == effect)
    others = {one for rivals in named.rivals for one in rivals} - set(named.effects)
    always = (ALWAYS[effect],) if effect in ALWAYS else ()
    return CameraEffect(effect, names, weighed.nats[effect], weighed.ratios[effect], (*always, *sorted(others)))


def _on_look(look: Appearance, added: Sequence[str], ratios: dict[str, float]) -> tuple[CameraEffect, ...]:
    """Effects on how pictures look; floors may look like noise."""
    texture = {} if look.grain.noise.identified else {"image_noise": ("texture of the floor",)}
    return tuple(
        CameraEffect(
            effect,
            _names(look, (effect,)),
            None,
            ratios[effect] if effect != "image_noise" else None,
            texture.get(effect, ()),
        )
        for effect in added
    )


def _names(look: Appearance, effects: Sequence[str]) -> tuple[str, ...]:
    """Their figures by name in θ, effect by effect."""
    return tuple(name for effect in effects for name in look.figures if effect_of(name) == effect)


def _stated(named: Named) -> dict[str, Estimate]:
    """What the log states of the camera: its readout."""
    value = named.full.theta[READOUT]
    known = value > 0.0 and READOUT not in named.full.names
    return {READOUT: Estimate(value, (value, value), PARAMETERS[READOUT].unit)} if known else {}


def _figures(look: Appearance, names: Sequence[str]) -> dict[str, Estimate]:
    values = look_values(look, names)
    return {name: Estimate(values[name], look.figures[name].interval, PARAMETERS[name].unit) for name in names}


def _estimates(fit: CameraFit, effects: Sequence[str]) -> dict[str, Estimate]:
    """Values with their intervals, of the parameters that were free."""
    parameters = fit.views.optics.robot.catalogue.parameters
    return {
        name: estimate_of(fit.theta[name], sd, parameters[name].unit)
        for name, sd in zip(fit.names, fit.sd, strict=True)
        if effect_of(name) in effects
    }


def _hidden(found: Evidence) -> tuple[str, ...]:
    """Effects that could not be seen, or that there were no means to."""
    named = found.weighed.named
    fitted = effects_of(named.model.names)
    hidden = [effect for effect in hidden_effects(named.full, fitted) if effect not in fitted]
    dark = [name for name, figure in found.look.figures.items() if not figure.identified]
    changed = changes(found.look)
    return effects_of(tuple(name for name in (*hidden, *dark) if effect_of(name) not in changed))


def _verdict(gate: Leftover, look: Appearance, *, named: bool) -> str:
    if gate.open or look.blemishes:
        return "partly explained" if named else "unexplained"
    return "explained" if named else "nothing missing"
