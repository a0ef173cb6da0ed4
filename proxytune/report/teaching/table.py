"""A learning experiment for people: the paper's table 1."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from proxytune.learning.plv import Estimate
from proxytune.learning.settings import NONE
from proxytune.teaching.experiment import Experiment, TeacherResult

COLUMNS = ("proxy", "PRPV", "zero-shot", "target samples", "PLV", "reduction")
NOT_REACHED = "not reached"


def teach_table(found: Experiment, prpv: Mapping[str, float | None], files: Mapping[str, Any]) -> RenderableType:
    """The result of a learning experiment as `teach` shows it."""
    table = Table(box=None, pad_edge=False)
    for name in COLUMNS:
        table.add_column(name, justify="left" if name == "proxy" else "right")
    for row in table_rows(found, prpv):
        table.add_row(*row)
    lines = [*convergence_lines(found), *(f"{what}: {path}" for what, path in files.items())]
    return Group(table, *(Text(line) for line in lines))


def table_rows(found: Experiment, prpv: Mapping[str, float | None]) -> list[tuple[str, ...]]:
    """The rows of table 1 as texts: the learner without a proxy, then one per proxy."""
    worth = next((lesson.worth for lesson in found.teachers if lesson.worth), None)
    alone = (NONE, "", "", count(worth.without) if worth else NOT_REACHED, "", "")
    return [alone, *(_row(lesson, prpv.get(lesson.name)) for lesson in found.teachers)]


def _row(lesson: TeacherResult, prpv: float | None) -> tuple[str, ...]:
    worth, zero_shot = lesson.worth, f"{lesson.curve.mean[0]:.1f}"
    predicts = "" if prpv is None else f"{prpv:g}"
    if worth is None:
        return (lesson.name, predicts, zero_shot, "", "", "")
    return (lesson.name, predicts, zero_shot, count(worth.needed), count(worth.plv), _share(worth.reduction))


def convergence_lines(found: Experiment) -> list[str]:
    """What counts as converged, and whether the learner without a proxy has."""
    when, last = found.when, found.without.counts[-1]
    said = f"converged: a mean score of at least {when.threshold:.1f} of {found.best_score:g}, from there on"
    if found.settled:
        return [said, *(line for lesson in found.teachers for line in _told(lesson))]
    return [
        said,
        f"without a proxy the score still rises by more than {when.tolerance:g} up to {last} target samples, so it has "
        "not converged and PLV is not known; raise teaching.target_samples",
    ]


def _told(lesson: TeacherResult) -> list[str]:
    """The factor by which a proxy divides the target samples that are needed."""
    worth = lesson.worth
    if worth is None or worth.factor.value is None:
        return []
    return [f"{lesson.name}: η(∅) / η(S) = {worth.factor.value:.3g} ({_ends(worth.factor)})"]


def count(figure: Estimate) -> str:
    """A number of samples with its interval; what was not reached is said."""
    value = NOT_REACHED if figure.value is None else f"{figure.value:g}"
    ends = _ends(figure)
    return f"{value} ({ends})" if ends else value


def _ends(figure: Estimate) -> str:
    """The interval; an end that lies beyond the grid is left open."""
    if figure.low is None:
        return "" if figure.high is None else f"at most {figure.high:.4g}"
    return f"{figure.low:.4g} or more" if figure.high is None else f"{figure.low:.4g} to {figure.high:.4g}"


def _share(figure: Estimate) -> str:
    return "" if figure.value is None else f"{figure.value:.0%}"
