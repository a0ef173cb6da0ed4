"""A diagnosis as a page."""

from collections.abc import Mapping

from proxytune.diagnosis import LogDiagnosis
from proxytune.report.diagnosis.captions import pictures
from proxytune.report.diagnosis.notes import next_drives
from proxytune.report.diagnosis.whole import whole_headline, whole_notes, whole_tables_and_notes
from proxytune.report.page.parts import Foot, Page, Words
from proxytune.report.page.tables import terminal_tables

NEXT_STEPS = {
    "nothing missing": "use the fitted values: name model.toml as `proxy` in study.toml, or read it with "
    "`python -m proxytune predict`.",
    "explained": "name model.toml as `proxy` in study.toml and tune again with `python -m proxytune study`.",
    "partly explained": "name model.toml as `proxy` in study.toml and tune again; log more varied drives for the rest.",
    "unexplained": "log more varied drives, or try effects of your own with --effects.",
    "cannot be told": "drive the same commands several times, and diagnose the log with these drives in it.",
}
"""What to do after each verdict, where no manoeuvre would tell more."""


def diagnosis_page(found: LogDiagnosis, figures: Mapping[str, bytes], foot: Foot) -> Page:
    """A diagnosis as a page: what the terminal shows, and the figures by their names."""
    notes = whole_notes(found)
    words = [Words("What else is to be known", tuple(notes))] if notes else []
    tables = terminal_tables(whole_tables_and_notes(found))
    title = f"{found.log}: what the model lacks"
    return Page(title, f"{whole_headline(found)}.", _next_step(found), (*pictures(figures), *tables, *words), foot)


def _next_step(found: LogDiagnosis) -> str:
    """The drive that tells most, or else what to do with what was found."""
    drives = [] if found.motion is None else next_drives(found.motion)
    if drives:
        return f"{'; '.join(drives)}."
    part = found.motion or found.camera
    return "" if part is None else NEXT_STEPS[part.verdict]
