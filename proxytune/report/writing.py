"""Writing a file whole or not at all."""

import contextlib
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from proxytune.errors import RunError


def write_text(path: Path, text: str) -> None:
    """Write a text file, its folder made where missing; an interrupted write leaves the old file.

    Raises:
        RunError: If the file cannot be written.
    """
    _whole(path, "", lambda draft: draft.write_text(text, encoding="utf-8", newline="\n"))


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG; an interrupted write leaves the old file.

    Raises:
        RunError: If the file cannot be written.
    """
    _whole(path, "the figure ", lambda draft: figure.savefig(draft, format="png", dpi=200))


def write_picture(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture (rows, columns, 3) as PNG, its folder made where missing; an interrupted write leaves the old.

    Raises:
        RunError: If the file cannot be written.
    """
    _whole(path, "the picture ", lambda draft: Image.fromarray(picture).save(draft, format="png"))


def write_movie(path: Path, write: Callable[[Path], object]) -> None:
    """Write a moving picture by what can encode it, its folder made where missing; an interrupted write leaves the old.

    Raises:
        RunError: If the file cannot be written.
    """
    _whole(path, "the animation ", write)


def _whole(path: Path, what: str, write: Callable[[Path], object]) -> None:
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(draft)
        draft.replace(path)
    except BaseException as problem:
        with contextlib.suppress(OSError):
            draft.unlink()
        if not isinstance(problem, OSError):
            raise
        raise RunError(f"{path}: {what}cannot be written ({problem.strerror}); fix that and run again") from None
