"""A metric: one figure of merit, and when two agents differ in it."""

import math
import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import InputError

Array = NDArray[np.float64]
ROUNDING = 1e-12
"""Differences below this fraction of a column's largest value are rounding, hence ties."""


@dataclass(frozen=True)
class Metric:
    """One figure of merit and how two agents are compared on it.

    Attributes:
        name: The column of the score table.
        direction: Whether more ("max") or less ("min") is better.
        tolerance: Differences up to this much are ties: in the metric's unit, or in percent.
        percent: Whether the tolerance is a percentage of the column's largest value in each domain.

    Raises:
        InputError: If the direction is unknown or the tolerance is negative or not finite.
    """

    name: str
    direction: Literal["max", "min"] = "max"
    tolerance: float = 0.0
    percent: bool = False

    def __post_init__(self) -> None:
        if self.direction not in ("max", "min"):
            raise InputError(f"metric '{self.name}': the direction is max or min, got '{self.direction}'")
        if not (math.isfinite(self.tolerance) and self.tolerance >= 0):
            raise InputError(f"metric '{self.name}': the tolerance must be zero or more, got {self.tolerance}")

    @classmethod
    def parse(cls, text: str) -> "Metric":
        """Read NAME:max, NAME:min:0.5 (in the metric's unit) or NAME:max:5%.

        Raises:
            InputError: If the text is of another form.
        """
        form = re.fullmatch(r"\s*([^:]+?)\s*:\s*(max|min)\s*(?::\s*([^:%]+?)\s*(%?)\s*)?", text)
        if form is None:
            raise InputError(f"metric '{text}': write NAME:max or NAME:min, with :0.5 or :5% for a tolerance")
        name, direction, tolerance, percent = form.groups()
        try:
            return cls(name, "max" if direction == "max" else "min", float(tolerance or 0), bool(percent))
        except ValueError:
            raise InputError(f"metric '{text}': the tolerance must be a number or a percentage") from None

    def __str__(self) -> str:
        """The text that parse reads."""
        tolerance = f":{self.tolerance:g}{'%' if self.percent else ''}" if self.tolerance else ""
        return f"{self.name}:{self.direction}{tolerance}"

    def merits(self, columns: Array) -> tuple[Array, Array]:
        """Put scores on a scale where more is better, and say which differences count.

        A percentage divides each column by its largest absolute value (and takes that from 1 where less is
        better), as the paper's authors did in their pilot, so that their figures come out to the last pair.

        Args:
            columns: One value per agent on the last axis, any number of tables on the others.

        Returns:
            The merits, of the same shape, and the largest difference that is still a tie, shape (…, 1).
        """
        largest = np.abs(columns).max(axis=-1, keepdims=True)
        if not self.percent:
            signed = columns if self.direction == "max" else -columns
            return signed, np.maximum(self.tolerance, ROUNDING * largest)
        shares = columns / np.where(largest > 0, largest, 1.0)
        merits = shares if self.direction == "max" else 1.0 - shares
        return merits, np.full_like(largest, max(self.tolerance / 100, ROUNDING))


def varies(columns: Array) -> NDArray[np.bool_]:
    """Whether agents differ in a metric by more than rounding: one value per agent on the last axis but one."""
    largest = np.abs(columns).max(axis=-2)
    return np.asarray(np.ptp(columns, axis=-2) > ROUNDING * largest, dtype=np.bool_)
