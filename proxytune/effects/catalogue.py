"""Every effect by name, in the order in which the signal meets them, and effects from values of θ.

A user's own effect and a plug-in's come through `outside_effect`, which refuses whatever is not what an effect must be;
`problems` tries it on a short signal. Whoever wants effects of θ asks a `Catalogue`, which knows whose folder counts.
"""

import inspect
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from proxytune.effects import camera, cars, command, friction, image, motion, motors
from proxytune.effects.effect import (
    CHANNELS,
    MOTIONS,
    SIGNALS,
    Cue,
    Effect,
    FilterContext,
    Means,
    Stage,
    Trace,
    WheelCurve,
)
from proxytune.effects.learnt import is_learnt, learnt_effect
from proxytune.errors import ExtensionError, SettingsError
from proxytune.extensions import describe, load, plugins
from proxytune.settings import nearest
from proxytune.space import Parameter, Theta

MEMBERS = ("name", "stage", "parameters", "trace", "begin", "apply")
"""What every effect has; see proxytune.effects.Effect."""
TICKS, RATE_HZ = 8, 20.0


@lru_cache
def outside_effect(name: str, folder: Path | None) -> type[Effect]:
    """The class of an effect that is not shipped: `module:Attribute`, or a plug-in's name; refused if it is none."""
    kind = load(name, kind="effect", beside=folder, needs=MEMBERS)
    for problem in problems(kind):
        raise ExtensionError(f"effect '{name}' {problem}")
    if kind.trace is not None and kind.trace.draws is not None:
        remedy = "leave draws out of its trace"
        raise ExtensionError(f"effect '{name}' draws at random, which only shipped ones may in a diagnosis; {remedy}")
    return cast(type[Effect], kind)


def problems(kind: Any) -> Iterator[str]:
    """Problems of an effect that has all MEMBERS, the first thing first.

    Take the first alone: what follows supposes that nothing before is wrong.
    """
    if not inspect.isclass(kind):
        yield f"is a {type(kind).__name__}; name its class"
    if not isinstance(kind.stage, Stage):
        yield f"has the stage {kind.stage!r}; take one of {', '.join(map(str, Stage.__members__.values()))} of Stage"
    given = kind.parameters
    if not isinstance(given, tuple) or not given or not all(isinstance(one, Parameter) for one in given):
        yield f"has the parameters {given!r}; give a tuple of at least one Parameter"
    for parameter in given:
        yield from _wrong_parameter(parameter)
    yield from _wrong_trace(kind)
    names = [parameter.name for parameter in given]
    own = [field.name for field in fields(kind) if field.init] if is_dataclass(kind) else names
    if own != names:
        yield f"has the fields {', '.join(own) or 'none'}; its parameters are {', '.join(names)}: the same, in order"
    if kind.stage is not Stage.IMAGE:
        yield from _wrong_filter(kind)


def _wrong_parameter(parameter: Parameter) -> Iterator[str]:
    name, low, high, neutral = parameter.name, parameter.low, parameter.high, parameter.neutral
    if not (np.isfinite([low, high]).all() and low < high):
        yield f"has a parameter '{name}' from {low} to {high}; give a finite range, the lower end first"
    first, last = parameter.usual_range
    if not low <= first < last <= high:
        usual = f"the usual range [{first}, {last}]"
        yield f"has a parameter '{name}' with {usual}, which is not within [{low:g}, {high:g}]; widen that"
    if not isinstance(neutral, str) and not low <= neutral <= high:
        yield f"has a parameter '{name}' whose neutral value {neutral} is not within [{low:g}, {high:g}]; widen that"
    if beyond := [probe for probe in parameter.probes if not low <= probe <= high]:
        yield f"has a parameter '{name}' with a probe {beyond[0]} that is not within [{low:g}, {high:g}]; move it"


