"""Which way texels are looked up: all give the same, so that it may change under way.

Looking up what a camera's pixels show: by Numba where it is installed, else by NumPy, to the same bit.
"""

import functools
import itertools
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.driving import plain_texels as plain
from proxytune.driving.plain_texels import Colours, Glimpses, Places, TexelTable, keep_colours

PAYS_OFF = 20_000
"""So often is NumPy used before Numba, which takes half a second to load: by then it would have saved as much."""

_uses = itertools.count()


class Lookup(Protocol):
    """A way to look up texels: each gives the same, to the bit."""

    def look_up(self, table: TexelTable, places: Places) -> Glimpses:
        """The texels (n, pixels) that pixels show from these places; what is beyond the floor shows its edge."""
        ...

    def average(self, glimpses: Glimpses, weights: NDArray[np.float32], colours: Colours) -> None:
        """Write the weighted mean of glimpses into colours; exact for weights as `Blur` has them."""
        ...


def fastest() -> Lookup:
    """The way that takes least time, loading included: asked anew for every use."""
    return by_numba() if next(_uses) >= PAYS_OFF else plain


@functools.cache
def by_numba() -> Lookup:
    """By Numba where that works, else by NumPy."""
    try:
        from proxytune.driving import compiled_texels as compiled
    except Exception:  # Numba is not installed, does not know this NumPy, or finds no place for what it compiles
        return plain
    return compiled


__all__ = ["Lookup", "TexelTable", "fastest", "keep_colours"]
