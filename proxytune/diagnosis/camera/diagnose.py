"""The diagnosis of a robot's camera: tuned, tested, its missing effects named, and the error before and after.

`diagnose_camera` goes through all of it: frames to edges, a fit with every effect, the fewest effects that do as
well, their size on frames kept aside, and how the pictures look. `conclude` gives the verdict, and `describe_map`
how the map was laid, as the fit has it.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from proxytune.arrays import one_thread
from proxytune.diagnosis.answer import Estimate, Progress, verdict
from proxytune.diagnosis.camera import error, selection
from proxytune.diagnosis.camera.appearance import Appearance, changes, look_at
from proxytune.diagnosis.camera.edges import DISTORTION, MOVING, READOUT, Gathered, effects_of, gather_views
from proxytune.diagnosis.camera.fitting import CameraFit
from proxytune.diagnosis.stages import Stages, facts_of
from proxytune.driving import LINES, Robot
from proxytune.effects import PARAMETERS, SHIPPED, Catalogue, Stage, effect_of
from proxytune.errors import LogError
from proxytune.logs import Log

SURE = 3.0
"""A line is told to lie beside its place from so many standard deviations on."""
WIDTHS = ("white lines", "yellow lines", "yellow dashes")


def describe_map(fit: CameraFit) -> error.LaidMap:
    """Describe how the map was laid, as the fit has it."""
    degrees = np.array((1.0, 1.0, np.degrees(1.0)))
    offsets = zip(("x_m", "y_m", "heading_deg"), fit.state.offset * degrees, fit.offset_sd * degrees, strict=True)
    offset = {name: error.estimate_of(value, sd, name.rpartition("_")[-1]) for name, value, sd in offsets}
    tape, lines = fit.views.tape, []
    first = tape.size - len(WIDTHS)
    widths = zip(WIDTHS, fit.state.tape[first:], fit.tape_sd[first:], strict=True)
    for stretch in range(tape.stretches):
        for number, name in enumerate(LINES):
            place = tape.shift(np.array(stretch), np.array(number))
            value, sd = float(fit.state.tape[place]), float(fit.tape_sd[place])
            if abs(value) > SURE * sd:
                lines.append(error.LaidLine(name, stretch, value, error.estimate_of(value, sd, "m").interval))
    lines.sort(key=lambda line: -abs(line.right_m))
    return error.LaidMap(offset, tuple(lines), {name: error.estimate_of(value, sd, "m") for name, value, sd in widths})


def conclude(
    gathered: Gathered,
    weighed: error.Weighed,
    look: Appearance,
    declared: Sequence[str],
    notes: Sequence[str],
    seed: int,
) -> error.CameraDiagnosis:
    """Give the verdict, with everything that it goes by."""
    named = weighed.named
    tuned = tuple(name for name, one in look.figures.items() if effect_of(name) in declared and one.identified)
    grey, on_look = _compare_look(gathered, named, look, declared, tuned, seed)
    effects = tuple(_told(weighed, effect) for effect in named.effects) + on_look
    fields = (selection.fit_residual_field(named.declared), selection.fit_residual_field(named.model))
    fitted = effects_of(named.model.names)
    unseen = [effect for effect in selection.hidden_effects(named.full, fitted) if effect not in fitted]
    dark = [name for name, figure in look.figures.items() if not figure.identified]
    changed = changes(look)
    hidden = effects_of(name for name in (*unseen, *dark) if effect_of(name) not in changed)
    readout = named.full.theta[READOUT]
    stated = readout > 0.0 and READOUT not in named.full.names
    theta = _estimates(named.model, (*declared, *named.effects))
    theta |= {READOUT: Estimate(readout, (readout, readout), PARAMETERS[READOUT].unit)} if stated else {}
    theta |= _figures(look, (*tuned, *(name for effect in on_look for name in effect.names)))
    added, optics = (name for effect in effects for name in effect.names if name in theta), gathered.views.optics
    at_ends = tuple(name for name in added if optics.at_end(name, theta[name].value))
    return error.CameraDiagnosis(
        verdict=verdict(is_explained(fields[1], look) and not at_ends, named=bool(effects)),
        declared=_estimates(named.declared, declared) | _figures(look, tuned),
        theta=theta,
        effects=effects,
        negligible=tuple(_told(weighed, effect) for effect in weighed.dropped),
        dropped=_estimates(weighed.with_dropped, weighed.dropped),
        candidates=named.alone,
        pixels=weighed.pixels,
        grey=grey,
        residual_fields=fields,
        blemishes=look.blemishes,
        could_not_be_seen=hidden,
        next_views=selection.next_views(hidden, repeated=look.grain.still_pairs > 0),
        laid=describe_map(named.model),
        matched=selection.matched_share(named.model),
        notes=tuple(notes),
        named=named,
        gathered=gathered,
        at_ends=at_ends,
    )


def is_explained(field: selection.ResidualField, look: Appearance) -> bool:
    """Tell whether nothing fixed to the camera is left over, and nothing covers the picture."""
    return not (field.significant or look.blemishes)


def _compare_look(
    gathered: Gathered,
    named: selection.CameraSelection,
    look: Appearance,
    declared: Sequence[str],
    tuned: Sequence[str],
    seed: int,
) -> tuple[error.Comparison, tuple[error.CameraEffect, ...]]:
    """Brightness before and after, and the effects added for how pictures look, if the error without is larger."""
    changed = tuple(effect for effect in changes(look) if effect not in declared)
    looks = (look_values(look, tuned), look_values(look, (*tuned, *_names(look, changed))))
    grey, ratios = error.compare_brightness(gathered, named, looks, seed)
    texture = () if look.grain.noise.identified else ("texture of the floor",)
    added = []
    for effect in changed:
        if effect != "exposure" or ratios[effect] >= error.MATERIAL:
            size, rivals = (None, texture) if effect == "image_noise" else (ratios[effect], ())
            added.append(error.CameraEffect(effect, _names(look, (effect,)), None, size, rivals))
    return grey, tuple(added)


def look_values(look: Appearance, names: Sequence[str]) -> dict[str, float]:
    """Values of the look's figures by name in θ, within their bounds."""
    return {name: PARAMETERS[name].clipped(look.figures[name].value) for name in names}


