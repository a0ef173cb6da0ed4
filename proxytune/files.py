"""Files and folders that are written whole or not at all: as a draft beside them, which takes their name at last.

Where that cannot be is told before the work that ends there (`check_place`). Also folders for the moment
(`temporary_folder`), tables as CSV, and what travels with the package: robots and studies (`shipped`), templates.
"""

import contextlib
import csv
import errno
import fcntl
import filecmp
import io
import os
import platform
import shutil
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from string import Template
from typing import Any

from proxytune.errors import InputError, ProxytuneError, RunError, SettingsError

OF_FOLDERS = (".toml", ".db", ".py")
"""What a study or a robot is read from by its folder: settings, its database and modules."""


def check_place(path: Path, *, folder: bool = False, ours: bool = False, inputs: Iterable[str | Path] = ()) -> None:
    """Refuse a file or folder that cannot be written, before the work begins that ends there.

    Args:
        path: The file or folder; it, and folders on the way, need not be there.
        folder: Whether it is a folder.
        ours: Whether its name is ours, in a folder that the user has given.
        inputs: What the work reads; a folder stands for the settings, databases and modules in it.

    Raises:
        InputError: If something else or an input is there, or nothing may be written there.
    """
    whole = path.absolute()
    read = list(map(Path, inputs))
    read += [one / path.name for one in read] if path.suffix in OF_FOLDERS else []
    if path.exists() and any(file.exists() and path.samefile(file) for file in read):
        raise InputError(f"{path}: is read by this command, and would be lost; give another name")
    there = next(place for place in (whole, *whole.parents) if os.path.lexists(place))
    if there == whole and there.exists() and not (there.is_dir() if folder else there.is_file()):
        what = "a folder" if there.is_dir() else "a file" if there.is_file() else "a device or a pipe"
        other = "another folder" if folder else "the name of a file in it" if there.is_dir() else "that of a file"
        raise InputError(f"{path}: is {what}; {'move it away' if ours else f'give {other}'}")
    within = there if folder or there != whole else there.parent
    if not within.is_dir():
        remedy = "move that away" if ours else "choose another place"
        raise InputError(f"{path}: cannot be written there, as {within} is no folder; {remedy}")
    if not os.access(within, os.W_OK | os.X_OK):
        remedy = "copy the study elsewhere" if ours else "choose another place"
        raise InputError(f"{path}: cannot be written there, as {within} is closed to you; {remedy}")


@contextlib.contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """The empty draft of a file, to be written meanwhile; what raises leaves the old file, and no draft.

    Drafts beside it that killed processes have left are removed: a file that one began may never be written again.

    Raises:
        OSError: If it cannot be made, brought to the disk, or take the file's name.
    """
    draft = draft_path(path)
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise OSError(errno.EEXIST, "a device or a pipe is there", str(path))
        _clear_away(path.parent)
        # What lies there may be left of a killed process, or a link that leads elsewhere.
        draft.unlink(missing_ok=True)
        os.close(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666))
        yield draft
        _to_disk(draft)
        draft.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise


@contextlib.contextmanager
def folder_draft_of(path: Path) -> Iterator[Path]:
    """The empty draft of a folder, to be filled meanwhile; what raises leaves neither folder nor draft.

    A folder that is there is left alone if it holds the very same files, as after a command that was killed when all
    was done, and replaced if it is empty.

    Raises:
        FileExistsError: If something else is there.
        OSError: If it cannot be made, or take the folder's name.
    """
    draft = draft_path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _clear_away(path.parent)
        draft.mkdir()
        yield draft
        if not path.is_dir() or not any(path.iterdir()):
            draft.replace(path)
        elif not _alike(path, draft):
            raise FileExistsError(errno.EEXIST, "is there already", str(path))
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _alike(one: Path, other: Path) -> bool:
    """True if two folders hold the same files with the same contents."""
    names, others = ({path.relative_to(home) for path in home.rglob("*") if path.is_file()} for home in (one, other))
    return names == others and all(filecmp.cmp(one / name, other / name, shallow=False) for name in names)


