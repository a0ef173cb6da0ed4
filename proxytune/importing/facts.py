"""What a log.toml is to say besides what the source holds."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from proxytune.errors import InputError
from proxytune.logs import GEOMETRY

NONE: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Facts:
    """What only the user knows of a source.

    Attributes:
        robot: Name of the robot; empty: the log's own name.
        figures: Its wheel_radius_m, baseline_m and full_speed_m_s, where there is no folder of it.
        road: The map that pictures show: a name, or the path of a map file.
        clock_offset: Seconds that poses are stamped later than commands, "fit", or empty.
    """

    robot: str = ""
    figures: Mapping[str, float] = field(default_factory=lambda: NONE)
    road: str = ""
    clock_offset: str = ""

    @property
    def offset_s(self) -> float:
        """Seconds that poses are known to be stamped later than commands."""
        return 0.0 if self.clock_offset in ("", "fit") else float(self.clock_offset)


def finite(text: str) -> float | None:
    """The finite number that a text states, if it does."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def read_geometry(given: list[str]) -> dict[str, float]:
    """Measures of a robot from texts such as baseline_m=0.16.

    Raises:
        InputError: If one is no such figure.
    """
    geometry = {}
    for text in given:
        key, _, value = text.partition("=")
        if key.strip() not in GEOMETRY:
            raise InputError(f"--figure {text}: write one of {', '.join(GEOMETRY)}, as in baseline_m=0.16")
        number = finite(value)
        if number is None or number <= 0.0:
            raise InputError(f"--figure {text}: '{value}' is no length or speed; write it as in {key}=0.16")
        geometry[key.strip()] = number
    return geometry
