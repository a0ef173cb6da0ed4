"""Files that are written whole or not at all: as a draft beside them, which takes their name once the disk has it.

Also the folders of robots and studies that travel with the package (`shipped`).
"""

import contextlib
import os
import platform
from collections.abc import Iterator
from pathlib import Path

from proxytune.errors import SettingsError


@contextlib.contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """The empty draft of a file, to be written meanwhile; what raises leaves the old file, and no draft.

    Drafts of the same file that killed processes of this machine have left are removed.

    Raises:
        OSError: If it cannot be made, brought to the disk, or take the file's name.
    """
    draft = draft_path(path)
    try:
        _clear_away(path)
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


def draft_path(path: Path) -> Path:
    """The path of this process's draft, of a file or a folder: on another machine a process may have its number."""
    return path.with_name(f"{_of_this_machine(path)}{os.getpid()}")


def _of_this_machine(path: Path) -> str:
    return f".{path.name}.{platform.node()}-"


def _clear_away(path: Path) -> None:
    """Remove what processes left that were killed while they wrote this file."""
    start = _of_this_machine(path)
    for name in os.listdir(path.parent):
        process = name.removeprefix(start)
        if name.startswith(start) and process.isdecimal() and not _is_alive(int(process)):
            with contextlib.suppress(OSError):
                path.with_name(name).unlink()


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
    """The folder `robots` or `studies`: within an installed package, or beside the package in a checkout.

    Raises:
        SettingsError: If the installation has lost the folder.
    """
    package = Path(__file__).resolve().parent
    for home in (package, package.parent):
        if (home / kind).is_dir():
            return home / kind
    raise SettingsError(f"{package}: the folder '{kind}' is missing; install proxytune again")
