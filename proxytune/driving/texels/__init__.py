"""Looking up what a camera's pixels show: by Numba where it is installed, else by NumPy, to the same bit."""

from proxytune.driving.texels.choosing import Lookup, fastest
from proxytune.driving.texels.plain import keep_colours
from proxytune.driving.texels.table import Table

__all__ = ["Lookup", "Table", "fastest", "keep_colours"]
