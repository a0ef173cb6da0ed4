"""An effect from outside, found through the one door and checked: it is what it claims to be, or is refused by name."""

import inspect
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np

from proxytune.effects.effect import CHANNELS, Effect, Setting, Stage
from proxytune.effects.trace import Trace
from proxytune.errors import ExtensionError
from proxytune.extensions import describe, load
from proxytune.space import Parameter

MEMBERS = ("name", "stage", "parameters", "trace", "begin", "apply")
"""What every effect has; see proxytune.effects.Effect."""

TICKS, RATE_HZ = 8, 20.0


@lru_cache
def outside_effect(name: str, folder: Path | None) -> type[Effect]:
    """The class of an effect that is not shipped: `module:Attribute`, or the name of a plug-in.

    Raises:
        ExtensionError: If there is none, or it is not what an effect must be.
    """
    kind = load(name, kind="effect", beside=folder, needs=MEMBERS)
    for problem in _problems(kind):
        raise ExtensionError(f"effect '{name}' {problem}")
    return cast(type[Effect], kind)


def _problems(kind: Any) -> Iterator[str]:
    """What is wrong with it, the first thing first: what follows supposes that nothing before is wrong."""
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
    yield from _wrong_fields(kind)
    if kind.stage is not Stage.IMAGE:
        yield from _wrong_filter(kind)


def _wrong_parameter(parameter: Parameter) -> Iterator[str]:
    name, low, high, neutral = parameter.name, parameter.low, parameter.high, parameter.neutral
    if not (np.isfinite([low, high]).all() and low < high):
        yield f"has a parameter '{name}' from {low} to {high}; give a finite range, the lower end first"
    if not isinstance(neutral, str) and not low <= neutral <= high:
        yield f"has a parameter '{name}' whose neutral value {neutral} is not within [{low:g}, {high:g}]; widen that"


def _wrong_trace(kind: Any) -> Iterator[str]:
    if not isinstance(kind.trace, Trace | None):
        yield f"has the trace {kind.trace!r}; give a Trace, or None where measured motion cannot show it"
    if kind.trace is not None and kind.trace.draws is not None:
        yield "draws at random, which only shipped effects may where drives are diagnosed; leave draws out of its trace"
    if kind.trace is not None and not kind.parameters[0].probes:
        yield f"has a trace, but '{kind.parameters[0].name}' has no probes, from which a search sets out; add them"


def _wrong_fields(kind: Any) -> Iterator[str]:
    names = [parameter.name for parameter in kind.parameters]
    own = [field.name for field in fields(kind) if field.init] if is_dataclass(kind) else names
    if own != names:
        yield f"has the fields {', '.join(own) or 'none'}; its parameters are {', '.join(names)}: the same, in order"


def _wrong_filter(kind: Any) -> Iterator[str]:
    """Try it on a short signal, in the middle of its range and where it is to change nothing."""
    middle = [0.5 * (one.low + one.high) for one in kind.parameters]
    neutral = [one.neutral for one in kind.parameters]
    channels = len(CHANNELS[kind.stage])
    signal = np.sin(np.arange(TICKS * channels, dtype=float)).reshape(1, TICKS, channels)
    for values in (middle, neutral):
        if any(isinstance(value, str) for value in values):
            continue
        try:
            answer = _filtered(kind, values, signal)
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


def _filtered(kind: Any, values: list[float], signal: Any) -> Any:
    nominal: Mapping[str, float] = defaultdict(lambda: 1.0)
    effect = kind(*values)
    return effect.apply(signal, effect.begin(Setting(RATE_HZ, signal[:, 0], nominal)))
