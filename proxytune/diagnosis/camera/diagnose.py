"""From a log's frames to a verdict on the camera: tuned, tested, named, and the error before and after.

How a map was laid: what its lines and the whole of it are off, as a camera's fit has it.
What a camera's fits and the look of its pictures come to.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.diagnosis.answer import Estimate
from proxytune.diagnosis.camera.appearance import Appearance, changes, look_at
from proxytune.diagnosis.camera.edges import DISTORTION, MOVING, READOUT, Gathered, Tape, effects_of, gather_views
from proxytune.diagnosis.camera.error import (
    MATERIAL,
    CameraDiagnosis,
    CameraEffect,
    Comparison,
    LaidLine,
    LaidMap,
    Weighed,
    compare_brightness,
    estimate_of,
    interval_of,
    weigh_effects,
)
from proxytune.diagnosis.camera.fitting import CameraFit
from proxytune.diagnosis.camera.selection import (
    ALWAYS,
    Leftover,
    Named,
    check_match,
    find_leftover,
    fit_everything,
    hidden_effects,
    matched_share,
    name_camera_effects,
    next_views,
)
from proxytune.driving import LINES, Robot
from proxytune.effects import DECLARED, PARAMETERS, Catalogue, Stage, effect_of
from proxytune.errors import LogError
from proxytune.logs import Frames, Log

SURE = 3.0
"""A line is told to lie beside its place from so many standard deviations on."""

WIDTHS = ("white lines", "yellow lines", "yellow dashes")


def describe_map(fit: CameraFit) -> LaidMap:
    """What the fit says of the map."""
    degrees = np.array((1.0, 1.0, np.degrees(1.0)))
    offsets = zip(("x_m", "y_m", "heading_deg"), fit.state.offset * degrees, fit.offset_sd * degrees, strict=True)
    offset = {name: estimate_of(value, sd, name.rpartition("_")[-1]) for name, value, sd in offsets}
    stretches = fit.views.markings.stretches
    first = Tape(stretches).size - len(WIDTHS)
    widths = zip(WIDTHS, fit.state.tape[first:], fit.tape_sd[first:], strict=True)
    return LaidMap(offset, _lines(fit, stretches), {name: estimate_of(value, sd, "m") for name, value, sd in widths})


def _lines(fit: CameraFit, stretches: int) -> tuple[LaidLine, ...]:
    tape, lines = Tape(stretches), []
    for stretch in range(stretches):
        for number, name in enumerate(LINES):
            place = tape.shift(np.array(stretch), np.array(number))
            value, sd = float(fit.state.tape[place]), float(fit.tape_sd[place])
            if abs(value) > SURE * sd:
                lines.append(LaidLine(name, stretch, value, interval_of(value, sd)))
    return tuple(sorted(lines, key=lambda line: -abs(line.right_m)))


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


Report = Callable[[str], None]


def camera_effects(catalogue: Catalogue) -> tuple[str, ...]:
    """The effects on a camera and its pictures."""
    return tuple(name for name in catalogue.names if catalogue.effect(name).stage in (Stage.CAMERA, Stage.IMAGE))


def declared_camera_effects(robot: Robot) -> tuple[str, ...]:
    """The camera's effects that are declared by default: those of θ."""
    return tuple(name for name in DECLARED if name in camera_effects(robot.catalogue))


def diagnose_camera(
    log: Log, robot: Robot, declared: Sequence[str], *, seed: int = 1, report: Report = lambda _: None
) -> CameraDiagnosis:
    """Tune what is declared of a camera, find what is missing, and test both on frames kept aside.

    Args:
        log: With frames.
        robot: Whose camera took them.
        declared: Effects whose parameters are tuned in any case; those on motion are left alone.
        seed: Of the bootstrap.
        report: Takes a line about each step, as it begins.

    Raises:
        LogError: If the frames cannot bear the question: too few markings, or other poses than these.
        SettingsError: If the robot has no camera.
    """
    if log.frames is None:
        raise LogError(f"{log.name}: has no frames; add [camera] to log.toml")
    report("reading frames")
    gathered = gather_views(log, log.frames, robot)
    report("fitting the camera")
    names, fixed = _parameters(gathered, log.frames)
    unknown = log.frames.position_m is None or log.frames.heading_deg is None
    full = fit_everything(gathered.views, names, fixed, learn_scatter=unknown)
    notes = check_match(log.name, full)
    report("looking for what the camera lacks")
    named = name_camera_effects(full, [effect for effect in declared if effect in effects_of(names)])
    report("testing on frames kept aside")
    weighed = weigh_effects(named, seed)
    report("looking at brightness and sharpness")
    look = look_at(gathered, weighed.named.model)
    return conclude(Evidence(gathered, weighed, look, tuple(declared), (*gathered.notes, *notes)), seed)


def _parameters(gathered: Gathered, frames: Frames) -> tuple[tuple[str, ...], Mapping[str, float]]:
    """Parameters of the camera that may differ from neutral, and values that the log states."""
    views = gathered.views
    names = [name for name in views.optics.mounting if not (frames.rectified and name == DISTORTION)]
    fixed = {} if frames.readout_s is None else {READOUT: frames.readout_s}
    names += [name for name in MOVING if views.tracks.moving and name not in fixed]
    return tuple(names), fixed
