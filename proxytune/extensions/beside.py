"""Modules of a user's folder, each folder a world of its own.

Python knows every module of a process by its name alone, so that the `family.py` of a second study would be taken for
that of the first. A folder's modules are therefore imported under a name that belongs to the folder
(`beside_my_study_1a2b3c4d.family`), and so are those of the folder that they import in turn by plain `import helper`.
The folder is also added to the end of sys.path, for what imports by text (an environment registered as "module:Class"):
what is found there, after all else, may be of any folder that this process has opened. A folder whose files name no
code is never there: a library that tries an import (`import bottleneck`) would find what lies in it.

A command that only looks runs none of what files name (`running_none`). A user's code may raise a KeyboardInterrupt of
its own: `is_users` tells the user's Ctrl-C from it. `pack` and `unpack` carry a folder's modules to another machine.
"""

import atexit
import builtins
import functools
import importlib
import io
import signal
import sys
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from functools import lru_cache
from importlib.abc import Loader
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, ClassVar

from proxytune.errors import ExtensionError
from proxytune.files import temporary_folder
from proxytune.identity import digest, modules_beside


class Interrupted(KeyboardInterrupt):
    """The user has pressed Ctrl-C; raised in the main thread."""

    latest: ClassVar[Callable[[], KeyboardInterrupt]] = KeyboardInterrupt
    """Makes the latest anew: that one itself would keep all open which it has passed."""

    def __init__(self, *known: int) -> None:
        super().__init__(*known)
        Interrupted.latest = functools.partial(type(self), *known)


def interrupt(number: int, frame: FrameType | None) -> None:
    """Handle SIGINT on the command line: raise Interrupted."""
    raise Interrupted


def is_users(problem: BaseException) -> bool:
    """True if what was raised is the user's Ctrl-C.

    Where SIGINT raises Interrupted, or is ignored as in the processes that do pieces of work, any other
    KeyboardInterrupt is not, unless it was raised on catching that one. Under another handler, as in a Python session,
    every one is.
    """
    if not isinstance(problem, KeyboardInterrupt):
        return False
    if signal.getsignal(signal.SIGINT) not in (interrupt, signal.SIG_IGN):
        return True
    return isinstance(problem, Interrupted) or isinstance(problem.__context__, Interrupted)


class Heeding:
    """Raises the user's Ctrl-C again where code that is not ours, called meanwhile, caught it or made another of it.

    Else what such code then gives would count. Use as a context.
    """

    def __enter__(self) -> None:
        self._before = Interrupted.latest

    def __exit__(self, kind: object, problem: BaseException | None, trace: object) -> None:
        if Interrupted.latest is not self._before and not (problem and is_users(problem)):
            raise Interrupted.latest()


_refusing: ContextVar[tuple[str, tuple[str, ...]] | None] = ContextVar("refusing", default=None)


@contextmanager
def running_none(command: str, but: Sequence[str] = ()) -> Iterator[None]:
    """Have code that files name beside the installed plug-ins refused meanwhile, wherever it lies.

    Args:
        command: Who refuses it.
        but: What the user has typed, as `module:attribute`: these modules run.
    """
    before = _refusing.set((command, tuple(name.partition(":")[0] for name in but)))
    try:
        yield
    finally:
        _refusing.reset(before)


def is_ours(module: str) -> bool:
    """Tell whether a module is one of proxytune's own."""
    return module.partition(".")[0] == "proxytune"


def check_runs(module: str) -> None:
    """Refuse a module that a file names, where none is run."""
    command, typed = _refusing.get() or ("", ())
    if command and module not in typed and not is_ours(module):
        named = f"module '{module}' is code, and {command} runs none that a file names"
        raise ExtensionError(f"{named}; install it as a plug-in{TYPED.get(command, '')}")


TYPED = dict.fromkeys(("diagnose", "predict", "export"), ", or name it yourself, as in --effects module:Attribute")
"""How a command is told what to run nevertheless, where it can be."""
PREFIX = "beside_"
_homes: dict[str, None] = {}
"""The names of the packages that stand for folders, in the order of their imports."""


