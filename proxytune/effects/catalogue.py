"""Every effect there is, in the order in which the signal meets them, and effects from named values."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from proxytune.effects.body.floor import FloorSlope, SlipperyPatch
from proxytune.effects.body.measurement import HeadingOffset, MarkerOffset
from proxytune.effects.body.motion import LateralSlip, TurnSlip, YawScrub
from proxytune.effects.body.turning import CrossCoupling, Understeer, YawLag
from proxytune.effects.claims import outside_effect
from proxytune.effects.command import CommandQuantisation, Delay
from proxytune.effects.effect import Effect
from proxytune.effects.learnt.table import is_learnt, learnt_effect
from proxytune.effects.messages import DelayJitter, DroppedCommands
from proxytune.effects.motors.actuation import DriverMap, MotorLag, Trim, WheelGain
from proxytune.effects.motors.friction import Backlash, DeadBand, Stiction
from proxytune.effects.motors.load import SlewRate, ThermalFade
from proxytune.effects.motors.power import BatterySag, Saturation
from proxytune.effects.motors.ripple import WheelRipple
from proxytune.effects.sight.lens import FieldOfView, LensCentre, LensDistortion, PixelAspect
from proxytune.effects.sight.light import Defocus, Exposure, ImageNoise, Vignetting
from proxytune.effects.sight.mounting import CameraForward, CameraHeight, CameraPitch, CameraRoll, CameraYaw
from proxytune.effects.sight.shutter import Blur, CameraLatency, RollingShutter
from proxytune.errors import SettingsError
from proxytune.extensions import plugins
from proxytune.settings import nearest
from proxytune.space import Parameter, Theta

_ALL: tuple[type[Effect], ...] = (
    DelayJitter,
    DroppedCommands,
    CommandQuantisation,
    Delay,
    SlewRate,
    DriverMap,
    DeadBand,
    Stiction,
    Saturation,
    Trim,
    WheelGain,
    BatterySag,
    ThermalFade,
    MotorLag,
    Backlash,
    WheelRipple,
    YawScrub,
    Understeer,
    YawLag,
    TurnSlip,
    LateralSlip,
    CrossCoupling,
    FloorSlope,
    SlipperyPatch,
    MarkerOffset,
    HeadingOffset,
    CameraPitch,
    CameraRoll,
    CameraYaw,
    CameraHeight,
    CameraForward,
    FieldOfView,
    LensDistortion,
    LensCentre,
    PixelAspect,
    # Mixtures of pictures commute; blur is exact on 8-bit pictures alone, so it comes first
    Blur,
    RollingShutter,
    CameraLatency,
    Defocus,
    Vignetting,
    Exposure,
    ImageNoise,
)

CATALOGUE: Mapping[str, type[Effect]] = MappingProxyType({effect.name: effect for effect in _ALL})

DECLARED: tuple[str, ...] = ("trim", "delay", "blur", "camera_pitch")
"""The effects that a domain family has before anything is found to be missing: θ of the paper."""


def theta_names(effect: type[Effect], name: str = "") -> tuple[str, ...]:
    """The names of an effect's parameters in θ: its own where it has one, `effect.parameter` where it has more.

    Args:
        effect: Its class.
        name: What it is called in θ, if that is not its own name.
    """
    called = name or effect.name
    if len(effect.parameters) == 1:
        return (called,)
    return tuple(f"{called}.{parameter.name}" for parameter in effect.parameters)


def effect_of(theta_name: str) -> str:
    """The name of the effect that a parameter of θ belongs to; that of a user's own may have points in its module."""
    module, colon, rest = theta_name.rpartition(":")
    return module + colon + rest.split(".")[0]


_NAMED: Mapping[type[Effect], tuple[str, ...]] = {effect: theta_names(effect) for effect in _ALL}

PARAMETERS: Mapping[str, Parameter] = MappingProxyType(
    {name: parameter for effect in _ALL for name, parameter in zip(theta_names(effect), effect.parameters, strict=True)}
)
"""Every shipped effect's parameters by their names in θ."""


