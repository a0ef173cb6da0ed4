"""Types of arrays, by what they hold, and how they are gone through: NumPy's buffers, compiled loops, one thread."""

import functools
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]
NORMAL_95 = 1.96  # half of a 95 % interval in standard deviations


def compiled_loops(module: str) -> ModuleType | None:
    """A module of loops that Numba compiles on import.

    None where Numba is not installed, does not know this NumPy, or finds no place for what it compiles.
    """
    try:
        return import_module(module)
    except Exception:
        return None


@contextmanager
def one_thread() -> Iterator[None]:
    """Have libraries use one thread meanwhile; also a decorator.

    Threads that share small matrices wait for each other: beside another program a diagnosis took four times as long.
    """
    with _libraries(len(sys.modules)).limit(limits=1):
        yield


@functools.lru_cache(maxsize=1)
def _libraries(modules: int) -> Any:
    """The libraries that have threads of their own, while so many modules are loaded: another may bring another.

    Looking for them takes longer than a short episode, or than a prediction.
    """
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


class SmallBuffers:
    """Let NumPy broadcast rows of thousands four times as fast: with its own buffers it first copies what is broadcast.

    Sums over arrays that are cast on the way depend on the size of buffers in their last bits.
    """

    def __enter__(self) -> None:
        self._before = np.setbufsize(1024)

    def __exit__(self, *problem: object) -> None:
        np.setbufsize(self._before)
