"""The fastest way to look up texels that works here."""

import functools
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.texels import plain
from proxytune.driving.texels.table import Colours, Glimpses, Places, Table


class Lookup(Protocol):
    """A way to look up texels: each gives the same, to the bit."""

    def look_up(self, table: Table, places: Places) -> Glimpses:
        """The texels (n, pixels) that pixels show from these places; what is beyond the floor shows its edge."""
        ...

    def average(self, glimpses: Glimpses, weights: NDArray[np.float32], colours: Colours) -> None:
        """Write the weighted mean of glimpses into colours; exact for weights as `Blur` has them."""
        ...


@functools.cache
def fastest() -> Lookup:
    """By Numba where it works, which takes half a second to find out, else by NumPy."""
    try:
        from proxytune.driving.texels import compiled
    except Exception:  # Numba is not installed, does not know this NumPy, or finds no place for what it compiles
        return plain
    return compiled
