"""A learning experiment for people: the paper's table 1."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from proxytune.learning.plv import Estimate
from proxytune.learning.settings import NONE
from proxytune.teaching.experiment import Experiment, TeacherResult

COLUMNS = ("proxy", "PRPV", "zero-shot score", "samples needed", "PLV", "reduction")
NOT_REACHED, UNKNOWN = "not converged", "unknown"
CONVERGED = "converged: the mean score is at least {} and stays so"
PLV_MEANING = "PLV (proxy learning value): target samples saved by learning in the proxy first"


def teach_table(experiment: Experiment, prpv: Mapping[str, float | None], files: Mapping[str, Any]) -> RenderableType:
    """The result of a learning experiment as `teach` shows it."""
    table = Table(box=None, pad_edge=False)
    for name in COLUMNS:
        table.add_column(name, justify="left" if name == "proxy" else "right", overflow="fold")
    for row in table_rows(experiment, prpv):
        table.add_row(*row)
    lines = [PLV_MEANING, *convergence_lines(experiment), *(f"{what}: {path}" for what, path in files.items())]
    return Group(table, *(Text(line) for line in lines))


def table_rows(experiment: Experiment, prpv: Mapping[str, float | None]) -> list[tuple[str, ...]]:
    """The rows of table 1 as texts: the learner without a proxy, then one per proxy."""
    worth = next((lesson.worth for lesson in experiment.teachers if lesson.worth), None)
    alone = (NONE, "", "", count(worth.without) if worth else NOT_REACHED, "", "")
    return [alone, *(_row(lesson, prpv.get(lesson.name)) for lesson in experiment.teachers)]


def _row(lesson: TeacherResult, prpv: float | None) -> tuple[str, ...]:
    worth, zero_shot = lesson.worth, f"{lesson.curve.mean[0]:.1f}"
    predicts = "" if prpv is None else f"{prpv:g}"
    if worth is None:
        return (lesson.name, predicts, zero_shot, "", "", "")
    return (lesson.name, predicts, zero_shot, count(worth.needed), count(worth.plv, UNKNOWN), _share(worth.reduction))


def convergence_lines(experiment: Experiment) -> list[str]:
    """What counts as converged, and whether the learner without a proxy has."""
    when, last = experiment.when, experiment.without.counts[-1]
    converged = CONVERGED.format(f"{when.threshold:.1f} of {experiment.best_score:g}")
    if experiment.settled:
        return [converged, *(line for lesson in experiment.teachers for line in _say_factor(lesson))]
    return [
        converged,
        f"without a proxy the score still rises by more than {when.tolerance:g} up to {last} target samples: it has "
        "not converged and PLV is unknown; raise teaching.target_samples",
    ]


def _say_factor(lesson: TeacherResult) -> list[str]:
    """The factor by which a proxy divides the target samples that are needed."""
    worth = lesson.worth
    if worth is None or worth.factor.value is None:
        return []
    factor = f"{worth.factor.value:.3g} ({_ends(worth.factor)})"
    return [f"{lesson.name}: samples needed without the proxy / with it = {factor}"]


def count(figure: Estimate, missing: str = NOT_REACHED) -> str:
    """A number of samples with its interval; without a number, why it is missing."""
    value = missing if figure.value is None else f"{figure.value:g}"
    ends = _ends(figure)
    return f"{value} ({ends})" if ends else value


def _ends(figure: Estimate) -> str:
    """The interval; an end that lies beyond the grid is left open."""
    if figure.low is None:
        return "" if figure.high is None else f"at most {figure.high:.4g}"
    return f"{figure.low:.4g} or more" if figure.high is None else f"{figure.low:.4g} to {figure.high:.4g}"


def _share(figure: Estimate) -> str:
    return "" if figure.value is None else f"{figure.value:.0%}"
