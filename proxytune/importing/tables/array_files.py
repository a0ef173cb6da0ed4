"""Arrays of an .npz file as columns of one length."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.importing.tables.cells import Table
from proxytune.importing.tables.columns import usual_names

Arrays = Mapping[str, NDArray[Any]]

WIDEST = 16
"""An array of more columns is neither commands nor poses."""


def load_arrays(path: Path) -> Arrays:
    """Read every array of an .npz file.

    Raises:
        LogError: If it is no such file, is damaged, or holds pickled objects.
    """
    try:
        with path.open("rb") as stream:
            file = np.load(stream, allow_pickle=False)
            arrays = {name: np.asarray(file[name]) for name in getattr(file, "files", ())}
    except FileNotFoundError:
        raise LogError(f"{path}: no such file; check the path") from None
    except Exception as problem:  # A damaged file fails in many ways: zipfile's, zlib's and numpy's own.
        if "pickle" in str(problem):
            raise LogError(f"{path}: holds pickled objects; save plain arrays of numbers with numpy.savez") from None
        raise LogError(f"{path}: is damaged, or no .npz file; save the arrays again with numpy.savez") from None
    if not arrays:
        raise LogError(f"{path}: holds no named arrays; save them with numpy.savez(file, times=…, actions=…, …)")
    return arrays


def as_table(path: Path, arrays: Arrays, times: str) -> Table:
    """The arrays that are as long as the times, as a table: states[0], states[1] are columns of `states`.

    An array `actions` that is one shorter, as no action follows the last pose, ends with an empty row.

    Args:
        path: The file.
        arrays: Its arrays.
        times: What a column map says of the times, or "".

    Raises:
        LogError: If there are no times.
    """
    count = len(arrays[_times(path, arrays, times)])
    if not count:
        raise LogError(f"{path}: its arrays are empty; record a drive")
    columns: dict[str, NDArray[Any]] = {}
    for name, array in arrays.items():
        if name.startswith("action") and array.ndim == 2 and len(array) == count - 1 and array.dtype.kind in "iuf":
            array = np.vstack((array, np.full((1, array.shape[1]), np.nan)))
        columns |= _flattened(name, array, count)
    return Table(path, pd.DataFrame(columns, index=range(1, count + 1)), "row")


def shapes(arrays: Arrays) -> str:
    """The arrays and their shapes, for a complaint."""
    return ", ".join(f"{name} {array.shape}" for name, array in arrays.items())


def _times(path: Path, arrays: Arrays, stated: str) -> str:
    if stated:
        names = [name for name in (stated, stated.rpartition(":")[0]) if name in arrays]
    else:
        names = usual_names("time", list(arrays))
    if len(names) != 1 or arrays[names[0]].ndim != 1:
        raise LogError(
            f"{path}: which array (N,) holds the times is not clear; its arrays are: {shapes(arrays)}; "
            "say it, as in --columns time=timestamps:s"
        )
    return names[0]


def _flattened(name: str, array: NDArray[Any], count: int) -> dict[str, NDArray[Any]]:
    """The columns of an array; none where it is of another length or does not hold numbers."""
    if (
        array.ndim not in (1, 2)
        or len(array) != count
        or array.dtype.kind not in ("iufU" if array.ndim == 1 else "iuf")
    ):
        return {}
    if array.ndim == 1:
        return {name: array}
    if array.shape[1] == 1:
        return {name: array[:, 0]}
    return {f"{name}[{place}]": column for place, column in enumerate(array.T)} if array.shape[1] <= WIDEST else {}
