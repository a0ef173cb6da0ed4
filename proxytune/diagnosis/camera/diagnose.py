"""From a log's frames to a verdict on the camera: tuned, tested, named, and the error before and after."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from proxytune.diagnosis.camera.error.comparing import compare_brightness, compare_displacement
from proxytune.diagnosis.camera.gathering import Gathered, gather_views
from proxytune.diagnosis.camera.laying import TWO_SIDED, describe_map
from proxytune.diagnosis.camera.look.appearance import Appearance, changes, look_at
from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.optics import DISTORTION, MOVING, READOUT, effects_of
from proxytune.diagnosis.camera.naming.checks import check_match, matched_share
from proxytune.diagnosis.camera.naming.gate import Leftover, find_leftover
from proxytune.diagnosis.camera.naming.search import Named, fit_everything, name_camera_effects
from proxytune.diagnosis.camera.naming.visibility import ALWAYS, hidden_effects, next_views
from proxytune.diagnosis.camera.result import CameraDiagnosis, CameraEffect
from proxytune.diagnosis.result import Estimate
from proxytune.driving.robot import Robot
from proxytune.effects import DECLARED, Catalogue, Stage, effect_of
from proxytune.errors import LogError
from proxytune.logs import Frames, Log

Report = Callable[[str], None]

MATERIAL = 1.03
"""An effect matters if the error without it is larger by this factor."""


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
    report("looking at brightness and sharpness")
    look = look_at(gathered, named.model)
    report("testing on frames kept aside")
    return _conclude(_Found(gathered, named, look, tuple(declared)), notes, seed)


@dataclass(frozen=True)
class _Found:
    """What the steps of a diagnosis came to."""

    gathered: Gathered
    named: Named
    look: Appearance
    declared: tuple[str, ...]


def _parameters(gathered: Gathered, frames: Frames) -> tuple[tuple[str, ...], Mapping[str, float]]:
    """Parameters of the camera that may differ from neutral, and values that the log states."""
    views = gathered.views
    names = [name for name in views.optics.mounting if not (frames.rectified and name == DISTORTION)]
    fixed = {} if frames.readout_s is None else {READOUT: frames.readout_s}
    names += [name for name in MOVING if views.tracks.moving and name not in fixed]
    return tuple(names), fixed


def _conclude(found: _Found, notes: tuple[str, ...], seed: int) -> CameraDiagnosis:
    named, look = found.named, found.look
    pixels, ratios = compare_displacement(named, seed)
    added = tuple(effect for effect in changes(look) if effect not in found.declared)
    before = _values(look, _tuned(look, found.declared))
    grey = compare_brightness(found.gathered, named, (before, before | _values(look, _names(look, added))), seed)
    geometric = [_geometric(named, effect, ratios[effect]) for effect in named.effects]
    effects = [effect for effect in geometric if effect.error_without >= MATERIAL]
    brighter = grey.before.value / max(grey.after.value, 1e-9)
    effects += [CameraEffect(effect, _names(look, [effect]), None, brighter, ()) for effect in added]
    gates = (find_leftover(named.declared), find_leftover(named.model))
    hidden, model = _hidden(found), (*found.declared, *(effect.effect for effect in effects))
    return CameraDiagnosis(
        verdict=_verdict(gates[1], look, named=bool(effects)),
        declared=_estimates(named.declared, found.declared) | _figures(look, _tuned(look, found.declared)),
        theta=_estimates(named.model, model) | _figures(look, (*_tuned(look, found.declared), *_names(look, added))),
        effects=tuple(effects),
        immaterial=tuple(effect for effect in geometric if effect.error_without < MATERIAL),
        candidates=named.alone,
        pixels=pixels,
        grey=grey,
        gates=gates,
        blemishes=look.blemishes,
        could_not_be_seen=hidden,
        next_views=next_views(hidden, repeated=look.grain.still_pairs > 0),
        laid=describe_map(named.model),
        matched=matched_share(named.model),
        notes=notes,
        named=named,
        gathered=found.gathered,
    )


def _geometric(named: Named, effect: str, ratio: float) -> CameraEffect:
    names = tuple(name for name in named.full.names if effect_of(name) == effect)
    loss = next(one.loss for one in named.losses if effect not in one.effects)
    others = {one for rivals in named.rivals for one in rivals} - set(named.effects)
    always = (ALWAYS[effect],) if effect in ALWAYS else ()
    return CameraEffect(effect, names, loss, ratio, (*always, *sorted(others)))


def _names(look: Appearance, effects: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in look.figures if effect_of(name) in effects)


def _tuned(look: Appearance, declared: Sequence[str]) -> tuple[str, ...]:
    """Declared figures of the pictures' look that these frames can tell."""
    return tuple(name for name, one in look.figures.items() if effect_of(name) in declared and one.identified)


def _values(look: Appearance, names: Sequence[str]) -> dict[str, float]:
    return {name: look.figures[name].value for name in names}


def _figures(look: Appearance, names: Sequence[str]) -> dict[str, Estimate]:
    units = {"blur": "s", "image_noise": "grey level"}
    return {
        name: Estimate(look.figures[name].value, look.figures[name].interval, units.get(name, "")) for name in names
    }


def _estimates(fit: CameraFit, effects: Sequence[str]) -> dict[str, Estimate]:
    """Values with their intervals, of the parameters that were free."""
    parameters = fit.views.optics.robot.catalogue.parameters
    known = {}
    for name, sd in zip(fit.names, fit.sd, strict=True):
        if effect_of(name) in effects:
            value = fit.theta[name]
            known[name] = Estimate(value, (value - TWO_SIDED * sd, value + TWO_SIDED * sd), parameters[name].unit)
    return known


def _hidden(found: _Found) -> tuple[str, ...]:
    """Effects that could not be seen, or that there were no means to."""
    fitted = effects_of(found.named.model.names)
    hidden = [effect for effect in hidden_effects(found.named.full, fitted) if effect not in fitted]
    dark = [name for name, figure in found.look.figures.items() if not figure.identified]
    return effects_of((*hidden, *dark))


def _verdict(gate: Leftover, look: Appearance, *, named: bool) -> str:
    if gate.open or look.blemishes:
        return "partly explained" if named else "unexplained"
    return "explained" if named else "nothing missing"
