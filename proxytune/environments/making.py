"""An environment as a study's [domain] table describes it, made with values for its own parameters.

Class names and fields of the settings count in a family's identity.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from proxytune.effects import PARAMETERS, Catalogue, read_effects
from proxytune.errors import InputError, ProxytuneError, SettingsError
from proxytune.extensions import describe, import_beside, load
from proxytune.settings import Section, nearest, read_settings
from proxytune.space import Parameter

KEYS = ("environment", "steps", "rate_hz", "arguments", "parameters", "metrics", "state", "effects")
FOLDS = ("last", "sum", "mean", "max", "min")
"""How an entry of info, one value a step, becomes a metric."""
OF_THE_EPISODE = {"return": "", "length": "steps"}
"""Metrics that every environment has, with their units."""
POSE = ("x", "y", "heading")
_STEP = r"[A-Za-z_]\w*(\[\d+(,\s*\d+)*\])?"
ATTRIBUTE = re.compile(rf"{_STEP}(\.{_STEP})*")
"""`unwrapped.model.opt.gravity[2]`: names by points, each with an index where it is an array."""


@dataclass(frozen=True)
class OwnParameter:
    """A parameter of the environment's own: an argument of its constructor, or an attribute of what that made."""

    parameter: Parameter
    argument: str
    attribute: str


@dataclass(frozen=True)
class EpisodeMetric:
    """Rule by which an episode is scored."""

    name: str  # what the metric is called
    source: str  # "return", "length", or "info"
    entry: str  # which entry of info
    fold: str  # one of FOLDS
    unit: str  # its unit, empty where it has none


@dataclass(frozen=True)
class EnvironmentSettings:
    """A [domain] table."""

    environment: str  # a registered name, "module:Name-v0", or "module:attribute" of what makes one
    steps: int | None  # longest episode; None where the environment's own limit holds
    rate_hz: float | None  # steps per second of the simulated world; None where the environment is asked
    arguments: tuple[tuple[str, Any], ...]  # fixed arguments of the constructor, sorted by name
    own: tuple[OwnParameter, ...]  # the environment's own parameters, in the order of the table
    metrics: tuple[EpisodeMetric, ...]  # what episodes are scored by
    state: tuple[int, ...] | None  # which entries of the observation are x, y and heading, if any
    effects: tuple[tuple[str, float], ...]  # values of effects that every instance has, sorted by name in θ
    folder: Path  # where a user's modules lie


def read_domain(section: Section) -> EnvironmentSettings:
    """Read a [domain] table."""
    section.only(KEYS)
    folder = section.path.resolve().parent
    effects, _ = read_effects(section.section("effects"), Catalogue(folder))
    return EnvironmentSettings(
        environment=section.text("environment"),
        steps=section.whole("steps", low=1) if "steps" in section else None,
        rate_hz=section.number("rate_hz", low=1e-3, high=1e6) if "rate_hz" in section else None,
        arguments=tuple(sorted(section.section("arguments").items())),
        own=_read_parameters(section),
        metrics=_read_metrics(section.section("metrics")),
        state=_read_state(section.section("state")) if "state" in section else None,
        effects=tuple(sorted(effects.items())),
        folder=folder,
    )


def _read_parameters(section: Section) -> tuple[OwnParameter, ...]:
    tables, fixed = section.section("parameters"), section.section("arguments")
    own = tuple(_read_parameter(tables, name) for name in tables)
    for one in own:
        if one.argument in fixed:
            name = one.parameter.name
            raise tables.error(name, f"argument '{one.argument}' is fixed in [domain.arguments]; take it out of one")
    return own


def _read_parameter(tables: Section, name: str) -> OwnParameter:
    table = tables.section(name)
    table.only(("argument", "attribute", "low", "high", "neutral", "unit"))
    if name in PARAMETERS or ":" in name:
        raise tables.error(name, "is the name of an effect's parameter; choose another")
    if ("argument" in table) == ("attribute" in table):
        raise tables.error(name, "give either argument, the constructor's, or attribute, the finished environment's")
    argument, attribute = table.text("argument", ""), table.text("attribute", "")
    if not argument and not ATTRIBUTE.fullmatch(attribute):
        raise table.error("attribute", f"'{attribute}' must be written unwrapped.m or unwrapped.model.body_mass[1]")
    low, high = table.number("low"), table.number("high")
    if low >= high:
        raise table.error("low", f"must be below high, got {low:g} and {high:g}")
    neutral = table.number("neutral", low=low, high=high)
    parameter = Parameter(name=name, unit=table.text("unit", ""), low=low, high=high, neutral=neutral)
    return OwnParameter(parameter, argument, attribute)


def _read_metrics(section: Section) -> tuple[EpisodeMetric, ...]:
    if not section:
        return tuple(EpisodeMetric(name, name, "", "", unit) for name, unit in OF_THE_EPISODE.items())
    return tuple(_read_metric(section, name) for name in section)


def _read_metric(section: Section, name: str) -> EpisodeMetric:
    if isinstance(section[name], str):
        source = section.text(name, choices=OF_THE_EPISODE)
        return EpisodeMetric(name, source, "", "", OF_THE_EPISODE[source])
    if not isinstance(section[name], dict):
        raise section.error(name, f'must be "return", "length" or {{ info = "…", as = "mean" }}, got {section[name]!r}')
    table = section.section(name)
    table.only(("info", "as", "unit"))
    return EpisodeMetric(name, "info", table.text("info"), table.text("as", choices=FOLDS), table.text("unit", ""))


