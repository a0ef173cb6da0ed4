"""Files that are written whole or not at all: as a draft beside them, which takes their name once the disk has it."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """The empty draft of a file, to be written meanwhile; what raises leaves the old file, and no draft.

    Raises:
        OSError: If it cannot be made, brought to the disk, or take the file's name.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        _make_anew(draft)
        yield draft
        _to_disk(draft)
        draft.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise


def _make_anew(draft: Path) -> None:
    """Make the file: what lies there may be left of a killed process, or a link that leads elsewhere."""
    draft.unlink(missing_ok=True)
    os.close(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666))


def _to_disk(draft: Path) -> None:
    """Wait until the disk has the file: after a power cut a name may else stand for nothing."""
    descriptor = os.open(draft, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
