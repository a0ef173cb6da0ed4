"""Whose code may be run: who starts a command is asked before code beside a study runs for the first time.

A caller of Python's API has chosen what to run: nothing is asked there.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

Permit = Callable[[Path, str], None]
"""Raises an ExtensionError unless a module may be run that is named by something in a folder."""

_permit: ContextVar[Permit | None] = ContextVar("permit", default=None)


@contextmanager
def permitting(permit: Permit) -> Iterator[None]:
    """Have every module that is named beside a study permitted before it is imported."""
    before = _permit.set(permit)
    try:
        yield
    finally:
        _permit.reset(before)


def check_permitted(module: str, folder: Path) -> None:
    """Refuse a module that a folder's files name, unless whoever is responsible permits it.

    An installed plug-in is permitted by having been installed, and proxytune's own modules are ours.

    Raises:
        ExtensionError: If it is not permitted.
    """
    permit = _permit.get()
    if permit is not None and module.partition(".")[0] != "proxytune":
        permit(folder, module)
