"""θ of an environment: fixed values, and intervals to draw from at each reset."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from proxytune.errors import InputError
from proxytune.settings import nearest
from proxytune.space import Parameter, Theta

Interval = tuple[float, float]


def read_theta(given: Mapping[str, Any], known: Mapping[str, Parameter]) -> dict[str, Interval]:
    """The interval of each parameter, of no width where its value is fixed.

    Args:
        given: A number, or low and high, by the parameter's name.
        known: The parameters there are.

    Raises:
        InputError: With the parameter and the remedy.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"theta: must give a value or [low, high] by parameter, got {given!r}")
    return {name: _interval(name, value, known) for name, value in given.items()}


def draw_theta(intervals: Mapping[str, Interval], generator: np.random.Generator) -> Theta:
    """θ with each parameter drawn evenly from its interval, in the order of their names."""
    return {name: float(generator.uniform(*intervals[name])) for name in sorted(intervals)}


def _interval(name: str, value: Any, known: Mapping[str, Parameter]) -> Interval:
    if name not in known:
        raise InputError(f"theta: unknown parameter '{name}'; {nearest(name, known)}")
    parameter, ends = known[name], _numbers(value)
    if len(ends) not in (1, 2) or not all(math.isfinite(end) for end in ends):
        raise InputError(f"theta: {name} must be a finite number or [low, high], got {value!r}")
    if ends[0] > ends[-1]:
        raise InputError(f"theta: {name}: the lower bound must come first, got {value!r}")
    if ends[0] < parameter.low or ends[-1] > parameter.high:
        raise InputError(f"theta: {name} must lie within [{parameter.low:g}, {parameter.high:g}], got {value!r}")
    return ends[0], ends[-1]


def _numbers(value: Any) -> list[float]:
    """The numbers of a value, none where it is not made of numbers."""
    listed = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
    try:
        return [float(number) for number in (value if listed else [value])]
    except (TypeError, ValueError):
        return []
