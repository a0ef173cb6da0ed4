"""The domain family that a study names, loaded and checked."""

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from proxytune.domain import DomainFamily
from proxytune.errors import InputError, ProxytuneError
from proxytune.settings import nearest
from proxytune.study.settings import StudySettings

MEMBERS = ("identity", "metrics", "parameters", "starts", "check_agent", "run")


def load_family(settings: StudySettings, model: Path | None) -> DomainFamily:
    """Call the factory that the study names, with its [domain] table and a model.

    Modules in the study's folder can be imported, after those installed.

    Raises:
        InputError: If there is no such factory, or what it makes is no domain family or cannot do what is asked.
    """
    if model is not None and not model.is_file():
        raise settings.error("proxy", f"no such file: {model}; check the path")
    factory = _factory(settings)
    try:
        family = factory(settings.domain, model=model)
    except ProxytuneError:
        raise
    except Exception as problem:
        raise settings.error("family", f"{settings.family} raised {_named(problem)}; correct it") from problem
    _check(settings, family)
    return family  # type: ignore[no-any-return]


def _factory(settings: StudySettings) -> Any:
    module, colon, name = settings.family.partition(":")
    if not (module and colon and name):
        raise settings.error("family", f"must be 'module:factory', got '{settings.family}'")
    try:
        found = import_beside(settings, module)
    except ModuleNotFoundError as problem:
        folder = settings.folder.absolute()
        raise settings.error("family", f"no module '{problem.name}' here, in {folder} or installed") from None
    except Exception as problem:
        raise settings.error("family", f"importing {module} raised {_named(problem)}; correct it") from problem
    if not callable(getattr(found, name, None)):
        names = [key for key, value in vars(found).items() if callable(value) and not key.startswith("_")]
        raise settings.error("family", f"{module} has no function '{name}'; {nearest(name, names)}")
    return getattr(found, name)


def import_beside(settings: StudySettings, module: str) -> ModuleType:
    """Import a module that is installed, or lies in the study's folder."""
    folder = str(settings.folder.absolute())
    if folder not in sys.path:
        sys.path.append(folder)
    return importlib.import_module(module)


def _check(settings: StudySettings, family: DomainFamily) -> None:
    lacks = [member for member in MEMBERS if not hasattr(family, member)]
    if lacks:
        raise settings.error("family", f"{settings.family} made no domain family: it lacks {', '.join(lacks)}")
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
        try:
            family.check_agent(agent)
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
    if name not in family.parameters:
        raise settings.error(key, f"unknown parameter; {nearest(name, family.parameters)}")
    known = family.parameters[name]
    if bounds[0] < known.low or bounds[1] > known.high:
        raise settings.error(key, f"must lie within [{known.low:g}, {known.high:g}], got {given}")


def _named(problem: Exception) -> str:
    return f"{type(problem).__name__}: {' '.join(str(problem).split())}"
