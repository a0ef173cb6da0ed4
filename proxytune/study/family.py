"""The domain family that a study names, loaded and checked.

`load_family` gives proxytune's own as they are, and any other behind a guard (`UserFamily`): what a member of it raises
is one line, and agents have the study's names. `user_code` digests the code that a user brings to a study, since
failures are remembered until it changes.
"""

import functools
import inspect
import sys
from collections.abc import Mapping
from numbers import Integral
from pathlib import Path
from typing import Any, cast

from proxytune.domain import DomainFamily
from proxytune.effects import parameter_hint
from proxytune.errors import ExtensionError
from proxytune.extensions import ask, load
from proxytune.identity import digest, meaning_of, modules_beside
from proxytune.settings import nearest
from proxytune.space import Parameter
from proxytune.study.guard import UserFamily, has_member
from proxytune.study.settings import StudySettings

GIVEN = "tune"
"""The domain family of a study whose simulator is not named in a file but given to `proxytune.tune`."""
MEMBERS: Mapping[str, tuple[type, str]] = {
    "identity": (str, "text"),
    "metrics": (Mapping, "a mapping"),
    "parameters": (Mapping, "a mapping"),
    "starts": (Integral, "a whole number"),
}
"""What a domain family tells of itself, and as what."""
METHODS = ("check_agent", "run")


def load_family(settings: StudySettings, model: Path | None) -> DomainFamily:
    """Call the factory that the study names, with its [domain] table and a model; agents have the study's names.

    A module in the study's folder comes before an installed one. A user's family is asked through a guard: what any of
    its members raises is an ExtensionError of one line.

    Raises:
        InputError: If there is no such factory, or what it makes is no domain family or cannot do what is asked.
    """
    family = bare_family(settings, model)
    if type(family).__module__.startswith("proxytune.") and not settings.aliases:
        return family
    return cast(DomainFamily, UserFamily(family, settings.family, tuple(settings.aliases.items())))


def given_family(settings: StudySettings, family: Any) -> DomainFamily:
    """A family that is at hand, checked as one that a study names, behind the guard."""
    _check(settings, family)
    return cast(DomainFamily, UserFamily(family, "the simulator"))


def bare_family(settings: StudySettings, model: Path | None) -> DomainFamily:
    """The family itself, without a guard, and with agents by the names that it loads; raises as `load_family`."""
    if model is not None and not model.is_file():
        raise settings.error("proxy", f"no such file: {model}; check the path")
    if settings.family == GIVEN:
        raise settings.error("family", "is what was given in Python; call proxytune.tune again with this folder")
    with settings.complaints_about("family"):
        factory = load(settings.family, kind="family", beside=settings.folder, needs=("__call__",))
    _check_signature(settings, factory, model)
    refuse = functools.partial(settings.error, "family")
    family = ask(settings.family, lambda: factory(settings.domain, model=model), refuse=refuse)
    _check(settings, family)
    return family  # type: ignore[no-any-return]


def _check_signature(settings: StudySettings, factory: Any, model: Path | None) -> None:
    try:
        inspect.signature(factory).bind(settings.domain, model=model)
    except TypeError as problem:
        name = settings.family.rpartition(":")[2]
        remedy = f"write it as: def {name}(domain, *, model)"
        raise settings.error("family", f"{settings.family} cannot be called ({problem}); {remedy}") from None
    except ValueError:
        # What is written in C may have no signature.
        return


def _check(settings: StudySettings, family: DomainFamily) -> None:
    if lacks := [member for member in (*MEMBERS, *METHODS) if not has_member(family, member)]:
        raise settings.error("family", f"{settings.family} made no domain family: it lacks {', '.join(lacks)}")
    for member, (kind, word) in MEMBERS.items():
        what, refuse = f"{member} of {settings.family}", functools.partial(settings.error, "family")
        value = ask(what, functools.partial(getattr, family, member), refuse=refuse)
        if not isinstance(value, kind):
            raise settings.error("family", f"{what} must be {word}, got {type(value).__name__}")
    check_box(settings, family)
    if settings.starts > family.starts:
        raise settings.error("starts", f"the family has {family.starts}, got {settings.starts}")
    for metric in settings.metrics:
        if metric.name not in family.metrics:
            raise settings.error("metrics", f"unknown metric '{metric.name}'; {nearest(metric.name, family.metrics)}")
    for agent, name in zip(settings.agents, settings.loaded_agents, strict=True):
        key = f"agents.{agent}" if agent in settings.aliases else "agents"
        with settings.complaints_about("held_out" if agent in settings.held_out else key):
            ask(f"check_agent('{name}') of {settings.family}", functools.partial(family.check_agent, name))


def check_box(settings: StudySettings, family: DomainFamily) -> None:
    """Refuse parameters of the box that the family has not, or beyond what they can be: a SettingsError says which."""
    for interval in settings.space.intervals:
        given = f"[{interval.low:g}, {interval.high:g}]"
        bounds = (interval.low, interval.high)
        check_bounds(settings, family, f"parameters.{interval.name}", interval.name, bounds, given)


def check_bounds(
    settings: StudySettings, family: DomainFamily, key: str, name: str, bounds: tuple[float, float], given: str
) -> None:
    """Refuse values of a parameter that the family has not, or beyond what it can be: a SettingsError says which."""
    try:
        known = family.parameters.get(name)
    except ExtensionError as problem:
        raise settings.error(key, str(problem)) from None
    if known is None:
        raise settings.error(key, f"unknown parameter; {parameter_hint(name, family.parameters)}")
    if not isinstance(known, Parameter):
        kind = type(known).__name__
        raise settings.error("family", f"parameters['{name}'] of {settings.family} must be a Parameter, got {kind}")
    if bounds[0] < known.low or bounds[1] > known.high:
        raise settings.error(key, f"must lie within [{known.low:g}, {known.high:g}], got {given}")


def user_code(settings: StudySettings) -> str:
    """A digest of the modules in a study's folder, and of installed ones that its family and its agents come from.

    Modules that these import in turn are not looked at where they lie elsewhere.
    """
    names = {name.partition(":")[0] for name in (settings.family, *settings.loaded_agents) if ":" in name}
    files = [
        getattr(sys.modules.get(name), "__file__", None) for name in sorted(names) if not name.startswith("proxytune.")
    ]
    # A module may have no file.
    installed = [meaning_of([Path(f)], Path(f).parent) if f and Path(f).is_file() else "" for f in files]
    return digest(meaning_of(modules_beside(settings.folder), settings.folder), installed)
