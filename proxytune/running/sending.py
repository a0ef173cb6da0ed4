"""Work as it goes to other processes, which end with the one that sent it, and to machines with the same code."""

import faulthandler
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from multiprocessing import resource_tracker
from pathlib import Path
from platform import node, python_version
from typing import Any, TextIO, cast

import cloudpickle

from proxytune.errors import InputError, RunError
from proxytune.extensions import Packed, describe, folders, open_folders, pack, place_of, unpack
from proxytune.identity import digest, version_changes, versions_of
from proxytune.starting import LastingStream

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
    """Work pickled once, and where its modules are found: a process unpickles it once."""

    pickled: bytes  # the work
    path: tuple[str, ...]  # where modules are looked for here
    own: tuple[str, ...]  # the user's folders whose modules it may need
    packed: Packed = ()  # the modules of these, for a machine that does not have the folders
    made_by: tuple[tuple[str, str], ...] = ()  # what code another machine must have, by names and versions


def recipe_of(work: Callable[..., Any], made_by: Mapping[str, str] | None = None) -> Recipe:
    """Work as it is sent; with the user's modules where it goes to machines of which `made_by` is asked."""
    try:
        recipe = Recipe(cloudpickle.dumps(work), tuple(sys.path), folders())
    except Exception as problem:
        remedy = "make it without open files, locks and connections, or set jobs = 1"
        line = f"what is to be run cannot be sent to other processes ({describe(problem)}){place_of(problem)}"
        raise NotSendableError(f"{line}; {remedy}") from problem
    return replace(recipe, packed=pack(recipe.own), made_by=tuple(made_by.items())) if made_by else recipe


def do_sent(recipe: Recipe, piece: Any) -> Any:
    """Do one piece of the work, in the process it was sent to."""
    return load_sent(recipe)(piece)


@lru_cache(maxsize=1)
def load_sent(recipe: Recipe) -> Callable[[Any], Any]:
    """The work, unpickled."""
    if recipe.made_by:
        check_code(dict(recipe.made_by))
    # A process that has done other work looks in that work's folders last; on another machine its own come first.
    paths = (sys.path, recipe.path) if recipe.made_by else (recipe.path, sys.path)
    sys.path[:] = dict.fromkeys(folder for path in paths for folder in path)
    unpack(recipe.packed) if recipe.made_by else open_folders(recipe.own)
    try:
        return cast("Callable[[Any], Any]", pickle.loads(recipe.pickled))
    except Exception as problem:
        line = f"another process cannot load what is to be run: {describe(problem)}{place_of(problem)}"
        remedy = "what it needs must be there when its modules are imported, or set jobs = 1"
        raise NotSendableError(f"{line}; {remedy}") from None


SAFE_PATH = "PYTHONSAFEPATH"


@contextmanager
def away_from_here() -> Iterator[tuple[int, str | None]]:
    """Have processes that start meanwhile look for no module in the current folder, as Python does for -m and -c.

    Gives what each of them has to call `end_with` with.
    """
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield os.getpid(), before
    finally:
        _set_safe_path(before)


OF_TERMINALS = (signal.SIGINT, signal.SIGHUP)
"""Signals that reach every process of a terminal."""


@contextmanager
def unheard() -> Iterator[Callable[[], object]]:
    """Have processes that start meanwhile not hear signals of a terminal, until `end_with` ignores them.

    Python would answer Ctrl-C there with a traceback as long as it loads modules. This process hears of one afterwards:
    call what is given, once they have started.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, OF_TERMINALS)
    try:
        # loky starts it, and in some versions of Python that has SIGINT be heard again
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, OF_TERMINALS)
        yield lambda: signal.pthread_sigmask(signal.SIG_SETMASK, before)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _set_safe_path(value: str | None) -> None:
    os.environ.pop(SAFE_PATH, None)
    if value is not None:
        os.environ[SAFE_PATH] = value


def end_with(parent: int, safe_path: str | None) -> None:
    """End this process, which a parent has just started, with that parent and not before.

    After a `kill -9` it would wait for work for minutes. Ctrl-C, and the end of a terminal, reach every process of that
    terminal; the parent answers them, and ends this one. Of a crash the parent tells in one line. SAFE_PATH is set for
    processes that this one starts.
    """
    _set_safe_path(safe_path)
    sys.stdout, sys.stderr = (cast(TextIO, LastingStream(one)) for one in (sys.stdout, sys.stderr))
    for number in OF_TERMINALS:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, OF_TERMINALS)  # as `unheard` left them
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
    return {"proxytune": f"code {digest(own, length=12)}", "Python": python_version(), **versions_of(PACKAGES)}


def check_code(theirs: Mapping[str, str]) -> None:
    """Refuse to work for a process of which the results may differ."""
    if changes := version_changes(theirs, made_by()):
        raise OtherCodeError(f"the worker on {node()} has {', '.join(changes)}; install the same there as here")