DRAFT = ".draft"
OLD_S = 86400.0
"""A draft of another machine, on a shared disk, has been left if nobody has touched it for so long [s]."""


def draft_path(path: Path) -> Path:
    """The path of this process's draft, of a file or a folder: on another machine a process may have its number."""
    return path.with_name(f".{path.name}.{platform.node()}-{os.getpid()}{DRAFT}")


def _clear_away(folder: Path) -> None:
    """Remove drafts that processes left in this folder that were killed while they wrote."""
    for name in os.listdir(folder):
        before, _, process = name.removesuffix(DRAFT).rpartition("-")
        if not (name.startswith(".") and name.endswith(DRAFT) and process.isdecimal()):
            continue
        left = folder / name
        with contextlib.suppress(OSError):
            ours = before.endswith(f".{platform.node()}")
            if not _is_alive(int(process)) if ours else time.time() - left.lstat().st_mtime > OLD_S:
                shutil.rmtree(left) if left.is_dir() and not left.is_symlink() else left.unlink()


TEMPORARY = "proxytune_"
NEW_S = 60.0
"""So long after it was made [s] a temporary folder may not be locked yet."""


def write_whole(
    path: Path, write: Callable[[Path], object] | str, *, what: str = "", kind: type[ProxytuneError] = RunError
) -> None:
    """Write a text, or have a draft written, and put it in the file's place once it is whole; its folder is made.

    Raises:
        ProxytuneError: Of this kind, if it cannot be written; after the path it has `what` that is, with a space.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(path) as draft:
            if isinstance(write, str):
                # A path in it may have bytes that are no UTF-8.
                draft.write_text(write, "utf-8", "backslashreplace", "\n")
            else:
                write(draft)
    except OSError as problem:
        raise kind(f"{path}: {what}cannot be written ({problem.strerror}); fix that and run again") from None


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder for the moment, where the system has such; those that killed processes have left are removed.

    It is locked, which ends with the process, however that ends. An OSError if it cannot be made.
    """
    place = Path(tempfile.gettempdir())
    for name in os.listdir(place):
        if name.startswith(TEMPORARY):
            with contextlib.suppress(OSError):
                _remove_if_left(place / name)
    folder = Path(tempfile.mkdtemp(prefix=TEMPORARY))
    lock = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def _remove_if_left(folder: Path) -> None:
    """Remove a temporary folder whose process has ended; an OSError says that it has not, or that it is not ours."""
    if time.time() - folder.lstat().st_mtime < NEW_S:
        return
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(lock)


def _is_alive(process: int) -> bool:
    """True if a process of this machine is still there."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # another user's
        pass
    return True


def _to_disk(draft: Path) -> None:
    """Wait until the disk has the file: after a power cut a name may else stand for nothing."""
    descriptor = os.open(draft, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def shipped(kind: str) -> Path:
    """The folder `robots` or `studies`, of an installed package or a checkout; a SettingsError if it is lost."""
    package = Path(__file__).resolve().parent
    for home in (package, package.parent):
        if (home / kind).is_dir():
            return home / kind
    raise SettingsError(f"{package}: the folder '{kind}' is missing; install proxytune again")


def csv_text(columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> str:
    """A table as CSV; cells without a value are empty."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([columns, *rows])
    return text.getvalue()


def package_table(name: str) -> dict[str, Any]:
    """A TOML file of the package, by its place in it."""
    return tomllib.loads((Path(__file__).parent / name).read_text(encoding="utf-8"))


def fill_template(room: str, template: str, /, **values: object) -> str:
    """The text of a file in a room's folder templates/, with values in place of its $names."""
    text = (Path(__file__).parent / room / "templates" / template).read_text(encoding="utf-8")
    return Template(text).substitute(values)