def _wrong_trace(kind: Any) -> Iterator[str]:
    trace = kind.trace
    if not isinstance(trace, Trace | None):
        yield f"has the trace {trace!r}; give a Trace, or None where measured motion cannot show it"
    if trace is None:
        return
    if not trace.cues or not all(isinstance(cue, Cue) for cue in trace.cues):
        yield f"has a trace with the cues {trace.cues!r}; give a tuple of at least one Cue"
    if not kind.parameters[0].probes:
        yield f"has a trace, but '{kind.parameters[0].name}' has no probes, from which a search sets out; add them"
    known = [parameter.name for parameter in kind.parameters]
    for form in trace.forms:
        free = {name for coordinate in form.free for name in coordinate}
        if unknown := sorted((free | set(form.fixed) | set(form.moved)) - set(known)):
            yield f"has a form with the parameter '{unknown[0]}'; its parameters are {', '.join(known)}"
    for shown in (trace.shown, *(form.shown for form in trace.forms if form.shown is not None)):
        yield from _wrong_figure(shown)


def _wrong_figure(shown: Any) -> Iterator[str]:
    """Reasons why no figure of the effect could be drawn."""
    if not isinstance(shown, WheelCurve | Means):
        yield f"is to be shown by {shown!r}; give its trace a WheelCurve, or Means with panels"
    if not isinstance(shown, Means):
        return
    if not isinstance(shown.cue, Cue) or not shown.panels:
        yield f"is shown by {shown!r}; Means take a Cue and at least one Panel"
    for panel in shown.panels:
        if panel.motion not in MOTIONS:
            yield f"has a panel of the motion '{panel.motion}'; take one of {', '.join(MOTIONS)}"
        if panel.signal not in SIGNALS:
            yield f"has a panel of the signal '{panel.signal}'; leave it empty, or take one of {', '.join(SIGNALS[1:])}"


def _wrong_filter(kind: Any) -> Iterator[str]:
    """Try it on a short signal, in the middle of its range, at both ends, and where it is to change nothing."""
    tried = [[one.low + share * (one.high - one.low) for one in kind.parameters] for share in (0.5, 0.0, 1.0)]
    neutral = [one.neutral for one in kind.parameters]
    signal, nominal = _signal(kind.stage), defaultdict[str, float](lambda: 1.0)
    for values in (*tried, neutral):
        if any(isinstance(value, str) for value in values):
            continue
        try:
            effect = kind(*values)
            answer = effect.apply(signal, effect.begin(FilterContext(RATE_HZ, signal[:, 0], nominal)))
        except Exception as problem:
            yield f"raised {describe(problem)} at {values}; correct its begin and apply"
            return
        if not (isinstance(answer, tuple) and len(answer) == 2 and isinstance(answer[0], np.ndarray)):
            yield f"answers with {type(answer).__name__}; apply must give a tuple: the signal and its memory"
            return
        if answer[0].shape != signal.shape or not np.isfinite(answer[0]).all():
            yield f"makes a signal {answer[0].shape} of {signal.shape} at {values}; it must keep the shape, all finite"
            return
    if not any(isinstance(value, str) for value in neutral) and not np.allclose(answer[0], signal):
        yield f"changes the signal at its neutral value {neutral}; it must vanish there"


def _signal(stage: Stage) -> Any:
    """Something that the stage could meet (1, ticks, channels)."""
    channels = len(CHANNELS[stage])
    if stage is Stage.CAMERA:
        level = {"pitch_deg": 1.0, "height_m": 1.0, "field_of_view_deg": 1.0, "aspect": 1.0}
        return np.tile([level.get(name, 0.0) for name in CHANNELS[stage]], (1, TICKS, 1))
    return np.sin(np.arange(TICKS * channels, dtype=float)).reshape(1, TICKS, channels)


_TRACKER_AND_CAMERA: tuple[type[Effect], ...] = (
    motion.MarkerOffset, motion.HeadingOffset,
    camera.CameraPitch, camera.CameraRoll, camera.CameraYaw, camera.CameraHeight, camera.CameraForward,
    camera.FieldOfView, camera.LensDistortion, camera.LensCentre, camera.PixelAspect,
    # Mixtures of pictures commute; blur is exact on 8-bit pictures alone, so it comes first
    image.Blur, image.RollingShutter, image.CameraLatency,
    image.Defocus, image.Vignetting, image.Exposure, image.ImageNoise,
)  # fmt: skip

_ALL: tuple[type[Effect], ...] = (
    command.DelayJitter, command.DroppedCommands, command.CommandQuantisation, command.ReversalPause, command.Delay,
    motors.SlewRate, motors.DriverMap, friction.DeadBand, friction.Stiction, motors.Saturation,
    motors.Trim, motors.WheelGain, motors.BatterySag, motors.ThermalFade, motors.MotorLag, friction.Backlash,
    friction.WheelRipple, motion.YawScrub, motion.Understeer, motion.YawLag, motion.Inertia,
    motion.TurnSlip, motion.LateralSlip, motion.CrossCoupling, motion.FloorSlope, motion.SlipperyPatch,
    *_TRACKER_AND_CAMERA,
)  # fmt: skip

