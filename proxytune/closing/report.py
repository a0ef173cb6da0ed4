"""A closed loop as one JSON document and one page."""

from dataclasses import asdict
from typing import Any

from proxytune.closing.closed import Closed
from proxytune.closing.comparison import Compared, compare_errors, compare_prpv
from proxytune.closing.episodes import read_pictures
from proxytune.closing.figure import prpv_figure
from proxytune.closing.loop import STEPS
from proxytune.closing.righted import righted
from proxytune.closing.wording import answer, chance_text, floor_text, following, lacking, level_text
from proxytune.report.page import Foot, Page, Picture, Table, Words
from proxytune.report.writing import png_of
from proxytune.study.settings import as_document
from proxytune.versions import versions_of

COLUMNS = ("", "before", "after", "noise floor before; after", "a random ranking")
PACKAGES = ("proxytune", "numpy", "scipy", "pybullet")
PICTURES = {
    "effect_curve": ("The effect", "What was measured against what the simulator did without it, and with it."),
    "learnt": ("What was learnt", "Curves over what the robot does, for what no named effect explains."),
    "error": (
        "Motion error",
        "Error of predicted positions by how far ahead, on drives that were not fitted; lower is better.",
    ),
    "camera_markings": (
        "Markings",
        "The map's markings as the declared camera draws them on frames, and as the extended one does.",
    ),
}
"""Figures of `diagnose` that the page shows where they are there: title and caption."""


def rows_of(closed: Closed) -> list[Compared]:
    """Every measure before and after: PRPV, of held-out agents too, then the errors."""
    after = None if closed.after is None else closed.after.result.judged
    rows = [compare_prpv("prpv", "the agents tuned on", closed.before.result.judged, after)]
    if closed.held_out:
        names = len(closed.loop.held_out)
        rows.append(compare_prpv("held_out", f"{names} agents that no tuning saw", *closed.held_out))
    errors = compare_errors(closed.diagnosis)
    if closed.after is None:
        errors = [Compared(row.key, row.title, row.unit, row.before, None) for row in errors]
    return rows + errors


def document_of(closed: Closed) -> dict[str, Any]:
    """Everything that `loop --json` prints but for its files; what differs from run to run is under `this_run`."""
    rows = {row.key: _row(row) for row in rows_of(closed)}
    held_out = {"agents": list(closed.loop.held_out), **rows.pop("held_out", {"before": None, "after": None})}
    camera = closed.diagnosis["camera"] or {}
    reports = (("before", closed.before), ("after", closed.after))
    return {
        "study": closed.loop.settings.name,
        "sentence": answer(closed.diagnosis, rows_of(closed)),
        "next": _following(closed),
        "steps": list(STEPS) if closed.after else list(STEPS)[:4],
        "verdict": closed.diagnosis["verdict"],
        "effects": closed.diagnosis["effects"],
        "camera": {"verdict": camera["verdict"], "effects": camera["effects"]} if camera else None,
        "theta": {side: None if report is None else report.theta for side, report in reports},
        "prpv": {**rows.pop("prpv"), "held_out": held_out},
        "error": closed.diagnosis.get("error"),
        "errors": rows,
        "righted": righted(closed),
        "this_run": {"steps": list(closed.done), "episodes": closed.episodes},
    }


def page_of(closed: Closed, command: str, date: str) -> Page:
    """The page.

    Args:
        closed: The loop.
        command: The command that makes it, as typed in a shell.
        date: When it was written.
    """
    rows = rows_of(closed)
    prpv = [row for row in rows if row.key in ("prpv", "held_out")]
    values = {key: value for key, value in as_document(closed.loop.settings).items() if value not in (None, {}, [])}
    settings = tuple((key, _text(value)) for key, value in values.items() if key != "path")
    caption = "PRPV of the best θ on fresh episodes with 95 % intervals; grey: what a perfect proxy scores."
    shown = []
    if closed.after:
        first = Picture("PRPV before and after", png_of(prpv_figure(prpv)), caption)
        shown = [first, *read_pictures(closed.loop.home)]
    return Page(
        title=f"{closed.loop.settings.name}: the loop closed",
        answer=answer(closed.diagnosis, rows),
        following=_following(closed),
        parts=(_table(closed, rows), *shown, *_found(closed), _words(closed)),
        foot=Foot(command, settings, tuple(versions_of(PACKAGES).items()), date),
    )


def table_rows(rows: list[Compared]) -> list[tuple[str, ...]]:
    """The table's cells as COLUMNS says."""
    return [
        (
            f"{row.title}, 0 to {row.most}" if row.most else row.title,
            level_text(row.before, row.unit),
            level_text(row.after, row.unit),
            "; ".join(dict.fromkeys(floor_text(level, row.unit) for level in (row.before, row.after) if level)),
            "; ".join(dict.fromkeys(chance_text(level) for level in (row.before, row.after) if level)),
        )
        for row in rows
    ]


def notes_of(closed: Closed) -> list[str]:
    """What the table does not hold."""
    counted = "PRPV (proxy relative predictivity value) counts wrongly ordered pairs of agents at the best θ"
    notes = [f"{counted}; in brackets 95 % intervals"]
    if closed.after and not closed.held_out:
        notes.append(
            "no agent was held out: name at least three under held_out in study.toml that the target has scores of"
        )
    return notes


def _table(closed: Closed, rows: list[Compared]) -> Table:
    return Table("Before and after", COLUMNS, tuple(table_rows(rows)), tuple(notes_of(closed)))


def _words(closed: Closed) -> Words:
    found = lacking(closed.diagnosis) or "nothing that has a name"
    paragraphs = (
        f"Found: {found}; verdict: {closed.diagnosis['verdict']}.",
        f"Before: {closed.before.sentence}",
        *((f"After: {closed.after.sentence}",) if closed.after else ()),
    )
    return Words("What each step said", paragraphs)


def _found(closed: Closed) -> list[Picture]:
    """The figures that `diagnose` wrote."""
    home = closed.loop.home / "diagnosed"
    there = {name: home / f"{name}.png" for name in PICTURES if (home / f"{name}.png").is_file()}
    return [Picture(PICTURES[name][0], path.read_bytes(), PICTURES[name][1]) for name, path in there.items()]


def _following(closed: Closed) -> str:
    last, model = closed.after or closed.before, closed.loop.home / "diagnosed" / "model.toml"
    return following(closed.diagnosis, last.sentence, str(model) if closed.after else "", last.theta)


def _row(row: Compared) -> dict[str, Any]:
    levels = {"before": asdict(row.before), "after": None if row.after is None else asdict(row.after)}
    return levels | ({"most": row.most} if row.most else {"unit": row.unit})


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)
