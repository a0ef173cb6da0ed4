"""The files that a study makes in its folder are its own: a link in their place could lead anywhere."""

import os
import stat
from pathlib import Path

from proxytune.errors import StoreError

FAMILIES = "families"
"""The folder in which each family of a study has its own."""
NAMES = ("study.lock", "study.db", FAMILIES, "figures", "loop", "rescored", "teaching")
"""What running a study writes to or into; what else it writes replaces whatever has the name."""


def refuse_links(folder: Path) -> None:
    """Refuse a study in which a symbolic link is in the place of something that running it writes to or into.

    Of a family's folder, that and the one of all families are such places too.

    Raises:
        StoreError: If there is one.
    """
    if is_of_family(folder):
        for own in (folder, folder.parent):
            if own.is_symlink():
                raise _link(own)
    for name in NAMES:
        if (folder / name).is_symlink():
            raise _link(folder / name)
        for here, folders, _ in os.walk(folder / name):
            for link in (Path(here, one) for one in folders if Path(here, one).is_symlink()):
                raise _link(link)


def is_of_family(folder: Path) -> bool:
    """Whether this is the folder of one of several families of a study."""
    return folder.parent.name == FAMILIES and not (folder / "study.toml").exists()


def open_own(path: Path) -> int:
    """Open a file of a study for reading and writing, made where there is none; return its descriptor.

    Raises:
        StoreError: If it is a link, of either kind, no file, or cannot be written.
    """
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
    return StoreError(
        f"{path}: is a symbolic link, and running the study would write where it leads; "
        "remove it, or put what it leads to in its place"
    )
