"""Several families for people: what each predicts, teaches and costs, and the θ of each."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proxytune.report.families.words import (
    difference_text,
    differences,
    families_sentence,
    more_text,
    prpv_text,
    seconds_text,
)
from proxytune.report.numbers import short, span
from proxytune.report.study.finding import known_parameters
from proxytune.report.study.theta_table import short4
from proxytune.report.teaching.table import UNKNOWN, count
from proxytune.study import ComparedFamilies, Lesson, TunedFamily

Row = tuple[str, ...]
USES, THETA = "Which simulator, and for what (95 % intervals)", "Best θ of each"


def families_table(compared: ComparedFamilies, files: Mapping[str, Any]) -> RenderableType:
    """Several families as `study` shows them."""
    shown = [
        part
        for title, rows in (
            (USES, use_rows(compared)),
            (THETA, theta_rows(compared)),
        )
        for part in (Text(f"\n{title}", style="bold"), _table(columns_of(compared), rows))
    ]
    notes = [Text(f"note: {note}") for note in use_notes(compared)]
    return Group(
        Text(families_sentence(compared)), *shown, *notes, *(Text(f"{name}: {path}") for name, path in files.items())
    )


def columns_of(compared: ComparedFamilies) -> Row:
    """The heads of both tables: the families in the order of study.toml."""
    return ("", *(one.name for one in compared.families))


def use_rows(compared: ComparedFamilies) -> list[Row]:
    """What each family predicts, teaches (where that was asked for) and costs, a fact a row."""
    more, families = differences(compared), compared.families
    costs = compared.seconds_per_episode()
    taught = [("PLV", _plv), ("  more than highest", _more)] if compared.settings.teaching else []
    return [
        ("fresh PRPV", *(prpv_text(one.fresh) if one.fresh else UNKNOWN for one in families)),
        ("  more than lowest", *(difference_text(more[one.name]) if one.name in more else "" for one in families)),
        *((title, *(said(compared.lessons.get(one.name)) for one in families)) for title, said in taught),
        ("seconds per episode", *(seconds_text(*costs[one.name]) for one in families)),
        ("seconds of tuning", *(short(one.seconds) for one in families)),
        ("trials", *(str(len(one.result.trials)) for one in families)),
    ]


def _plv(lesson: Lesson | None) -> str:
    if lesson is None or lesson.plv is None:
        return more_text(lesson) if lesson and lesson.failure else UNKNOWN
    return count(lesson.plv, UNKNOWN)


def _more(lesson: Lesson | None) -> str:
    return "" if lesson is None or lesson.failure else more_text(lesson)


def use_notes(compared: ComparedFamilies) -> list[str]:
    """What the numbers are, and what a family's own study had to say of it."""
    lines = ["PRPV is of fresh episodes at the best θ, from the same starts and under the same seeds in every family"]
    lines += [f"{one.name}: {line}" for one in compared.families for line in _said(one)]
    lines += [f"{name}: {one.failure}" for name, one in compared.lessons.items() if one.failure]
    return lines


def _said(one: TunedFamily) -> list[str]:
    """What a family's own study has to say: a misfit, a perfect one, too few trials, and a time that was not spent."""
    result, settings = one.result, one.result.study.settings
    time, trials = settings.stop.wall_time_s or 0.0, len(result.trials)
    lines = ["no θ explains the target's scores: it lacks something"] if result.knowledge.misfit.fits is False else []
    lines += ["no difference from the target can be seen"] if result.perfect else []
    few = f"{trials} of the {settings.initial} trials of the design were run in its time: its θ is hardly tuned"
    lines += [few] if trials < settings.initial else []
    early = f"{short(one.seconds)} of {time:g} s were spent: {result.stopped or 'its trials have not ended'}"
    return lines + ([early] if one.seconds < time else [])


def theta_rows(compared: ComparedFamilies) -> list[Row]:
    """A row per parameter of any family: the best value with its 95 % interval."""
    known = [{p.name: p for p in known_parameters(one.result)} for one in compared.families]
    names = dict.fromkeys(name for one in known for name in one)
    return [(name, *(_value(one.get(name)) for one in known)) for name in names]


def _value(parameter: Any) -> str:
    if parameter is None:
        return ""
    interval = span(parameter.interval) if parameter.identified else "unidentified"
    return f"{short4(parameter.best)} {parameter.unit}".strip() + f" ({interval})"


def _table(columns: Row, rows: list[Row]) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in columns:
        table.add_column(name, overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    return table
