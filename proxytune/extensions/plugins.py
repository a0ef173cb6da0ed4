"""Plug-ins: entry points of installed packages that add something to proxytune."""

import sys
from collections.abc import Collection, Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType

from proxytune.errors import ExtensionError

GROUP = "proxytune"
"""The group of entry points; each is called `KIND.NAME`."""


def plugins(kind: str, shipped: Collection[str] = ()) -> Mapping[str, EntryPoint]:
    """The installed plug-ins of a kind by name, sorted; none of them is imported.

    Args:
        kind: What they add, as `effect`.
        shipped: Names that proxytune itself has of that kind.

    Raises:
        ExtensionError: If two have one name, or one is called like something shipped.
    """
    found: dict[str, EntryPoint] = {}
    for point in _installed(tuple(sys.path)):
        of_kind, _, name = point.name.partition(".")
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


@lru_cache(maxsize=1)
def _installed(path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """The entry points of every kind; `path` is sys.path, on which they depend: looking for them takes 20 ms."""
    return tuple(sorted(entry_points(group=GROUP), key=lambda point: (point.name, _package(point))))


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist else point.value
