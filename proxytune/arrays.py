"""Types of arrays, by what they hold, and how they are gone through: by NumPy's buffers, or by compiled loops."""

from importlib import import_module
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]


def compiled_loops(module: str) -> ModuleType | None:
    """A module of loops that Numba compiles on import.

    None where Numba is not installed, does not know this NumPy, or finds no place for what it compiles.
    """
    try:
        return import_module(module)
    except Exception:
        return None


class SmallBuffers:
    """Let NumPy broadcast rows of thousands four times as fast: with its own buffers it first copies what is broadcast.

    Sums over arrays that are cast on the way depend on the size of buffers in their last bits.
    """

    def __enter__(self) -> None:
        self._before = np.setbufsize(1024)

    def __exit__(self, *problem: object) -> None:
        np.setbufsize(self._before)
