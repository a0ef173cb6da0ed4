"""What might be missing: every motion effect of a catalogue, in the forms it can take."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import repeat

from proxytune.diagnosis.model.coordinates import Coordinate
from proxytune.diagnosis.model.replay import RANDOM_EFFECTS
from proxytune.driving.robot import Robot
from proxytune.effects import CATALOGUE, Catalogue, Effect, Form, theta_names
from proxytune.space import Parameter, Theta

MOTION_EFFECTS = tuple(name for name, effect in CATALOGUE.items() if effect.trace)
"""The shipped effects that measured motion can show."""


def motion_effects(catalogue: Catalogue) -> tuple[str, ...]:
    """The effects of a catalogue that measured motion can show."""
    outside = (name for name in catalogue.names if name not in CATALOGUE)
    return (*MOTION_EFFECTS, *(name for name in outside if catalogue.effect(name).trace))


@dataclass(frozen=True)
class Candidate:
    """One form of an effect: what is free in it, what is fixed, and where a search starts.

    Attributes:
        effect: Its name in the catalogue.
        form: What is special about this form: `left wheel`; empty where nothing is.
        free: Its coordinates.
        fixed: Its other parameters.
        neutral: Where the model has its coordinates.
        probes: Where a search starts, one value per coordinate.
    """

    effect: str
    form: str
    free: tuple[Coordinate, ...]
    fixed: Mapping[str, float]
    neutral: tuple[float, ...]
    probes: tuple[tuple[float, ...], ...]

    @property
    def label(self) -> str:
        """What people read: `dead_band (left wheel)`."""
        return f"{self.effect} ({self.form})" if self.form else self.effect


def candidates(robot: Robot, theta: Theta, taken: Iterable[str]) -> tuple[Candidate, ...]:
    """Every form of every deterministic motion effect that is not taken.

    Args:
        robot: The robot, whose catalogue says what there is.
        theta: Values of effects that the model has: a form starts from there.
        taken: Names of effects that are declared or adopted.
    """
    kept = set(taken)
    found: list[Candidate] = []
    for name in motion_effects(robot.catalogue):
        if name not in kept and name not in RANDOM_EFFECTS:
            found += _forms(name, robot, theta)
    return tuple(found)


def _forms(effect: str, robot: Robot, theta: Theta) -> list[Candidate]:
    kind = robot.catalogue.effect(effect)
    known = {
        parameter.name: theta.get(name, parameter.neutral_value(robot.figures))
        for name, parameter in zip(theta_names(kind, effect), kind.parameters, strict=True)
    }
    present = known[kind.parameters[0].name] != kind.parameters[0].neutral
    return [_candidate(effect, kind, form, known) for form in _forms_of(kind) if form.present in (None, present)]


def _forms_of(kind: type[Effect]) -> tuple[Form, ...]:
    """The forms that an effect may take: with every parameter free, unless it says otherwise."""
    stated = kind.trace.forms if kind.trace else ()
    return stated or (Form(tuple((parameter.name,) for parameter in kind.parameters)),)


def _candidate(effect: str, kind: type[Effect], form: Form, known: Mapping[str, float]) -> Candidate:
    names = {parameter.name: name for parameter, name in zip(kind.parameters, theta_names(kind, effect), strict=True)}
    parameters = {parameter.name: parameter for parameter in kind.parameters}
    held = {name for coordinate in form.free for name in coordinate}
    tried = [
        _other_probes(parameters[first], known[first])
        if first in form.moved or not form.moved
        else repeat(known[first])
        for first, *_ in form.free
    ]
    return Candidate(
        effect=effect,
        form=form.name,
        free=tuple(tuple(names[name] for name in coordinate) for coordinate in form.free),
        fixed={names[name]: form.fixed.get(name, value) for name, value in known.items() if name not in held},
        neutral=tuple(known[first] for first, *_ in form.free),
        probes=tuple(zip(*tried, strict=False)),
    )


def _other_probes(parameter: Parameter, here: float) -> tuple[float, ...]:
    """The probes that differ from where the model is."""
    return tuple(value for value in parameter.probes if not math.isclose(value, here, abs_tol=1e-9))
