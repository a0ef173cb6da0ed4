"""The search for what a user's name stands for, and one line for why it cannot be used.

`load` finds it among what is shipped, a folder's modules or the plug-ins (entry points of installed packages,
none of which is imported before it is named); `ask` calls it, and tells what it raised and where.
"""

import functools
import importlib
import inspect
import os
import sys
import sysconfig
import traceback
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, distributions
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, TypeVar

from proxytune.errors import ExtensionError, ProxytuneError
from proxytune.extensions.beside import Heeding, check_runs, folders, import_beside, is_users
from proxytune.settings import nearest

GROUP = "proxytune"
"""The group of entry points; each is called `KIND.NAME`."""
KINDS = ("agent", "effect", "engine", "environment", "family", "learner", "measure", "robot")


def plugins(kind: str, shipped: Collection[str] = ()) -> Mapping[str, EntryPoint]:
    """The installed plug-ins of a kind by name, sorted; none of them is imported.

    Args:
        kind: What they add, as `effect`.
        shipped: Names that proxytune itself has of that kind.

    Raises:
        ExtensionError: If two have one name, one is called like something shipped, or one is of no known kind.
    """
    found: dict[str, EntryPoint] = {}
    for point in _installed(_path()):
        of_kind, _, name = point.name.partition(".")
        if of_kind not in KINDS:
            whose = f"plug-in '{point.name}' of {_package(point)}"
            raise ExtensionError(f"{whose} must be called KIND.NAME; {nearest(of_kind, KINDS)}")
        if of_kind != kind:
            continue
        if not name.replace("-", "_").isidentifier():
            raise ExtensionError(f"plug-in '{point.name}' of {_package(point)} must be called {kind}.NAME, one word")
        if name in shipped:
            whose = f"plug-in '{point.name}' of {_package(point)}"
            raise ExtensionError(f"{whose} has the name of a shipped {kind}; rename it or uninstall it")
        if name in found:
            both = f"{_package(found[name])} and {_package(point)}"
            raise ExtensionError(f"plug-in '{point.name}' is in both {both}; uninstall one of them")
        found[name] = point
    return MappingProxyType(found)


def _path() -> tuple[str, ...]:
    """Where packages are installed: sys.path without the current folder and those of studies, which hold anything."""
    try:
        return _without(tuple(sys.path), tuple(folders()), os.getcwd())
    except FileNotFoundError:  # It has been deleted
        return tuple(filter(None, sys.path))


@lru_cache(maxsize=1)
def _without(path: tuple[str, ...], users: tuple[str, ...], here: str) -> tuple[str, ...]:
    left_out = {*map(os.path.realpath, users), here}
    return tuple(place for place in path if os.path.realpath(place) not in left_out)


