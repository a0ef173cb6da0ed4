"""Cosine and sine of many angles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def cosine_and_sine(angle: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The cosine and the sine of angles (…,) [rad].

    Both come from the tangent of half the angle: of that numpy has a fast form on many processors, of them none.
    """
    tangent = np.tan(0.5 * angle)
    square = tangent * tangent
    share = 1.0 / (1.0 + square)
    return (1.0 - square) * share, 2.0 * tangent * share
