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
from proxytune.effects.trace import MOTIONS, SIGNALS, Cue, Form, Means, Trace, WheelCurve
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
    for problem in problems(kind):
        raise ExtensionError(f"effect '{name}' {problem}")
    if kind.trace is not None and kind.trace.draws is not None:
        remedy = "leave draws out of its trace"
        raise ExtensionError(f"effect '{name}' draws at random, which only shipped ones may in a diagnosis; {remedy}")
    return cast(type[Effect], kind)


def problems(kind: Any) -> Iterator[str]:
    """What is wrong with an effect that has all MEMBERS, the first thing first.

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
    yield from _wrong_fields(kind)
    if kind.stage is not Stage.IMAGE:
        yield from _wrong_filter(kind)


def _wrong_parameter(parameter: Parameter) -> Iterator[str]:
    name, low, high, neutral = parameter.name, parameter.low, parameter.high, parameter.neutral
    if not (np.isfinite([low, high]).all() and low < high):
        yield f"has a parameter '{name}' from {low} to {high}; give a finite range, the lower end first"
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
    for form in trace.forms:
        yield from _wrong_form(kind, form)
    for shown in (trace.shown, *(form.shown for form in trace.forms if form.shown is not None)):
        yield from _wrong_figure(shown)


def _wrong_form(kind: Any, form: Form) -> Iterator[str]:
    known = [parameter.name for parameter in kind.parameters]
    free = {name for coordinate in form.free for name in coordinate}
    if unknown := sorted((free | set(form.fixed) | set(form.moved)) - set(known)):
        yield f"has a form with the parameter '{unknown[0]}'; its parameters are {', '.join(known)}"


def _wrong_figure(shown: Any) -> Iterator[str]:
    """What a figure of the effect could not be drawn for."""
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


def _wrong_fields(kind: Any) -> Iterator[str]:
    names = [parameter.name for parameter in kind.parameters]
    own = [field.name for field in fields(kind) if field.init] if is_dataclass(kind) else names
    if own != names:
        yield f"has the fields {', '.join(own) or 'none'}; its parameters are {', '.join(names)}: the same, in order"


def _wrong_filter(kind: Any) -> Iterator[str]:
    """Try it on a short signal, in the middle of its range, at both ends, and where it is to change nothing."""
    tried = [[one.low + share * (one.high - one.low) for one in kind.parameters] for share in (0.5, 0.0, 1.0)]
    neutral = [one.neutral for one in kind.parameters]
    signal = _signal(kind.stage)
    for values in (*tried, neutral):
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


def _signal(stage: Stage) -> Any:
    """Something that the stage could meet (1, ticks, channels)."""
    channels = len(CHANNELS[stage])
    if stage is Stage.CAMERA:
        level = {"pitch_deg": 1.0, "height_m": 1.0, "field_of_view_deg": 1.0, "aspect": 1.0}
        return np.tile([level.get(name, 0.0) for name in CHANNELS[stage]], (1, TICKS, 1))
    return np.sin(np.arange(TICKS * channels, dtype=float)).reshape(1, TICKS, channels)


def _filtered(kind: Any, values: list[float], signal: Any) -> Any:
    nominal: Mapping[str, float] = defaultdict(lambda: 1.0)
    effect = kind(*values)
    return effect.apply(signal, effect.begin(Setting(RATE_HZ, signal[:, 0], nominal)))
