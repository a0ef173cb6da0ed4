"""A study's folder: one process at a time runs it, and what it makes there leads nowhere else.

The lock is our own: `filelock` leaves its file behind, does not say who holds it, and takes a hard link for a lock, so
that all here but one call of `flock` would stay.
"""

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from proxytune.errors import BusyError, StoreError

LOCK = "study.lock"
FAMILIES = "families"
"""The folder in which each family of a study has its own."""
MADE = (FAMILIES, "figures", "loop", "rescored", "teaching")
"""Folders that running a study makes."""
NAMES = (LOCK, "study.db", *MADE)
"""What running a study writes to or into; what else it writes replaces whatever has the name."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the study in this folder. The kernel lets go of it when the process ends, however it ends.

    The folder of one of several families is made where there is none.

    Raises:
        BusyError: If another process holds it, with that process's id.
        StoreError: If the folder cannot be written, or has links where a study writes.
    """
    refuse_links(folder)
    if is_of_family(folder):
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise StoreError(f"{folder}: cannot be created ({problem.strerror}); copy the study elsewhere") from None
    path = folder / LOCK
    descriptor = _acquire(path)
    try:
        try:
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
        except OSError as problem:
            raise StoreError(f"{folder}: cannot be written ({problem.strerror}); make room for the study") from None
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(descriptor)


def refuse_links(folder: Path) -> None:
    """Refuse a study in which a symbolic link is in the place of something that running it writes to or into.

    Of a family's folder, that and the one of all families are such places too.
    """
    own = [folder, folder.parent] if is_of_family(folder) else []
    for place in (*own, *(folder / name for name in NAMES)):
        if place.is_symlink():
            raise _link(place)
    for name in NAMES:
        for here, folders, _ in os.walk(folder / name):
            for link in (Path(here, one) for one in folders if Path(here, one).is_symlink()):
                raise _link(link)


def is_of_family(folder: Path) -> bool:
    """Tell whether this is the folder of one of several families of a study."""
    return folder.parent.name == FAMILIES and not (folder / "study.toml").exists()


def _acquire(path: Path) -> int:
    """The descriptor of the lock's file, which is locked and at its place."""
    while True:
        descriptor = _open(path)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(descriptor, 32, 0).decode(errors="replace").strip()
            os.close(descriptor)
            whose = f" (process {holder})" if holder else ""
            running = f"another process{whose} is running this study"
            raise BusyError(f"{path.parent}: {running}; wait for it or stop it") from None
        try:
            if os.path.samestat(os.fstat(descriptor), os.lstat(path)):
                return descriptor
        except FileNotFoundError:
            pass
        # The holder before us removed the file between our opening and locking it.
        os.close(descriptor)


def _open(path: Path) -> int:
    """Open a file of a study for reading and writing, made where there is none; refuse a link of either kind."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)
    except OSError as problem:
        if path.is_symlink():
            raise _link(path) from None
        raise StoreError(f"{path.parent}: cannot be written ({problem.strerror}); copy the study elsewhere") from None
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        os.close(descriptor)
        kind = "has another name elsewhere (a hard link)" if stat.S_ISREG(found.st_mode) else "is no file"
        raise StoreError(f"{path}: {kind}, and running the study would write to it; remove it")
    return descriptor


def _link(path: Path) -> StoreError:
    remedy = "remove it, or put what it leads to in its place"
    return StoreError(f"{path}: is a symbolic link, and running the study would write where it leads; {remedy}")
