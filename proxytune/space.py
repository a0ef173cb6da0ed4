"""Parameters with units and bounds, and the box of them that a study searches."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from proxytune.errors import SettingsError

Theta = Mapping[str, float]
"""A point of the domain family: parameter name to value, in the parameter's unit."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One tunable figure of an effect.

    Attributes:
        name: What it is called within its effect.
        unit: Its unit, empty where it has none.
        low: Smallest value that it can have.
        high: Largest value that it can have.
        neutral: The value at which the effect vanishes, or the name of the robot's nominal
            figure that the effect replaces.
        probes: Values that a search for a missing effect starts from.
        source: Where the bounds come from.
        shape: Whether it only shapes what the effect's first parameter does: alone it changes nothing.
        usual: The range of most robots, in which a value is looked for first; None where it is all that there is.
    """

    name: str
    unit: str
    low: float
    high: float
    neutral: float | str
    probes: tuple[float, ...] = ()
    source: str = ""
    shape: bool = False
    # Identities of episodes are digests of reprs, and no episode depends on where a value is looked for.
    usual: tuple[float, float] | None = field(default=None, repr=False)

    @property
    def usual_range(self) -> tuple[float, float]:
        """The range in which a value is looked for first."""
        return self.usual or (self.low, self.high)

    def neutral_value(self, nominal: Mapping[str, float]) -> float:
        """The neutral value for a robot with these nominal figures."""
        return nominal[self.neutral] if isinstance(self.neutral, str) else self.neutral

    def clipped(self, value: float) -> float:
        """The nearest value within the bounds."""
        return min(max(value, self.low), self.high)


@dataclass(frozen=True)
class Interval:
    """One side of a search box; a SettingsError if bounds are not finite, reversed, or equal but for rounding."""

    name: str
    low: float
    high: float
    unit: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            raise SettingsError(f"{self.name}: bounds must be finite, got [{self.low}, {self.high}]")
        if self.low >= self.high:
            raise SettingsError(
                f"{self.name}: the lower bound must be below the upper one, got [{self.low}, {self.high}]"
            )
        if not max(1e-9 * max(abs(self.low), abs(self.high)), 1e-100) < self.high - self.low < math.inf:
            apart = "bounds must be further apart than rounding, and not infinitely far"
            raise SettingsError(f"{self.name}: {apart}, got [{self.low}, {self.high}]")


@dataclass(frozen=True)
class Space:
    """The box of θ that a study searches, one interval per parameter in a fixed order."""

    intervals: tuple[Interval, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of the box."""
        return tuple(interval.name for interval in self.intervals)

    def theta(self, values: tuple[float, ...]) -> dict[str, float]:
        """Name the values of a point given in the order of the box."""
        return dict(zip(self.names, (float(value) for value in values), strict=True))

    def values(self, theta: Theta) -> tuple[float, ...]:
        """A point's values in the order of the box."""
        return tuple(float(theta[name]) for name in self.names)
