"""Which parameters θ may name of an environment: its own, and those of every effect that can wrap it."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from proxytune.effects import CATALOGUE, Catalogue, Effect, Setting, Stage, effect_of
from proxytune.effects.learnt.table import is_learnt
from proxytune.environments.settings import OwnParameter
from proxytune.environments.signals import figures, rest_of
from proxytune.environments.spaces import Spaces
from proxytune.errors import ExtensionError
from proxytune.space import Parameter

ON_COMMANDS = (Stage.COMMAND, Stage.ACTUATION)
TWO_WHEELS = ("trim", "wheel_gain", "battery_sag")
"""Effects that set one of two wheels against the other, or sum over both."""
IMBALANCE = "imbalance"
TIMES = {"s", "min", "Hz"}
"""Units that only a rate makes sense of."""


@dataclass(frozen=True)
class EnvironmentParameters(Mapping[str, Parameter]):
    """Parameters by their names in θ; a user's own effects answer where they are asked for by name.

    Attributes:
        own: Of the environment.
        catalogue: The effects that there are.
        spaces: What they would wrap.

    Raises:
        ExtensionError: If an effect that is asked for cannot wrap the environment, with the reason.
    """

    own: tuple[OwnParameter, ...]
    catalogue: Catalogue
    spaces: Spaces

    def __getitem__(self, name: str) -> Parameter:
        for one in self.own:
            if one.parameter.name == name:
                return one.parameter
        if is_learnt(name):
            raise ExtensionError(f"'{name}' bends the motion of a robot's body; an environment moves by itself")
        parameter = self.catalogue.parameters[name]
        if reason := self._refusal(effect_of(name), parameter):
            raise ExtensionError(f"effect '{effect_of(name)}' cannot wrap this environment: {reason}")
        return parameter

    def __iter__(self) -> Iterator[str]:
        yield from (one.parameter.name for one in self.own)
        for effect in self.catalogue.names:
            kind = self.catalogue.effect(effect)
            for name, parameter in zip(self.catalogue.theta_names(effect), kind.parameters, strict=True):
                if not self._refusal(effect, parameter):
                    yield name

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _refusal(self, name: str, parameter: Parameter) -> str:
        kind = self.catalogue.effect(name)
        return (
            _of_stage(kind, self.spaces)
            or _of_wheels(name, kind, parameter, self.spaces)
            or _of_needs(kind, self.spaces)
        )


def _of_stage(kind: type[Effect], spaces: Spaces) -> str:
    """Why nothing of this stage can be bent, or empty."""
    if kind.stage is Stage.MOTION:
        return "it bends the motion of a robot's body; vary the environment's own physics in [domain.parameters]"
    if kind.stage is Stage.CAMERA:
        return "it mounts the camera that proxytune draws; the environment draws its own pictures"
    if kind.stage is Stage.MEASUREMENT:
        return spaces.no_state
    return spaces.no_actions if kind.stage in ON_COMMANDS else spaces.no_picture


def _of_wheels(name: str, kind: type[Effect], parameter: Parameter, spaces: Spaces) -> str:
    """Why it needs two wheels where there are not two actions, or empty."""
    count = len(spaces.low)
    if kind.stage not in ON_COMMANDS or count == 2:
        return ""
    if name in TWO_WHEELS or name not in CATALOGUE:
        return f"it is made for two actions, a left and a right wheel; here are {count}"
    if parameter.name == IMBALANCE:
        return f"{IMBALANCE} shares an effect out between two wheels; here are {count} actions, all alike"
    return ""


def _of_needs(kind: type[Effect], spaces: Spaces) -> str:
    """What it would have to know of the robot and nobody says, or empty."""
    units = {part for one in kind.parameters for part in re.split(r"[^A-Za-z]+", one.unit)}
    if spaces.rate_hz is None and units & TIMES:
        return "it needs the time that a step takes; add rate_hz to [domain], steps per second"
    known = figures(spaces)
    try:
        values = [one.neutral_value(known) for one in kind.parameters]
        kind(*values).begin(Setting(spaces.rate_hz or 1.0, rest_of(kind.stage, spaces), known))
    except KeyError as figure:
        return f"it needs a robot's {str(figure).strip(chr(39))}, which an environment does not state"
    return ""
