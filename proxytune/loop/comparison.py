"""Before and after: each measure of the proxy without what was found and with it, its interval and its noise floor.

`compare_prpv` and `compare_errors` make the rows, `answer` and `next_step` say what they come to and what to do next,
and `prpv_figure` draws PRPV.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from proxytune import report
from proxytune.effects import SHIPPED
from proxytune.space import Theta
from proxytune.usefulness import Assessment

Ends = tuple[float, float]
Known = Mapping[str, tuple[float, Ends | None]]
"""Values with their intervals, by name in θ."""


@dataclass(frozen=True)
class Level:
    """A measure of one proxy; None where something is not known."""

    value: float
    interval: Ends | None  # 95 %
    floor: float | None = None  # what a perfect proxy would have
    floor_ends: Ends | None = None  # its interval, or a bracket where no more is known of it
    chance: Ends | None = None  # mean and deviation by chance


@dataclass(frozen=True)
class Compared:
    """One measure, before and after what was found; `key` is its name in JSON, `most` the largest that it can be."""

    key: str
    title: str
    unit: str
    before: Level
    after: Level | None
    most: int | None = None

    @property
    def falls(self) -> bool:
        """True if it is lower after than before, beyond its intervals."""
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
    """The errors of a diagnosis, as `diagnose --json` prints it, on drives and frames that were not fitted."""
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
    bracket = _ends(low, high, scale=scale)
    floor = scale * low if low is not None and bracket is None else None
    before, after = (
        Level(scale * error[side], _ends(*error[f"{side}_interval"], scale=scale), floor, bracket)
        for side in ("before", "after")
    )
    return Compared(key, title.format(error.get("horizon_s", 0.0)), unit, before, after)


def _ends(low: float | None, high: float | None, *, scale: float = 1) -> Ends | None:
    return None if low is None or high is None else (scale * low, scale * high)


MOST_NAMED = 5
OPEN = ("partly explained", "unexplained", "cannot be told")
"""Verdicts after which more is to be found."""
NEXT = " Next: "
"""What the sentence of a study has before its last part."""


def added_effects(diagnosis: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The effects that were added, those on motion first."""
    return [*diagnosis["effects"], *(diagnosis["camera"] or {}).get("effects", ())]