def _told(weighed: error.Weighed, effect: str) -> error.CameraEffect:
    named = weighed.named
    names = tuple(name for name in named.full.names if effect_of(name) == effect)
    others = {one for rivals in named.rivals for one in rivals} - set(named.effects)
    always = (selection.ALWAYS[effect],) if effect in selection.ALWAYS else ()
    return error.CameraEffect(effect, names, weighed.nats[effect], weighed.ratios[effect], (*always, *sorted(others)))


def _names(look: Appearance, effects: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for effect in effects for name in look.figures if effect_of(name) == effect)


def _figures(look: Appearance, names: Sequence[str]) -> dict[str, Estimate]:
    values = look_values(look, names)
    return {name: _within(name, Estimate(values[name], look.figures[name].interval, ""), SHIPPED) for name in names}


def _estimates(fit: CameraFit, effects: Sequence[str]) -> dict[str, Estimate]:
    catalogue = fit.views.optics.robot.catalogue
    return {
        name: _within(name, error.estimate_of(fit.theta[name], sd, ""), catalogue)
        for name, sd in zip(fit.names, fit.sd, strict=True)
        if effect_of(name) in effects
    }


def _within(name: str, one: Estimate, catalogue: Catalogue) -> Estimate:
    """An estimate in its parameter's unit, whose interval goes no farther than the parameter's range."""
    parameter, (low, high) = catalogue.parameters[name], one.interval
    return Estimate(one.value, (parameter.clipped(low), parameter.clipped(high)), parameter.unit)


def camera_effects(catalogue: Catalogue) -> tuple[str, ...]:
    """The effects on a camera and its pictures."""
    return tuple(name for name in catalogue.names if catalogue.effect(name).stage in (Stage.CAMERA, Stage.IMAGE))


def declared_camera_effects(robot: Robot) -> tuple[str, ...]:
    """The camera's effects that are declared by default: those of θ."""
    return tuple(name for name in robot.catalogue.declared if name in camera_effects(robot.catalogue))


@one_thread()
def diagnose_camera(
    log: Log,
    robot: Robot,
    declared: Sequence[str],
    *,
    seed: int = 1,
    report: Progress = lambda _: None,
    folder: Path | None = None,
) -> error.CameraDiagnosis:
    """Tune what is declared of a camera, find what is missing, and test both on frames kept aside, as `diagnose_log`.

    A LogError if frames show too few markings, or other poses than these; a SettingsError if the robot has no camera.
    """
    if log.frames is None:
        raise LogError(f"{log.name}: has no frames; add [camera] to log.toml")
    report("reading frames")
    gathered = gather_views(log, log.frames, robot)
    views, stated = gathered.views, replace(log.frames, paths=(), road="")
    seen = (gathered.pictures, views.tracks, views.markings.road, stated)
    facts = facts_of(robot, seen, declared, seed) if folder else ""
    keep = Stages(folder, facts, report, robot=robot, gathered=gathered, **vars(views)).keep
    report("fitting the camera")
    fixed = {} if stated.readout_s is None else {READOUT: stated.readout_s}
    names = [name for name in views.optics.mounting if not (stated.rectified and name == DISTORTION)]
    names += [name for name in MOVING if views.tracks.moving and name not in fixed]
    unknown = stated.position_m is None or stated.heading_deg is None
    full = keep("everything", lambda: selection.fit_everything(views, names, fixed, learn_scatter=unknown))
    notes = keep("match", lambda: selection.check_match(log.name, full, grey=gathered.grey))
    report("looking for what the camera lacks")
    own = [effect for effect in declared if effect in effects_of(names)]
    named = keep("named", lambda: selection.select_camera_effects(full, own))
    report("testing on frames kept aside")
    weighed = keep("weighed", lambda: error.weigh_effects(named, seed))
    report("looking at brightness and sharpness")
    look = keep("look", lambda: look_at(gathered, weighed.named.model))
    every = (*gathered.notes, *notes)
    return keep("concluded", lambda: conclude(gathered, weighed, look, tuple(declared), every, seed))
