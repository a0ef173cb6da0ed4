"""Making a Gymnasium environment, with values for its own parameters."""

import re
from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np

from proxytune.environments.settings import EnvironmentSettings, OwnParameter
from proxytune.errors import InputError, ProxytuneError, SettingsError
from proxytune.extensions import describe, load
from proxytune.extensions.beside import import_beside

REGISTERED = re.compile(r"(.*/)?[\w.-]+-v\d+")
"""How Gymnasium writes what is registered: `Name-v0`, `namespace/Name-v0`."""


def gymnasium() -> ModuleType:
    """The library.

    Raises:
        InputError: If it is not installed.
    """
    try:
        import gymnasium as library
    except ImportError:
        raise InputError('Gymnasium is not installed; run pip install "proxytune[gym]"') from None
    return library


def make_environment(settings: EnvironmentSettings, theta: Mapping[str, float]) -> Any:
    """An environment whose own parameters have the values of θ, neutral where θ leaves them out.

    A module before the name is imported first, from the study's folder or as installed, so that it can register.

    Raises:
        InputError: If it cannot be made, or has no such attribute.
    """
    values = {one: float(theta.get(one.parameter.name, one.parameter.neutral)) for one in settings.own}
    arguments = {**dict(settings.arguments), **{one.argument: value for one, value in values.items() if one.argument}}
    library = gymnasium()
    try:
        made = _make(library, settings, arguments)
    except ProxytuneError:
        raise
    except ModuleNotFoundError as problem:
        raise InputError(f"environment '{settings.environment}' needs {problem.name}; install it") from problem
    except Exception as problem:
        raise InputError(f"environment '{settings.environment}' raised {describe(problem)}; correct it") from problem
    if not isinstance(made, library.Env):
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


def _make(library: ModuleType, settings: EnvironmentSettings, arguments: Mapping[str, Any]) -> Any:
    module, colon, name = settings.environment.rpartition(":")
    if colon and not REGISTERED.fullmatch(name):
        return load(settings.environment, kind="environment", beside=settings.folder, needs=("__call__",))(**arguments)
    if colon:
        import_beside(module, settings.folder)
    limit = {"max_episode_steps": settings.steps} if settings.steps else {}
    return library.make(name, disable_env_checker=True, **limit, **arguments)


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
    """What the attribute is likely to be: wrappers hide those of the environment itself."""
    first = _name_and_index(one.attribute.split(".")[0])[0]
    hidden = first != "unwrapped" and hasattr(environment.unwrapped, first)
    return f"; did you mean 'unwrapped.{one.attribute}'?" if hidden else "; correct it"


def _unset(one: OwnParameter, problem: str) -> SettingsError:
    return SettingsError(f"domain.parameters.{one.parameter.name}: attribute '{one.attribute}' {problem}")