# What bends the angle of the wheels goes before what is lost by it, and the mass comes last
_OF_CARS: tuple[type[Effect], ...] = (
    command.DelayJitter, command.DroppedCommands, cars.QUANTISATION, cars.PAUSE, command.Delay, *cars.STEERED_COMMANDS,
    *cars.STEERED, cars.SteeringBacklash, cars.SteeringOffset, cars.SteeringCurve,
    *cars.THROTTLED, cars.SteeringFriction, cars.Rolling,
    cars.Tyres, motion.YawLag, motion.TurnSlip, motion.FloorSlope, motion.SlipperyPatch,
    *_TRACKER_AND_CAMERA,
)  # fmt: skip

CATALOGUE: Mapping[str, type[Effect]] = MappingProxyType({effect.name: effect for effect in _ALL})

CAR_CATALOGUE: Mapping[str, type[Effect]] = MappingProxyType({effect.name: effect for effect in _OF_CARS})

DRIVES: Mapping[str, Mapping[str, type[Effect]]] = MappingProxyType(
    {"differential": CATALOGUE, "ackermann": CAR_CATALOGUE}
)
"""The shipped effects of robots by how they drive: with two wheels of their own speed, or with wheels that steer."""
DECLARED: tuple[str, ...] = ("trim", "delay", "blur", "camera_pitch")
"""The effects that a domain family has before anything is found to be missing: θ of the paper."""
DECLARED_OF_CARS: tuple[str, ...] = ("steering_offset", "delay", "blur", "camera_pitch")
"""The same of a car, whose trim is its steering's."""


def theta_names(effect: type[Effect], name: str = "") -> tuple[str, ...]:
    """The names in θ of an effect's parameters: its own or another name, with `.parameter` where there are several."""
    called = name or effect.name
    if len(effect.parameters) == 1:
        return (called,)
    return tuple(f"{called}.{parameter.name}" for parameter in effect.parameters)


def effect_of(theta_name: str) -> str:
    """The name of the effect that a parameter of θ belongs to; that of a user's own may have points in its module."""
    module, colon, rest = theta_name.rpartition(":")
    return module + colon + rest.split(".")[0]


_NAMED: Mapping[str, Mapping[type[Effect], tuple[str, ...]]] = {
    drive: {effect: theta_names(effect) for effect in effects.values()} for drive, effects in DRIVES.items()
}

_PARAMETERS: Mapping[str, Mapping[str, Parameter]] = {
    drive: {
        name: parameter
        for effect, names in effects.items()
        for name, parameter in zip(names, effect.parameters, strict=True)
    }
    for drive, effects in _NAMED.items()
}

PARAMETERS: Mapping[str, Parameter] = MappingProxyType(_PARAMETERS["differential"])
"""Parameters of the shipped effects of a robot on two wheels by their names in θ."""


@dataclass(frozen=True)
class Catalogue:
    """The effects that a domain may have, by name: those shipped, those of plug-ins, and a user's own.

    A user's own is called `module:Attribute`, and its parameters in θ `module:Attribute` where it has one, else
    `module:Attribute.parameter`. Whatever is not shipped comes after the shipped effects of its stage, by name.
    """

    folder: Path | None = None  # whose modules come before the installed ones; None for the installed ones alone
    own: tuple[str, ...] = ()  # effects that a diagnosis is to try beside the shipped ones and plug-ins
    drive: str = "differential"  # how the robot drives, one of DRIVES: which effects are shipped for it

    @property
    def shipped(self) -> Mapping[str, type[Effect]]:
        """The shipped effects of such a robot by name."""
        return DRIVES[self.drive]

    @property
    def declared(self) -> tuple[str, ...]:
        """The effects that a domain family of it has before anything is found to be missing."""
        return DECLARED if self.drive == "differential" else DECLARED_OF_CARS

    @property
    def names(self) -> tuple[str, ...]:
        """The effects to choose from: those shipped in the order in which the signal meets them, plug-ins, `own`."""
        known = {name for effects in DRIVES.values() for name in effects}
        return tuple(dict.fromkeys((*self.shipped, *plugins("effect", known), *self.own)))

    @property
    def parameters(self) -> "Parameters":
        """Every effect's parameters by their names in θ."""
        return Parameters(self)

    def effect(self, name: str) -> type[Effect]:
        """The effect of this name; refused if there is none, or it is not what an effect must be."""
        return self.shipped[name] if name in self.shipped else outside_effect(name, self.folder)

    def theta_names(self, name: str) -> tuple[str, ...]:
        """The names in θ of an effect's parameters."""
        return theta_names(self.effect(name), name)

    def knows(self, name: str) -> bool:
        """Tell whether an effect of this name is shipped, a plug-in, or written as a user's own is."""
        return ":" in name or name in self.names