def _read_state(section: Section) -> tuple[int, ...]:
    section.only(POSE)
    places = tuple(section.whole(name) for name in POSE)
    if len(set(places)) < len(places):
        raise SettingsError(f"{section.path}: {section.name.rstrip('.')}: names an entry of the observation twice")
    return places


REGISTERED = re.compile(r"(.*/)?[\w.-]+-v\d+")
"""How Gymnasium writes what is registered: `Name-v0`, `namespace/Name-v0`."""


def make_environment(settings: EnvironmentSettings, theta: Mapping[str, float]) -> Any:
    """An environment whose own parameters have the values of θ, neutral where θ leaves them out.

    A module before the name is imported first, from the study's folder or as installed, so that it can register.
    """
    values = {one: float(theta.get(one.parameter.name, one.parameter.neutral)) for one in settings.own}
    arguments = {**dict(settings.arguments), **{one.argument: value for one, value in values.items() if one.argument}}
    try:
        made = _make(settings, arguments)
    except ProxytuneError:
        raise
    except ModuleNotFoundError as problem:
        raise InputError(f"environment '{settings.environment}' needs {problem.name}; install it") from problem
    except Exception as problem:
        raise InputError(f"environment '{settings.environment}' raised {describe(problem)}; correct it") from problem
    if not isinstance(made, gymnasium.Env):
        kind = type(made).__name__
        raise InputError(f"environment '{settings.environment}' is a {kind}; it must be a gymnasium.Env")
    try:
        for one, value in values.items():
            if one.attribute:
                _set(made, one, value)
    except SettingsError:
        made.close()
        raise
    return made


def _make(settings: EnvironmentSettings, arguments: Mapping[str, Any]) -> Any:
    module, colon, name = settings.environment.rpartition(":")
    if colon and not REGISTERED.fullmatch(name):
        return load(settings.environment, kind="environment", beside=settings.folder, needs=("__call__",))(**arguments)
    if colon:
        import_beside(module, settings.folder)
    limit = {"max_episode_steps": settings.steps} if settings.steps else {}
    return gymnasium.make(name, disable_env_checker=True, **limit, **arguments)


def _set(environment: Any, one: OwnParameter, value: float) -> None:
    """Set an attribute, or an entry of one that is an array."""
    *path, last = one.attribute.split(".")
    try:
        holder = environment
        for name in path:
            holder = _part(holder, name)
        before = _part(holder, last)
    except (AttributeError, IndexError, TypeError) as problem:
        raise _unset(one, f"cannot be reached ({describe(problem)}){_hint(environment, one)}") from None
    if isinstance(before, bool | np.bool_) or np.ndim(before) != 0 or not isinstance(before, int | float | np.number):
        raise _unset(one, f"is {' '.join(repr(before).split())}; name one number")
    name, index = _name_and_index(last)
    try:
        if index is None:
            setattr(holder, name, value)
        else:
            getattr(holder, name)[index] = value
    except Exception as problem:
        raise _unset(one, f"cannot be set ({describe(problem)}); name what it is computed from") from None


def _part(holder: Any, step: str) -> Any:
    name, index = _name_and_index(step)
    found = getattr(holder, name)
    return found if index is None else found[index]


def _name_and_index(step: str) -> tuple[str, Any]:
    name, bracket, rest = step.rstrip("]").partition("[")
    if not bracket:
        return name, None
    places = tuple(int(place) for place in rest.split(","))
    return name, places if len(places) > 1 else places[0]


def _hint(environment: Any, one: OwnParameter) -> str:
    """Guess what was meant by an attribute: wrappers hide those of the environment itself."""
    first = _name_and_index(one.attribute.split(".")[0])[0]
    hidden = first != "unwrapped" and hasattr(environment.unwrapped, first)
    return f"; did you mean 'unwrapped.{one.attribute}'?" if hidden else "; correct it"


def _unset(one: OwnParameter, problem: str) -> SettingsError:
    return SettingsError(f"domain.parameters.{one.parameter.name}: attribute '{one.attribute}' {problem}")


def read_values(path: Path, own: tuple[OwnParameter, ...], folder: Path) -> dict[str, float]:
    """Read what a model.toml gives an environment: its effects, and in [parameters] values of the environment's own.

    A model that `diagnose` wrote names a robot too, which says nothing of an environment.
    """
    settings = read_settings(path)
    settings.only(("format", "robot", "plant", "geometry", "parameters", "effects"))
    settings.whole("format", 1, low=1, high=1)
    known = {one.parameter.name: one.parameter for one in own}
    given = settings.section("parameters")
    for name in given:
        if name not in known:
            hint = nearest(name, known) if known else "study.toml has no [domain.parameters]"
            raise given.error(name, f"is no parameter of the environment; {hint}")
    values = {name: given.number(name, low=known[name].low, high=known[name].high) for name in given}
    effects, _ = read_effects(settings.section("effects"), Catalogue(folder))
    return {**values, **effects}
