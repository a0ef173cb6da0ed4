"""What a loop found, in a sentence, and what to do next."""

from collections.abc import Mapping, Sequence
from typing import Any

from proxytune.closing.comparison import Compared, Level
from proxytune.report.numbers import listed, short
from proxytune.report.style import plain
from proxytune.space import Theta

MOST_NAMED = 5
OPEN = ("partly explained", "unexplained", "cannot be told")
"""Verdicts after which more is to be found."""

NEXT = " Next: "
"""What the sentence of a study has before its last part."""


def lacking(diagnosis: Mapping[str, Any]) -> str:
    """What the proxy lacks, as in "a dead band and a turn slip"; empty where it has no name."""
    camera = diagnosis["camera"] or {}
    names = [effect["name"] for effect in (*diagnosis["effects"], *camera.get("effects", ()))]
    return listed([plain(name) for name in dict.fromkeys(names)])


def answer(diagnosis: Mapping[str, Any], rows: Sequence[Compared]) -> str:
    """What the simulator lacked, and what it is worth to declare it."""
    verdict, named = diagnosis["verdict"], lacking(diagnosis)
    if all(row.after is None for row in rows):
        return f"The log shows nothing to extend the simulator by (verdict: {verdict}). {_only(rows[0])}"
    if named:
        lacked = f"The simulator lacked: {named} (verdict: {verdict})."
    else:
        lacked = f"The simulator lacked what no named effect explains (verdict: {verdict}); curves stand in for it."
    chosen = {row.key: row for row in rows}
    moved = chosen.get("error_on_bullet") or chosen.get("error")
    seen = chosen.get("markings_error") if (diagnosis["camera"] or {}).get("effects") else None
    shown = (chosen["prpv"], chosen.get("held_out"), moved, seen)
    return f"{lacked} With it, {'; '.join(_change(row) for row in shown if row)}."


def following(diagnosis: Mapping[str, Any], studied: str, model: str, theta: Theta) -> str:
    """What to do next.

    Args:
        diagnosis: What `diagnose --json` prints.
        studied: The sentence of the last study that was run.
        model: Where the model that was found lies; empty where nothing was found.
        theta: The best θ of that study.
    """
    drive, step = diagnosis.get("next_manoeuvre"), studied.rpartition(NEXT)[2]
    if drive and diagnosis["verdict"] in OPEN:
        return f"Log {drive['name']} ({drive['description']}), and close the loop with that log."
    if not model:
        return _log_more(diagnosis) if "diagnose" in step else f"{step[:1].upper()}{step[1:]}"
    known = {**diagnosis["extended"], **(diagnosis["camera"] or {}).get("extended", {})}
    rest = [f"{plain(name)} {value:.4g}" for name, value in theta.items() if name not in known]
    left = f"; what the log does not show is known from scores alone: {listed(rest)}" if rest else ""
    return f"Run your simulator with {model}, which was fitted to the log{left}."


def _log_more(diagnosis: Mapping[str, Any]) -> str:
    unseen = [plain(name) for name in diagnosis["could_not_be_seen"]]
    shows = f" that can show {listed(unseen[:MOST_NAMED])}" if unseen else ", longer and more varied"
    return f"No θ explains the scores, and this log does not tell why: log drives{shows}."


def level_text(level: Level | None, unit: str) -> str:
    """A measure with its interval, as "28 (21 to 45)"."""
    if level is None:
        return "–"
    ends = f" ({_span(level.interval)})" if level.interval else ""
    return f"{short(level.value)}{unit and ' '}{unit}{ends}"


def floor_text(level: Level | None, unit: str) -> str:
    """The noise floor: a value with its interval, or the two ends of a bracket."""
    if level is None or (level.floor is None and level.floor_ends is None):
        return "–"
    if level.floor is None and level.floor_ends:
        return f"{_span(level.floor_ends)}{unit and ' '}{unit}"
    assert level.floor is not None
    ends = f" ({_span(level.floor_ends)})" if level.floor_ends else ""
    return f"{short(level.floor)}{unit and ' '}{unit}{ends}"


def chance_text(level: Level | None) -> str:
    """What a random ranking would have."""
    return "–" if level is None or level.chance is None else f"{level.chance[0]:.1f} ± {level.chance[1]:.1f}"


def _only(row: Compared) -> str:
    return f"{row.title}: {level_text(row.before, row.unit)}."


def _change(row: Compared) -> str:
    assert row.after is not None
    before, after = level_text(row.before, row.unit), level_text(row.after, row.unit)
    if row.falls:
        return f"{row.title} falls from {before} to {after}"
    if row.after.value < row.before.value:
        overlap = "; the intervals overlap" if row.before.interval and row.after.interval else ""
        return f"{row.title} goes from {before} to {after}{overlap}"
    return f"{row.title} does not fall: {before} before, {after} after"


def _span(ends: tuple[float, float]) -> str:
    return f"{short(ends[0])} to {short(ends[1])}"
