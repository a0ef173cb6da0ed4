"""Every effect there is, in the order in which the signal meets them, and effects from named values."""

from collections.abc import Mapping
from types import MappingProxyType

from proxytune.effects.body.floor import FloorSlope, SlipperyPatch
from proxytune.effects.body.measurement import HeadingOffset, MarkerOffset
from proxytune.effects.body.motion import LateralSlip, TurnSlip, YawScrub
from proxytune.effects.body.turning import CrossCoupling, Understeer, YawLag
from proxytune.effects.command import CommandQuantisation, Delay
from proxytune.effects.effect import Effect
from proxytune.effects.learnt.table import is_learnt, learnt_effect
from proxytune.effects.messages import DelayJitter, DroppedCommands
from proxytune.effects.motors.actuation import DriverMap, MotorLag, Trim, WheelGain
from proxytune.effects.motors.friction import Backlash, DeadBand, Stiction
from proxytune.effects.motors.load import SlewRate, ThermalFade
from proxytune.effects.motors.power import BatterySag, Saturation
from proxytune.effects.motors.ripple import WheelRipple
from proxytune.effects.sight.camera import CameraHeight, CameraPitch, CameraRoll, CameraYaw, FieldOfView, LensDistortion
from proxytune.effects.sight.image import Blur
from proxytune.errors import SettingsError
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
    FieldOfView,
    LensDistortion,
    Blur,
)

CATALOGUE: Mapping[str, type[Effect]] = MappingProxyType({effect.name: effect for effect in _ALL})

DECLARED: tuple[str, ...] = ("trim", "delay", "blur", "camera_pitch")
"""The effects that a domain family has before anything is found to be missing: θ of the paper."""


def theta_names(effect: type[Effect]) -> tuple[str, ...]:
    """The names of an effect's parameters in θ: its own where it has one, `effect.parameter` where it has more."""
    if len(effect.parameters) == 1:
        return (effect.name,)
    return tuple(f"{effect.name}.{parameter.name}" for parameter in effect.parameters)


def effect_of(theta_name: str) -> str:
    """The name of the effect that a parameter of θ belongs to."""
    return theta_name.split(".")[0]


_NAMED: Mapping[type[Effect], tuple[str, ...]] = {effect: theta_names(effect) for effect in _ALL}

PARAMETERS: Mapping[str, Parameter] = MappingProxyType(
    {name: parameter for effect in _ALL for name, parameter in zip(theta_names(effect), effect.parameters, strict=True)}
)
"""Every effect's parameters by their names in θ."""


def effects_from(theta: Theta, nominal: Mapping[str, float]) -> tuple[Effect, ...]:
    """The effects that θ names, in the catalogue's order; parameters of theirs that it leaves out are neutral.

    What was learnt comes last: it looks at the motion that all named effects ask for.

    Raises:
        SettingsError: If a name is not a parameter of the catalogue or its value is out of bounds.
    """
    for name, value in theta.items():
        if not is_learnt(name):
            _check(name, value)
    chosen: list[Effect] = []
    for effect, names in _NAMED.items():
        if not theta.keys().isdisjoint(names):
            pairs = zip(names, effect.parameters, strict=True)
            chosen.append(effect(*(float(theta.get(n, p.neutral_value(nominal))) for n, p in pairs)))
    learnt = learnt_effect(theta)
    return tuple(chosen) if learnt is None else (*chosen, learnt)


def _check(name: str, value: float) -> None:
    if name not in PARAMETERS:
        raise SettingsError(f"{name}: no effect has this parameter; {nearest(name, PARAMETERS)}")
    parameter = PARAMETERS[name]
    if not parameter.low <= value <= parameter.high:
        raise SettingsError(
            f"{name}: must be between {parameter.low:g} and {parameter.high:g} {parameter.unit}, got {value}"
        )