@dataclass(frozen=True)
class Parameters(Mapping[str, Parameter]):
    """The parameters of a catalogue by their names in θ; a user's own effects answer where asked for by name."""

    catalogue: Catalogue

    def __getitem__(self, name: str) -> Parameter:
        shipped = _PARAMETERS[self.catalogue.drive]
        if name in shipped:
            return shipped[name]
        effect = effect_of(name)
        if not self.catalogue.knows(effect):
            raise KeyError(name)
        names = self.catalogue.theta_names(effect)
        return dict(zip(names, self.catalogue.effect(effect).parameters, strict=True))[name]

    def __iter__(self) -> Iterator[str]:
        return (name for effect in self.catalogue.names for name in self.catalogue.theta_names(effect))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def parameter_hint(name: str, known: Mapping[str, Parameter]) -> str:
    """A hint that ends an error line on an effect or a parameter that is none of those known."""
    effect = effect_of(name)
    if isinstance(known, Parameters) and effect not in known.catalogue.shipped:
        others = [drive for drive, effects in DRIVES.items() if effect in effects]
        if others:
            return f'only a robot with drive = "{others[0]}" has it, this one is "{known.catalogue.drive}"'
    return nearest(name, known)


SHIPPED = Catalogue()
"""What can be named without a folder of one's own."""


def effects_from(theta: Theta, nominal: Mapping[str, float], catalogue: Catalogue = SHIPPED) -> tuple[Effect, ...]:
    """The effects that θ names, in the catalogue's order; parameters of theirs that it leaves out are neutral.

    What was learnt comes last: it looks at commands, and at the motion, as all named effects make them.

    Raises:
        SettingsError: If a name is not a parameter of the catalogue, its value is out of bounds, or it is left out and
            the robot does not state the figure that it replaces.
        ExtensionError: If a user's own effect cannot be used.
    """
    for name, value in theta.items():
        if not is_learnt(name):
            _check(name, value, catalogue)
    shipped = _NAMED[catalogue.drive]
    outside = {effect_of(name) for name in theta if name not in _PARAMETERS[catalogue.drive] and not is_learnt(name)}
    named = [(catalogue.effect(name), catalogue.theta_names(name)) for name in sorted(outside)]
    chosen: list[Effect] = []
    for effect, names in (*shipped.items(), *named):
        if not theta.keys().isdisjoint(names):
            pairs = zip(names, effect.parameters, strict=True)
            chosen.append(effect(*(_value(name, parameter, theta, nominal) for name, parameter in pairs)))
    learnt = learnt_effect(theta)
    return tuple(chosen) if learnt is None else (*chosen, *learnt.parts)


def _value(name: str, parameter: Parameter, theta: Theta, nominal: Mapping[str, float]) -> float:
    """What θ says of a parameter, or its neutral value."""
    if name in theta:
        return float(theta[name])
    try:
        return float(parameter.neutral_value(nominal))
    except KeyError:
        raise SettingsError(f"{name}: the robot states no {parameter.neutral}; state this parameter too") from None


def _check(name: str, value: float, catalogue: Catalogue) -> None:
    parameters = catalogue.parameters
    if name not in parameters:
        raise SettingsError(f"{name}: no effect has this parameter; {parameter_hint(name, parameters)}")
    parameter = parameters[name]
    if not parameter.low <= value <= parameter.high:
        bounds = f"{parameter.low:g} and {parameter.high:g} {parameter.unit}"
        raise SettingsError(f"{name}: must be between {bounds}, got {value}")
