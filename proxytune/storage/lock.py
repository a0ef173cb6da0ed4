"""One process per study: a lock that dies with its holder."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from proxytune.errors import BusyError, StoreError
from proxytune.storage.own_files import is_of_family, open_own, refuse_links

FILE_NAME = "study.lock"


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
        _make(folder)
    path = folder / FILE_NAME
    descriptor = _acquire(path)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(descriptor)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise StoreError(f"{folder}: cannot be created ({problem.strerror}); copy the study elsewhere") from None


def _acquire(path: Path) -> int:
    while True:
        descriptor = open_own(path)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(descriptor, 32, 0).decode(errors="replace").strip()
            os.close(descriptor)
            whose = f" (process {holder})" if holder else ""
            raise BusyError(
                f"{path.parent}: another process{whose} is running this study; wait for it or stop it"
            ) from None
        if _is_at(descriptor, path):
            _write(descriptor, path)
            return descriptor
        # The holder before us removed the file between our opening and locking it.
        os.close(descriptor)


def _write(descriptor: int, path: Path) -> None:
    try:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
    except OSError as problem:
        os.close(descriptor)
        raise StoreError(f"{path.parent}: cannot be written ({problem.strerror}); make room for the study") from None


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.lstat(path))
    except FileNotFoundError:
        return False
