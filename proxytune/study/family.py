"""The domain family that a study names, loaded and checked."""

import functools
import inspect
from collections.abc import Callable, Mapping
from numbers import Integral
from pathlib import Path
from typing import Any, TypeVar

from proxytune.domain import DomainFamily
from proxytune.errors import ExtensionError, InputError, ProxytuneError
from proxytune.extensions import describe, load
from proxytune.settings import nearest
from proxytune.space import Parameter
from proxytune.study.settings import StudySettings

MEMBERS: Mapping[str, tuple[type, str]] = {
    "identity": (str, "text"),
    "metrics": (Mapping, "a mapping"),
    "parameters": (Mapping, "a mapping"),
    "starts": (Integral, "a whole number"),
}
"""What a domain family tells of itself, and as what."""

METHODS = ("check_agent", "run")
Value = TypeVar("Value")


def load_family(settings: StudySettings, model: Path | None) -> DomainFamily:
    """Call the factory that the study names, with its [domain] table and a model.

    A module in the study's folder comes before an installed one.

    Raises:
        InputError: If there is no such factory, or what it makes is no domain family or cannot do what is asked.
    """
    if model is not None and not model.is_file():
        raise settings.error("proxy", f"no such file: {model}; check the path")
    try:
        factory = load(settings.family, kind="family", beside=settings.folder, needs=("__call__",))
    except InputError as problem:
        raise settings.error("family", str(problem)) from None
    family = _asked(settings, settings.family, lambda: factory(settings.domain, model=model))
    _check(settings, family)
    return family  # type: ignore[no-any-return]


def _asked(settings: StudySettings, what: str, ask: Callable[[], Value]) -> Value:
    """What a user's code answers; one line of what it raises instead."""
    try:
        return ask()
    except ProxytuneError:
        raise
    except Exception as problem:
        raise settings.error("family", f"{what} raised {describe(problem)}; correct it") from problem


def _check(settings: StudySettings, family: DomainFamily) -> None:
    _check_members(settings, family)
    for interval in settings.space.intervals:
        given = f"[{interval.low:g}, {interval.high:g}]"
        bounds = (interval.low, interval.high)
        check_bounds(settings, family, f"parameters.{interval.name}", interval.name, bounds, given)
    if settings.starts > family.starts:
        raise settings.error("starts", f"the family has {family.starts}, got {settings.starts}")
    for metric in settings.metrics:
        if metric.name not in family.metrics:
            raise settings.error("metrics", f"unknown metric '{metric.name}'; {nearest(metric.name, family.metrics)}")
    for agent in settings.agents:
        _check_agent(settings, family, agent)


def _check_members(settings: StudySettings, family: Any) -> None:
    lacks = [member for member in (*MEMBERS, *METHODS) if not _has(family, member)]
    if lacks:
        raise settings.error("family", f"{settings.family} made no domain family: it lacks {', '.join(lacks)}")
    for member, (kind, word) in MEMBERS.items():
        value = _asked(settings, f"{member} of {settings.family}", functools.partial(getattr, family, member))
        if not isinstance(value, kind):
            name = type(value).__name__
            raise settings.error("family", f"{member} of {settings.family} must be {word}, got {name}")


def _has(family: Any, member: str) -> bool:
    """Whether there is such a member, be it a property that raises."""
    missing = object()
    return inspect.getattr_static(family, member, missing) is not missing or hasattr(family, member)


def _check_agent(settings: StudySettings, family: DomainFamily, agent: str) -> None:
    try:
        _asked(settings, f"check_agent('{agent}') of {settings.family}", lambda: family.check_agent(agent))
    except InputError as problem:
        raise settings.error("agents", str(problem)) from None


def check_bounds(
    settings: StudySettings, family: DomainFamily, key: str, name: str, bounds: tuple[float, float], given: str
) -> None:
    """Refuse values of a parameter that the family has not, or that lie beyond what it can be.

    Args:
        settings: Of the study.
        family: Whose parameter it is.
        key: Where the values stand in study.toml.
        name: The parameter.
        bounds: Lowest and highest of the values.
        given: The values as text.

    Raises:
        SettingsError: With the key and the remedy.
    """
    try:
        known = family.parameters.get(name)
    except ExtensionError as problem:
        raise settings.error(key, str(problem)) from None
    if known is None:
        raise settings.error(key, f"unknown parameter; {nearest(name, family.parameters)}")
    if not isinstance(known, Parameter):
        kind = type(known).__name__
        raise settings.error("family", f"parameters['{name}'] of {settings.family} must be a Parameter, got {kind}")
    if bounds[0] < known.low or bounds[1] > known.high:
        raise settings.error(key, f"must lie within [{known.low:g}, {known.high:g}], got {given}")