def import_beside(module: str, folder: Path) -> ModuleType:
    """Import a module that lies in a folder, or else is installed; the folder joins sys.path unless it is ours.

    Raises:
        ExtensionError: If no code is run.
        Exception: Whatever importing it raises; ModuleNotFoundError where there is none.
    """
    check_runs(module)
    if is_ours(module):
        return importlib.import_module(module)
    home = _home(str(folder.resolve()))
    if str(folder.resolve()) not in sys.path:
        sys.path.append(str(folder.resolve()))
    name = f"{home}.{module}" if _lies_in(Path(sys.modules[home].__path__[0]), module) else module
    if name not in sys.modules:
        importlib.invalidate_caches()
    return importlib.import_module(name)


def folders() -> tuple[str, ...]:
    """The folders whose modules this process has imported; another process needs them to unpickle what came of them."""
    return tuple(folder for home in list(_homes) if home in sys.modules for folder in sys.modules[home].__path__)


def open_folders(known: Sequence[str]) -> None:
    """Let this process import the modules of these folders by the names that they had in another."""
    for folder in known:
        _home(folder)


def _home(folder: str) -> str:
    """The name under which a folder's modules are imported: that of an empty package."""
    word = "".join(letter if letter.isalnum() else "_" for letter in Path(folder).name)
    name = f"{PREFIX}{word}_{digest(folder, length=8)}"
    if name not in sys.modules:
        home = ModuleType(name, f"The modules of {folder}.")
        home.__path__ = [folder]
        sys.modules[name] = home
        _homes[name] = None
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)
    return name


def _lies_in(folder: Path, module: str) -> bool:
    top = folder / module.partition(".")[0]
    return not is_ours(module) and (top.with_name(f"{top.name}.py").is_file() or (top / "__init__.py").is_file())


class _Finder:
    """Finds modules of folders by their names there."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        home = name.partition(".")[0]
        spec = PathFinder.find_spec(name, path, target) if path and name.startswith(PREFIX) else None
        if spec is not None and spec.loader is not None:
            spec.loader = _Loader(spec.loader, home)
        return spec


class _Loader(Loader):
    """Loads a module whose own imports look in its folder first."""

    def __init__(self, loader: Any, home: str) -> None:
        self._loader, self._home = loader, home

    def create_module(self, spec: ModuleSpec) -> Any:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        vars(module)["__builtins__"] = {**vars(builtins), "__import__": functools.partial(_import, self._home)}
        if isinstance(self._loader, SourceFileLoader):
            path = self._loader.path
            # Bytecode kept beside a file may be that of what it was: Python compares whole seconds and sizes
            exec(self._loader.source_to_code(self._loader.get_data(path), path), vars(module))
        else:
            self._loader.exec_module(module)


def _import(
    home: str,
    name: str,
    globals: Mapping[str, object] | None = None,
    locals: Mapping[str, object] | None = None,
    fromlist: Sequence[str] | None = (),
    level: int = 0,
) -> ModuleType:
    """Import as `import` does in a module of a folder."""
    if level or not _lies_in(Path(sys.modules[home].__path__[0]), name):
        return builtins.__import__(name, globals, locals, fromlist or (), level)
    found = builtins.__import__(f"{home}.{name}", globals, locals, fromlist or (), 0)
    return found if fromlist else sys.modules[f"{home}.{name.partition('.')[0]}"]


Packed = tuple[tuple[str, bytes], ...]
"""Folders, each with its modules as the bytes of a ZIP file."""


def pack(folders: Sequence[str]) -> Packed:
    """The modules of folders; other files stay where they are."""
    packed = []
    for folder in folders:
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w") as archive:
            for path in modules_beside(Path(folder)):
                # No dates: the same modules are the same bytes.
                archive.writestr(zipfile.ZipInfo(path.relative_to(folder).as_posix()), path.read_bytes())
        packed.append((folder, content.getvalue()))
    return tuple(packed)


def unpack(packed: Packed) -> None:
    """Let this process import packed modules by the names that they had where they were packed."""
    for folder, content in packed:
        home, place = _home(folder), _unzipped(content)
        sys.modules[home].__path__ = [place]
        if place not in sys.path:
            sys.path.append(place)


@lru_cache(maxsize=64)
def _unzipped(content: bytes) -> str:
    """A folder of this process's own with the files; it stays as long as the process does."""
    folder = _folders.enter_context(temporary_folder())
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(folder)
    return str(folder)


_folders = ExitStack()
atexit.register(_folders.close)
