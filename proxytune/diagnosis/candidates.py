"""What might be missing: every motion effect of the catalogue, in the forms it can take."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from proxytune.diagnosis.fitting import Coordinate
from proxytune.diagnosis.replay import RANDOM_EFFECTS
from proxytune.effects import CATALOGUE, Stage, theta_names
from proxytune.space import Parameter, Theta

MOTION_STAGES = (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION, Stage.MEASUREMENT)

MOTION_EFFECTS = tuple(name for name, effect in CATALOGUE.items() if effect.stage in MOTION_STAGES)
"""The effects that measured motion can show."""


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


def candidates(nominal: Mapping[str, float], theta: Theta, taken: Iterable[str]) -> tuple[Candidate, ...]:
    """Every form of every deterministic motion effect that is not taken.

    Args:
        nominal: The robot's figures.
        theta: Values of effects that the model has: a form starts from there.
        taken: Names of effects that are declared or adopted.
    """
    kept = set(taken)
    found: list[Candidate] = []
    for name in MOTION_EFFECTS:
        if name not in kept and name not in RANDOM_EFFECTS:
            found += _forms(name, nominal, theta)
    return tuple(found)


def _forms(effect: str, nominal: Mapping[str, float], theta: Theta) -> list[Candidate]:
    names, parameters = theta_names(CATALOGUE[effect]), CATALOGUE[effect].parameters
    here = [theta.get(n, p.neutral_value(nominal)) for n, p in zip(names, parameters, strict=True)]
    known = dict(zip(names, here, strict=True))
    if "imbalance" in [p.name for p in parameters]:
        return _wheel_forms(effect, names, known, parameters)
    if effect == "wheel_gain":
        return _gain_forms(names, known, parameters)
    if effect == "battery_sag":
        return [_single(effect, n, n.split(".")[1], known, p) for n, p in zip(names, parameters, strict=True)]
    probes = zip(*(_away(p, known[n]) for n, p in zip(names, parameters, strict=True)), strict=False)
    free = tuple((name,) for name in names)
    return [Candidate(effect, "", free, {}, tuple(here), tuple(probes))]


def _wheel_forms(
    effect: str, names: tuple[str, ...], known: Mapping[str, float], parameters: tuple[Parameter, ...]
) -> list[Candidate]:
    main, imbalance = names
    probes = tuple((value,) for value in _away(parameters[0], known[main]))
    both = Candidate(effect, "", ((main,),), {imbalance: known[imbalance]}, (known[main],), probes)
    if known[main] != _neutral(parameters[0]):
        uneven = tuple((known[main], value) for value in parameters[1].probes)
        return [both, Candidate(effect, "uneven wheels", ((main,), (imbalance,)), {}, tuple(known.values()), uneven)]
    sides = (("left wheel", -1.0), ("right wheel", 1.0))
    return [both] + [
        Candidate(effect, form, ((main,),), {imbalance: side}, (known[main],), probes) for form, side in sides
    ]


def _gain_forms(
    names: tuple[str, ...], known: Mapping[str, float], parameters: tuple[Parameter, ...]
) -> list[Candidate]:
    left, right = names
    probes = tuple((value,) for value in _away(parameters[0], known[left]))
    return [
        Candidate("wheel_gain", "", ((left, right),), {}, (known[left],), probes),
        Candidate("wheel_gain", "left wheel", ((left,),), {right: known[right]}, (known[left],), probes),
        Candidate("wheel_gain", "right wheel", ((right,),), {left: known[left]}, (known[right],), probes),
    ]


def _single(effect: str, name: str, form: str, known: Mapping[str, float], parameter: Parameter) -> Candidate:
    fixed = {other: value for other, value in known.items() if other != name}
    probes = tuple((value,) for value in _away(parameter, known[name]))
    return Candidate(effect, form, ((name,),), fixed, (known[name],), probes)


def _away(parameter: Parameter, here: float) -> tuple[float, ...]:
    """The probes that differ from where the model is."""
    return tuple(value for value in parameter.probes if not math.isclose(value, here, abs_tol=1e-9))


def _neutral(parameter: Parameter) -> float:
    return math.nan if isinstance(parameter.neutral, str) else parameter.neutral
