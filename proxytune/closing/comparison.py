"""Before and after: each measure of the proxy without what was found and with it, its interval and its floor."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from proxytune.usefulness import Assessment

Ends = tuple[float, float]


@dataclass(frozen=True)
class Level:
    """A measure of one proxy.

    Attributes:
        value: The measure.
        interval: Its 95 % interval; None where there is none.
        floor: What a perfect proxy would have; None where only a bracket, or nothing, is known.
        floor_ends: The interval of that, or the bracket; None where there is none.
        chance: Mean and standard deviation of what a ranking at random would have; None where chance has no meaning.
    """

    value: float
    interval: Ends | None
    floor: float | None = None
    floor_ends: Ends | None = None
    chance: Ends | None = None


@dataclass(frozen=True)
class Compared:
    """One measure, before and after.

    Attributes:
        key: What it is called in the JSON document.
        title: What it is of, for people.
        unit: Its unit; empty where it has none.
        before: Without what was found.
        after: With it; None where nothing was found.
        most: The largest that it can be; None where there is no such value.
    """

    key: str
    title: str
    unit: str
    before: Level
    after: Level | None
    most: int | None = None

    @property
    def falls(self) -> bool:
        """Whether it is lower after than before, beyond its intervals."""
        if self.after is None or self.after.interval is None or self.before.interval is None:
            return False
        return self.after.interval[1] < self.before.interval[0]


def prpv_level(assessment: Assessment) -> Level:
    """PRPV of an assessment."""
    inner, floor, chance = assessment.prpv_interval, assessment.noise_floor, assessment.chance
    ends, floor_ends = _ends(inner.low, inner.high), _ends(floor.low, floor.high)
    return Level(float(assessment.prpv.value), ends, floor.value, floor_ends, (chance.mean, chance.deviation))


def compare_prpv(key: str, title: str, before: Assessment, after: Assessment | None) -> Compared:
    """PRPV of the tuned proxies."""
    levels = prpv_level(before), None if after is None else prpv_level(after)
    return Compared(key, f"PRPV of {title}", "", *levels, most=before.prpv.range[1])


def compare_errors(diagnosis: Mapping[str, Any]) -> list[Compared]:
    """The errors of a diagnosis, on drives and frames that were not fitted.

    Args:
        diagnosis: What `diagnose --json` prints.
    """
    camera = diagnosis["camera"] or {}
    errors = (
        ("error", "position in windows of {:g} s, planar plant", diagnosis.get("error")),
        ("error_on_bullet", "position in windows of {:g} s, bullet plant", diagnosis.get("error_on_bullet")),
        ("markings_error", "displacement of markings", camera.get("error")),
        ("brightness_error", "brightness of the floor", camera.get("grey_error")),
    )
    return [_compare_error(key, title, error) for key, title, error in errors if error and error["before"] is not None]


def _compare_error(key: str, title: str, error: Mapping[str, Any]) -> Compared:
    scale, unit = (1000.0, "mm") if error["unit"] == "m" else (1.0, error["unit"])
    low, high = (error.get(name) for name in ("noise_floor", "noise_floor_upper"))
    bracket = _scaled((low, high), scale)
    floor = scale * low if low is not None and bracket is None else None
    before, after = (
        Level(scale * error[side], _scaled(error[f"{side}_interval"], scale), floor, bracket)
        for side in ("before", "after")
    )
    return Compared(key, title.format(error.get("horizon_s", 0.0)), unit, before, after)


def _scaled(ends: Sequence[float | None], scale: float) -> Ends | None:
    low, high = ends
    return None if low is None or high is None else (scale * low, scale * high)


def _ends(low: float | None, high: float | None) -> Ends | None:
    return None if low is None or high is None else (low, high)
