"""Writing a text file whole or not at all."""

import contextlib
import os
from pathlib import Path

from proxytune.errors import RunError


def write_text(path: Path, text: str) -> None:
    """Write a text file, its folder made where missing; an interrupted write leaves the old file.

    Raises:
        RunError: If the file cannot be written.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(text, encoding="utf-8", newline="\n")
        draft.replace(path)
    except OSError as problem:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise RunError(f"{path}: cannot be written ({problem.strerror})") from None
