"""Frames in an array: which one holds them, and the pictures of a drive."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.importing.source import Floats, Pictures
from proxytune.settings import nearest

USUAL = ("observations", "frames", "images", "obs")
SHAPE = "frames must be (N, rows, columns, 3) of uint8, as many as there are times"


def find_frames(path: Path, arrays: Mapping[str, NDArray[Any]], wanted: str, count: int) -> str:
    """The name of the array of frames; "" where there is none.

    Args:
        path: The file.
        arrays: Its arrays.
        wanted: The name asked for; "none" for no frames, "" for whichever is there.
        count: How many times there are.

    Raises:
        LogError: If the one asked for is not there, or is no array of frames.
    """
    if wanted == "none":
        return ""
    if wanted and wanted not in arrays:
        raise LogError(f"{path}: has no array '{wanted}'; {nearest(wanted, arrays)}")
    if wanted and not _is_frames(arrays[wanted], count):
        array = arrays[wanted]
        raise LogError(f"{path}: array '{wanted}' is {array.shape} of {array.dtype}; {SHAPE}")
    return wanted or next((name for name in USUAL if name in arrays and _is_frames(arrays[name], count)), "")


def pictures_of(frames: NDArray[np.uint8], times: Floats, rows: NDArray[np.bool_]) -> Pictures:
    """The pictures of some rows whose time is known.

    Args:
        frames: All frames (N, rows, columns, 3).
        times: Their times (N,) [s].
        rows: Which to take (N,).
    """
    numbers = np.flatnonzero(rows & np.isfinite(times))
    return Pictures(times[numbers], lambda: (frames[number] for number in numbers))


def _is_frames(array: NDArray[Any], count: int) -> bool:
    return array.ndim == 4 and len(array) == count and array.shape[-1] == 3 and array.dtype == np.uint8
