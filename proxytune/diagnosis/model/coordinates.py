"""Coordinates of a fit: one or several parameters of θ that share a value, within their range."""

from collections.abc import Sequence

from proxytune.diagnosis.measured.drives import Floats
from proxytune.diagnosis.rules import RULES
from proxytune.driving.robot import Robot
from proxytune.effects import effect_of
from proxytune.space import Theta

Coordinate = tuple[str, ...]
"""Parameters of θ that share one value."""


def span(coordinate: Coordinate, robot: Robot) -> tuple[float, float]:
    """Lowest and highest value of a coordinate."""
    parameter = robot.catalogue.parameters[coordinate[0]]
    return parameter.low, parameter.high


def theta_at(theta: Theta, free: Sequence[Coordinate], values: Floats) -> dict[str, float]:
    """θ with its free coordinates at these values."""
    given = {name: float(value) for names, value in zip(free, values, strict=True) for name in names}
    return {**theta, **given}


def at_edge(name: str, value: float, robot: Robot) -> bool:
    """Whether a value lies at an end of its parameter's range that is not neutral."""
    parameter = robot.catalogue.parameters[name]
    reach = RULES.edge_share * (parameter.high - parameter.low)
    ends = [end for end in (parameter.low, parameter.high) if end != parameter.neutral_value(robot.figures)]
    return any(abs(value - end) <= reach for end in ends)


def is_stepwise(coordinate: Coordinate, robot: Robot) -> bool:
    """Whether a coordinate changes the motion by steps: no slope leads to its best value, so that is scanned for."""
    trace = robot.catalogue.effect(effect_of(coordinate[0])).trace
    return trace is not None and trace.stepwise


def smooth_coordinates(free: Sequence[Coordinate], robot: Robot) -> tuple[Coordinate, ...]:
    """The coordinates that change the motion smoothly, so that a slope leads to their best values."""
    return tuple(coordinate for coordinate in free if not is_stepwise(coordinate, robot))
