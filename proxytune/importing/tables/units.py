"""Units of columns: those stated, those that a column's name ends in, and whether its values fit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.source import Floats


@dataclass(frozen=True)
class Unit:
    """A unit of measurement.

    Attributes:
        name: How a column map writes it.
        quantity: What it measures, as in "length".
        factor: What a value is multiplied by to have it in the package's unit: s, m, rad, m/s, rad/s, duty.
    """

    name: str
    quantity: str
    factor: float


UNITS = {
    unit.name: unit
    for unit in (
        Unit("s", "time", 1.0),
        Unit("ms", "time", 1e-3),
        Unit("us", "time", 1e-6),
        Unit("ns", "time", 1e-9),
        Unit("m", "length", 1.0),
        Unit("cm", "length", 1e-2),
        Unit("mm", "length", 1e-3),
        Unit("km", "length", 1e3),
        Unit("rad", "angle", 1.0),
        Unit("deg", "angle", np.pi / 180.0),
        Unit("m/s", "speed", 1.0),
        Unit("cm/s", "speed", 1e-2),
        Unit("mm/s", "speed", 1e-3),
        Unit("km/h", "speed", 1.0 / 3.6),
        Unit("rad/s", "turning speed", 1.0),
        Unit("deg/s", "turning speed", np.pi / 180.0),
        Unit("rpm", "turning speed", np.pi / 30.0),
        Unit("duty", "duty", 1.0),
        Unit("percent", "duty", 1e-2),
        Unit("pwm255", "duty", 1.0 / 255.0),
        Unit("number", "number", 1.0),
    )
}
"""Every unit by its name; the first of each quantity is the package's own."""

ENDINGS = {unit.name.replace("/", "_"): unit for unit in UNITS.values() if unit.name not in ("duty", "number")} | {
    "sec": UNITS["s"],
    "nsec": UNITS["ns"],
    "mps": UNITS["m/s"],
    "radps": UNITS["rad/s"],
    "degps": UNITS["deg/s"],
    "kmh": UNITS["km/h"],
    "%": UNITS["percent"],
    "pct": UNITS["percent"],
}
"""What a column's name may end in after an underscore, blank or bracket, as in stamp_ns, pos_x [mm], v_m_s."""

EPOCHS = ((1e17, UNITS["ns"]), (1e14, UNITS["us"]), (1e11, UNITS["ms"]))
"""From which value on a stamp is no date in a greater unit: 1e11 s lie in the year 5138, 1e11 ms in 1973."""

LARGEST = {"speed": 30.0, "turning speed": 300.0, "length": 1000.0}
"""Beyond these [m/s, rad/s, m from end to end] a unit that nobody stated is doubted."""

SHORTEST_STEP_S, LONGEST_STEP_S = 1e-5, 10.0
"""Median step of stamps outside of which a unit that nobody stated is doubted."""


def own_unit(quantity: str) -> Unit:
    """The package's unit of a quantity."""
    return next(unit for unit in UNITS.values() if unit.quantity == quantity)


def plain(name: str) -> str:
    """A column's name in small letters, everything but letters, figures and % made single underscores."""
    return re.sub(r"(?:[^\w%]|_)+", "_", name.strip().lower().lstrip("%#")).strip("_")


def split_ending(name: str, quantity: str) -> tuple[str, Unit | None]:
    """The plain name of a column without its unit, and the unit where it ends in one of that quantity."""
    simple = plain(name)
    for ending in sorted(ENDINGS, key=len, reverse=True):
        stem = simple.removesuffix(f"_{ending}")
        if stem != simple and ENDINGS[ending].quantity == quantity:
            return stem.strip("_"), ENDINGS[ending]
    return simple, None


def split_unit(entry: str, quantity: str, names: Sequence[str], where: str) -> tuple[str, Unit | None]:
    """The column that an entry of a map names, and its unit where the entry states one.

    Args:
        entry: As in "stamp_ns:ns" or "yaw".
        quantity: What the column measures.
        names: Columns that the file has; one of them may hold a colon itself.
        where: What the entry belongs to, for a complaint.

    Raises:
        LogError: If the unit is unknown or of another quantity.
    """
    name, colon, unit = entry.rpartition(":")
    if entry in names or not colon or (name not in names and unit not in UNITS):
        return entry, None
    known = [known.name for known in UNITS.values() if known.quantity == quantity and quantity != "number"]
    if not known:
        raise LogError(f"{where}: has no unit; leave out ':{unit}'")
    if unit not in UNITS:
        raise LogError(f"{where}: unknown unit '{unit}'; known are: {', '.join(known)}")
    if unit not in known:
        raise LogError(f"{where}: '{unit}' is no unit of {quantity}; known are: {', '.join(known)}")
    return name, UNITS[unit]


def epoch_unit(values: Floats) -> Unit | None:
    """The unit of stamps that are too large for seconds since 1970, or None."""
    largest = np.nanmax(np.abs(values), initial=0.0)
    return next((unit for least, unit in EPOCHS if largest >= least), None)


def contradiction(unit: Unit, values: Floats) -> str:
    """What speaks against a unit that nobody stated, or nothing.

    Args:
        unit: The unit assumed.
        values: A column in that unit (N,), NaN where a cell is empty.
    """
    seen = values[np.isfinite(values)]
    if not len(seen):
        return ""
    with np.errstate(over="ignore"):
        if unit.quantity == "time":
            return _time_contradiction(seen * unit.factor)
        if unit.quantity == "angle":
            return _angle_contradiction(unit, seen)
        size = np.ptp(seen) if unit.quantity == "length" else np.abs(seen).max()
    if unit.quantity == "duty" and size * unit.factor > 1.0 + 1e-6:
        return f"{size:g} is more than full duty"
    if size * unit.factor > LARGEST.get(unit.quantity, np.inf):
        return f"{size:g} {unit.name} {'from end to end ' if unit.quantity == 'length' else ''}is much for a robot"
    return ""


def _time_contradiction(times: Floats) -> str:
    steps = np.diff(times)
    step = np.median(steps[steps > 0]) if (steps > 0).any() else 1.0
    if step < SHORTEST_STEP_S or step > LONGEST_STEP_S:
        return f"rows would be {step:.2g} s apart"
    return "stamps would lie after the year 5000" if np.abs(times).max() > 1e11 else ""


def _angle_contradiction(unit: Unit, values: Floats) -> str:
    if unit.name == "rad":
        jumps = np.abs(np.abs(np.diff(values)) - 360.0) < 30.0
        return "the values jump by 360, like degrees" if jumps.any() else ""
    low, high = values.min(), values.max()
    like_radians = (low >= -3.2 and high <= 3.2) or (low >= 0.0 and high <= 6.3)
    return f"values from {low:g} to {high:g} look like radians" if like_radians and low < high else ""