def extended_parameters(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of the extended model with all that is known of each, by name in θ."""
    return {**diagnosis["extended"], **(diagnosis["camera"] or {}).get("extended", {})}


def lacking(diagnosis: Mapping[str, Any]) -> str:
    """List what the proxy lacks, as in "a dead band and a turn slip"; empty where it has no name."""
    names = dict.fromkeys(effect["name"] for effect in added_effects(diagnosis))
    return report.listed([report.plain(name) for name in names])


def answer(diagnosis: Mapping[str, Any], rows: Sequence[Compared]) -> str:
    """Say what the simulator lacked, and what it is worth to declare it."""
    verdict, effects = diagnosis["verdict"], added_effects(diagnosis)
    if all(row.after is None for row in rows):
        only = f"{rows[0].title}: {level_text(rows[0].before, rows[0].unit)}."
        return f"The log shows nothing to extend the simulator by (verdict: {verdict}). {only}"
    if effects:
        lacked = f"The simulator lacked: {report.findings(effects)} (verdict: {verdict})."
    else:
        lacked = f"The simulator lacked what no named effect explains (verdict: {verdict}); curves stand in for it."
    chosen = {row.key: row for row in rows}
    moved = chosen.get("error_on_bullet") or chosen.get("error")
    seen = chosen.get("markings_error") if (diagnosis["camera"] or {}).get("effects") else None
    shown = (chosen["prpv"], chosen.get("held_out"), moved, seen)
    return f"{lacked} With it, {'; '.join(_change(row) for row in shown if row)}."


def theta_table(before: Known, after: Known | None, diagnosis: Mapping[str, Any]) -> report.Table:
    """θ before and after: what scores alone told, what the log tells, and what the extended proxy has."""
    logged = extended_parameters(diagnosis).items()
    measured = {name: (one["value"], one.get("interval")) for name, one in logged if one["value"] is not None}
    extended = {} if after is None else {**{name: (value, None) for name, (value, _) in measured.items()}, **after}
    rows = []
    for name in dict.fromkeys((*before, *measured, *extended)):
        if name.endswith(".imbalance") and name not in before and measured[name][0] == 0.0:
            continue
        unit = SHIPPED.parameters[name].unit if name in SHIPPED.parameters else ""
        sides = (_known(side.get(name)) for side in (before, measured, extended))
        rows.append((report.with_unit(name.replace(".", " "), unit), *sides))
    heads = report.columns_of(("parameter",), ("before, by scores", "in the log", "after"))
    return report.Table("θ before and after", heads, tuple(rows))


def _known(known: tuple[float, Sequence[float | None] | None] | None) -> str:
    if known is None:
        return "–"
    low, high = known[1] or (None, None)
    if low is None or high is None or not low < high:
        return report.short(known[0], 4)
    # A value that is known to a part in a thousand needs no two figures of its interval.
    places = max(0, report.digits((low, high)) - (high - low < 1e-3 * abs(known[0])))
    return f"{report.fixed(known[0], places)} ({report.span((low, high), places)})"


def next_step(diagnosis: Mapping[str, Any], studied: str, model: str, theta: Theta) -> str:
    """Say what to do next, after the diagnosis and the last study that was run."""
    drive, step = diagnosis.get("next_manoeuvre"), studied.rpartition(NEXT)[2]
    if drive and diagnosis["verdict"] in OPEN:
        return f"Log {drive['name']} ({drive['description']}), and close the loop with that log."
    if not model and "diagnose" in step:
        unseen = [report.plain(name) for name in diagnosis["could_not_be_seen"]]
        shows = f" that can show {report.listed(unseen[:MOST_NAMED])}" if unseen else ", longer and more varied"
        return f"No θ explains the scores, and this log does not tell why: log drives{shows}."
    if not model:
        return f"{step[:1].upper()}{step[1:]}"
    known = extended_parameters(diagnosis)
    rest = [f"{report.plain(name)} {value:.4g}" for name, value in theta.items() if name not in known]
    left = f"; what the log does not show is known from scores alone: {report.listed(rest)}" if rest else ""
    return f"Run your simulator with {model}, which was fitted to the log{left}."


def level_text(level: Level | None, unit: str) -> str:
    """A measure with its interval, as "28 (21 to 45)"."""
    if level is None:
        return "–"
    if level.chance is not None and level.interval:
        return report.in_pairs(level.value, *level.interval)
    return report.with_span(f"{report.short(level.value)}{unit and ' '}{unit}", *(level.interval or (None, None)))


def floor_text(level: Level | None, unit: str) -> str:
    """The noise floor: a value with its interval, or the two ends of a bracket."""
    if level is not None and level.floor is not None:
        return level_text(Level(level.floor, level.floor_ends, chance=level.chance), unit)
    ends = level and level.floor_ends
    return f"{report.short_span(*ends)}{unit and ' '}{unit}" if ends else "–"


def _change(row: Compared) -> str:
    assert row.after is not None
    before, after = level_text(row.before, row.unit), level_text(row.after, row.unit)
    if row.falls:
        return f"{row.title} falls from {before} to {after}"
    if row.after.value < row.before.value:
        overlap = "; the intervals overlap" if row.before.interval and row.after.interval else ""
        return f"{row.title} goes from {before} to {after}{overlap}"
    return f"{row.title} does not fall: {before} before, {after} after"


HALF = 0.3
"""Half the width of a floor's bar."""


def prpv_figure(rows: Sequence[Compared]) -> Figure:
    """A panel per set of agents: PRPV before and after with 95 % intervals, over the bracket of the noise floor."""
    rows = [row for row in rows if row.key in ("prpv", "held_out")]
    figure, (panels,) = report.grid_of(0.62 * report.COLUMN, 1, len(rows))
    for axes, row in zip(panels, rows, strict=True):
        report.dress(axes)
        for place, (level, colour) in enumerate(((row.before, report.VERMILLION), (row.after, report.BLUE))):
            if level is not None:
                low, high = level.floor_ends or (0.0, 0.0)
                axes.fill_between([place - HALF, place + HALF], low, high, color=report.LIGHT_GREY, lw=0)
                if level.floor is not None:
                    axes.plot([place - HALF, place + HALF], [level.floor] * 2, color=report.GREY, lw=1.0)
                below, above = level.interval or (level.value, level.value)
                spread = [[max(0.0, level.value - below)], [max(0.0, above - level.value)]]
                axes.errorbar(place, level.value, yerr=spread, fmt="o", ms=5, color=colour, capsize=3, lw=1.2)
                axes.annotate(f"{level.value:.3g}", (place + 0.1, level.value), fontsize=8, color=colour, va="center")
        axes.set_xlim(-0.6, 1.6)
        axes.set_xticks([0, 1], ["before", "after"], fontsize=7)
        axes.set_ylim(bottom=0.0)
        axes.set_title("held-out agents" if row.key == "held_out" else "tuned agents", fontsize=8)
    panels[0].set_ylabel("PRPV (lower is better)", fontsize=8)
    if floor := rows[0].before.floor_ends:
        panels[0].annotate("noise floor", (-0.55, floor[1]), fontsize=7, color="0.3", va="bottom")
    return figure
