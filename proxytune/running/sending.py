"""Work as it goes to other processes, which end with the one that sent it, and to machines with the same code."""

import faulthandler
import hashlib
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from platform import node, python_version
from typing import Any, cast

from proxytune.errors import InputError, RunError
from proxytune.extensions import Packed, describe, folders, open_folders, pack, place_of, unpack
from proxytune.identity import version_changes, versions_of

WATCH_S = 0.5
PACKAGES = ("numpy", "scipy", "scikit-learn", "pybullet", "joblib", "distributed")
HOME = Path(__file__).resolve().parent.parent
DATA = ("robots/", "studies/")
"""What a wheel has in the package and a checkout beside it."""


class NotSendableError(RunError):
    """Work that cannot go to another process."""


class OtherCodeError(InputError):
    """A machine with other code, whose results may differ."""


@dataclass(frozen=True)
class Recipe:
    """Work pickled once, and where its modules are found: a process unpickles it once.

    Attributes:
        pickled: The work.
        path: Where modules are looked for here.
        own: The user's folders whose modules it may need.
        packed: The modules of these, for a machine that does not have the folders.
        made_by: The code that another machine must have, by names and versions; none for processes of this one.
    """

    pickled: bytes
    path: tuple[str, ...]
    own: tuple[str, ...]
    packed: Packed = ()
    made_by: tuple[tuple[str, str], ...] = ()


def recipe_of(work: Callable[..., Any], made_by: Mapping[str, str] | None = None) -> Recipe:
    """Work as it is sent; with the user's modules where it goes to machines of which `made_by` is asked.

    Raises:
        NotSendableError: If it cannot be pickled.
    """
    try:
        recipe = Recipe(pickle.dumps(work), tuple(sys.path), folders())
    except Exception as problem:
        remedy = "make it of classes and functions that a module has by name, without open files, or set jobs = 1"
        line = f"what is to be run cannot be sent to other processes ({describe(problem)}){place_of(problem)}"
        raise NotSendableError(f"{line}; {remedy}") from problem
    return replace(recipe, packed=pack(recipe.own), made_by=tuple(made_by.items())) if made_by else recipe


def do_sent(recipe: Recipe, piece: Any, place: str | None = None) -> Any:
    """Do one piece of the work, in the process it was sent to.

    Args:
        recipe: The work.
        piece: The piece.
        place: Where the user's modules are unpacked; among the temporary files by default.

    Raises:
        NotSendableError: If the work cannot be loaded there.
    """
    return load_sent(recipe, place)(piece)


@lru_cache(maxsize=1)
def load_sent(recipe: Recipe, place: str | None = None) -> Callable[[Any], Any]:
    """The work, unpickled.

    Raises:
        NotSendableError: If that fails.
        OtherCodeError: If this machine has other code.
    """
    if recipe.made_by:
        check_code(dict(recipe.made_by))
    # A process that has done other work looks in that work's folders last; on another machine its own come first.
    paths = (sys.path, recipe.path) if recipe.made_by else (recipe.path, sys.path)
    sys.path[:] = dict.fromkeys(folder for path in paths for folder in path)
    unpack(recipe.packed, place) if recipe.made_by else open_folders(recipe.own)
    try:
        return cast("Callable[[Any], Any]", pickle.loads(recipe.pickled))
    except Exception as problem:
        line = f"another process cannot load what is to be run: {describe(problem)}{place_of(problem)}"
        remedy = "what it needs must be there when its modules are imported, or set jobs = 1"
        raise NotSendableError(f"{line}; {remedy}") from None


def end_with(parent: int) -> None:
    """End this process, which a parent has just started, with that parent and not before.

    After a `kill -9` it would wait for work for minutes. Ctrl-C reaches every process of a terminal; the parent answers
    it, and ends this one. Of a crash the parent tells in one line.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if "PYTHONFAULTHANDLER" not in os.environ:
        faulthandler.disable()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@cache
def made_by() -> Mapping[str, str]:
    """What results depend on besides their settings: proxytune's own code, Python and packages."""
    paths = {path.relative_to(HOME).as_posix(): path for path in sorted(HOME.rglob("*.py"))}
    own = {name: path.read_bytes() for name, path in paths.items() if not name.startswith(DATA)}
    digest = hashlib.sha256(repr(own).encode()).hexdigest()[:12]
    return {"proxytune": f"code {digest}", "Python": python_version(), **versions_of(PACKAGES)}


def check_code(theirs: Mapping[str, str]) -> None:
    """Refuse to work for a process of which the results may differ.

    Raises:
        OtherCodeError: If anything has another version there.
    """
    changes = version_changes(theirs, made_by())
    if changes:
        raise OtherCodeError(f"the worker on {node()} has {', '.join(changes)}; install the same there as here")