@dataclass(frozen=True)
class Catalogue:
    """The effects that a domain may have, by name: those shipped, those of plug-ins, and a user's own.

    A user's own is called `module:Attribute`, and its parameters in θ `module:Attribute` where it has one, else
    `module:Attribute.parameter`. Whatever is not shipped comes after the shipped effects of its stage, by name.

    Attributes:
        folder: Whose modules come before the installed ones; None for the installed ones alone.
        own: Effects that a diagnosis is to try beside the shipped ones and plug-ins.
    """

    folder: Path | None = None
    own: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The effects to choose from: those shipped in the order in which the signal meets them, plug-ins, `own`.

        Raises:
            ExtensionError: If two plug-ins have one name, or one has that of a shipped effect.
        """
        return tuple(dict.fromkeys((*CATALOGUE, *plugins("effect", CATALOGUE), *self.own)))

    @property
    def parameters(self) -> "Parameters":
        """Every effect's parameters by their names in θ."""
        return Parameters(self)

    def effect(self, name: str) -> type[Effect]:
        """The effect of this name.

        Raises:
            ExtensionError: If there is none, or it is not what an effect must be.
        """
        return CATALOGUE[name] if name in CATALOGUE else outside_effect(name, self.folder)

    def theta_names(self, name: str) -> tuple[str, ...]:
        """The names in θ of an effect's parameters."""
        return theta_names(self.effect(name), name)

    def knows(self, name: str) -> bool:
        """Whether an effect of this name is shipped, a plug-in, or written as a user's own is."""
        return ":" in name or name in self.names


@dataclass(frozen=True)
class Parameters(Mapping[str, Parameter]):
    """The parameters of a catalogue by their names in θ; a user's own effects answer where they are asked for by name.

    Raises:
        ExtensionError: If an effect that is asked for cannot be used.
    """

    catalogue: Catalogue

    def __getitem__(self, name: str) -> Parameter:
        if name in PARAMETERS:
            return PARAMETERS[name]
        effect = effect_of(name)
        if not self.catalogue.knows(effect):
            raise KeyError(name)
        names = self.catalogue.theta_names(effect)
        return dict(zip(names, self.catalogue.effect(effect).parameters, strict=True))[name]

    def __iter__(self) -> Iterator[str]:
        return (name for effect in self.catalogue.names for name in self.catalogue.theta_names(effect))

    def __len__(self) -> int:
        return sum(1 for _ in self)


SHIPPED = Catalogue()
"""What can be named without a folder of one's own."""


def effects_from(theta: Theta, nominal: Mapping[str, float], catalogue: Catalogue = SHIPPED) -> tuple[Effect, ...]:
    """The effects that θ names, in the catalogue's order; parameters of theirs that it leaves out are neutral.

    What was learnt comes last: it looks at the motion that all named effects ask for.

    Raises:
        SettingsError: If a name is not a parameter of the catalogue or its value is out of bounds.
        ExtensionError: If a user's own effect cannot be used.
    """
    for name, value in theta.items():
        if not is_learnt(name):
            _check(name, value, catalogue.parameters)
    outside = {effect_of(name) for name in theta if name not in PARAMETERS and not is_learnt(name)}
    named = [(catalogue.effect(name), catalogue.theta_names(name)) for name in sorted(outside)]
    chosen: list[Effect] = []
    for effect, names in (*_NAMED.items(), *named):
        if not theta.keys().isdisjoint(names):
            pairs = zip(names, effect.parameters, strict=True)
            chosen.append(effect(*(float(theta.get(n, p.neutral_value(nominal))) for n, p in pairs)))
    learnt = learnt_effect(theta)
    return tuple(chosen) if learnt is None else (*chosen, learnt)


def _check(name: str, value: float, parameters: Parameters) -> None:
    if name not in parameters:
        raise SettingsError(f"{name}: no effect has this parameter; {nearest(name, parameters)}")
    parameter = parameters[name]
    if not parameter.low <= value <= parameter.high:
        raise SettingsError(
            f"{name}: must be between {parameter.low:g} and {parameter.high:g} {parameter.unit}, got {value}"
        )