@lru_cache(maxsize=1)
def _installed(path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """The entry points of every kind on a path: looking for them takes 20 ms."""
    found: dict[str, Iterable[EntryPoint]] = {}
    for package in distributions(path=list(path)):
        own = package.entry_points.select(group=GROUP)
        if own:  # Of two versions the first counts, as it does for imports
            found.setdefault(package.name, own)
    points = (point for own in found.values() for point in own)
    return tuple(sorted(points, key=lambda point: (point.name, _package(point))))


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist else point.value


NOT_USERS = (
    Path(__file__).resolve().parents[1],
    *(Path(sysconfig.get_path(kind)).resolve() for kind in ("stdlib", "platstdlib", "purelib", "platlib")),
)
"""Folders of code that is ours, Python's or installed."""
NONE: Mapping[str, Any] = MappingProxyType({})
Answer = TypeVar("Answer")


def load(
    name: str,
    *,
    kind: str,
    beside: Path | None = None,
    needs: Iterable[str] = (),
    shipped: Mapping[str, Any] = NONE,
    call: bool = False,
) -> Any:
    """Find what a name stands for: something shipped, `module:attribute`, or an installed plug-in.

    Args:
        name: `module:attribute`, or a plain name.
        kind: What it is to be, as people call it and as plug-ins are named: agent, effect, engine, family, learner.
        beside: The folder whose modules come before the installed ones.
        needs: Members that it must have.
        shipped: What proxytune itself has of this kind, by name.
        call: Whether a class, or what lacks the members, is called without arguments for what has them.

    Raises:
        ExtensionError: If there is no such thing, it may not be run, importing or calling it fails, or it lacks a
            member.
    """
    if ":" in name:
        found = _attribute(name, kind, beside)
    else:
        installed = plugins(kind, shipped)
        found = shipped[name] if name in shipped else _plugin(name, kind, installed, shipped)
    needs = tuple(needs)
    if call and callable(found) and (inspect.isclass(found) or _lacks(found, needs)):
        found = ask(f"{kind} '{name}'", found)
    require(found, needs, name=name, kind=kind)
    return found


def ask(
    what: str, question: Callable[[], Answer], where: str = "", refuse: Callable[[str], Exception] = ExtensionError
) -> Answer:
    """Ask code that is not ours.

    Args:
        what: Whose it is, as a complaint names it.
        question: Asks it.
        where: On what it was tried, as a complaint goes on.
        refuse: Makes an error of the complaint.

    Raises:
        ExtensionError: In one line, or what `refuse` makes, if it raises anything but an error of ours, or exits.
    """
    try:
        with Heeding():
            return question()
    except ProxytuneError:
        raise
    except BaseException as problem:
        if is_users(problem):
            raise
        raise refuse(f"{what} raised {describe(problem)}{place_of(problem)}{where}; correct it") from problem


def require(found: Any, needs: Iterable[str], *, name: str, kind: str) -> None:
    """Refuse by an ExtensionError a thing that is not what its name claims: it lacks one of these members."""
    if lacks := _lacks(found, needs):
        raise ExtensionError(f"{kind} '{name}' lacks {', '.join(lacks)}; add what every {kind} must have")


def describe(problem: BaseException) -> str:
    """An exception in one line."""
    try:
        said = one_line(str(problem))
    except Exception:  # Its own __str__ fails.
        said = ""
    return f"{type(problem).__name__}: {said}".rstrip(": ")


def one_line(text: str) -> str:
    """A text without line breaks, and of letters that every file can hold."""
    return " ".join(text.split()).encode(errors="backslashreplace").decode()


def place_of(problem: BaseException | None) -> str:
    """The place in code that is neither ours nor installed where an exception arose, in brackets; empty if nowhere."""
    for frame in reversed(traceback.extract_tb(problem.__traceback__) if problem else []):
        path = Path(frame.filename).resolve()
        if path.is_file() and not any(path.is_relative_to(folder) for folder in NOT_USERS):
            return f" ({Path(frame.filename).name}, line {frame.lineno})"
    return ""


def _lacks(found: Any, needs: Iterable[str]) -> list[str]:
    return [member for member in needs if not hasattr(found, member)]


def _attribute(name: str, kind: str, beside: Path | None) -> Any:
    module, _, attribute = name.partition(":")
    if not (module and attribute) or not all(module.split(".")):
        raise ExtensionError(f"{kind} '{name}': must be written module:attribute")
    found = _imported(name, kind, module, beside)
    if not hasattr(found, attribute):
        names = [key for key in vars(found) if not key.startswith("_")]
        raise ExtensionError(f"{kind} '{name}': {module} has no '{attribute}'; {nearest(attribute, names)}")
    return getattr(found, attribute)


def _imported(name: str, kind: str, module: str, beside: Path | None) -> ModuleType:
    if beside is None:
        check_runs(module)
    found = importlib.import_module if beside is None else functools.partial(import_beside, folder=beside)
    try:
        return ask(f"{kind} '{name}': importing {module}", lambda: found(module))
    except ExtensionError as refused:
        problem = refused.__cause__
        if isinstance(problem, ModuleNotFoundError) and f"{module}.".startswith(f"{problem.name}."):
            where = "installed" if beside is None else f"in {beside.absolute()} or installed"
            raise ExtensionError(f"{kind} '{name}': no module '{problem.name}' {where}; check the name") from None
        raise


def _plugin(name: str, kind: str, installed: Mapping[str, Any], shipped: Mapping[str, Any]) -> Any:
    if name not in installed:
        known = (*shipped, *installed)
        hint = nearest(name, known) if known else "no plug-in of this kind is installed"
        raise ExtensionError(f"{kind} '{name}' is unknown (your own is written module:attribute); {hint}")
    return ask(f"{kind} '{name}': its plug-in {installed[name].value}", installed[name].load)
