"""A learning experiment for people: the paper's table 1."""

from collections.abc import Callable, Mapping
from dataclasses import astuple
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from proxytune.learning import NONE, Costs, Estimate
from proxytune.report.numbers import fixed, short, span
from proxytune.report.teaching.observations import observation_lines
from proxytune.teaching import Experiment, Predictivity, TeacherResult, observe, teaching_settings, why_unknown

COLUMNS = ("proxy", "PRPV", "zero-shot score", "samples needed", "PLV", "reduction")
COST = "PLV in cost"
NOT_REACHED, UNKNOWN = "not converged", "unknown"
CONVERGED = "converged: the mean score is at least {} and stays so"
PLV_MEANING = "PLV (proxy learning value): target samples saved by learning in the proxy first"
COST_MEANING = (
    "PLV in cost: what these cost, in the unit of [teaching.costs]: off_policy {:g}, on_policy {:g}, label {:g}"
)


def teach_table(
    experiment: Experiment, prpv: Mapping[str, Predictivity | None], files: Mapping[str, Any]
) -> RenderableType:
    """The result of a learning experiment as `teach` shows it."""
    table = Table(box=None, pad_edge=False)
    for name in columns_of(experiment):
        table.add_column(name, justify="left" if name == "proxy" else "right", overflow="fold")
    for row in table_rows(experiment, prpv):
        table.add_row(*row)
    observations = observation_lines(observe(experiment, prpv), experiment)
    lines = [*meanings(experiment), *convergence_lines(experiment), *observations]
    lines += [f"{what}: {path}" for what, path in files.items()]
    return Group(table, *(Text(line) for line in lines))


def columns_of(experiment: Experiment) -> tuple[str, ...]:
    """The heads of table 1; PLV in cost is told where costs are stated."""
    return (*COLUMNS, COST) if _costs(experiment) else COLUMNS


def meanings(experiment: Experiment) -> list[str]:
    """What PLV is, and PLV in cost where that is told."""
    costs = _costs(experiment)
    return [PLV_MEANING, *([COST_MEANING.format(*astuple(costs))] if costs else [])]


def _costs(experiment: Experiment) -> Costs | None:
    """What target samples cost, None where that is one each, as in PLV."""
    costs = teaching_settings(experiment.settings).costs
    return None if costs == Costs() else costs


def table_rows(experiment: Experiment, prpv: Mapping[str, Predictivity | None]) -> list[tuple[str, ...]]:
    """The rows of table 1 as texts: the learner without a proxy, then one per proxy."""
    worth = next((lesson.worth for lesson in experiment.teachers if lesson.worth), None)
    unseen = UNKNOWN if experiment.needs.gain is None else NOT_REACHED
    alone = (NONE, "", "", count(worth.without) if worth else unseen, "", "")
    rows = [alone, *(_row(lesson, prpv.get(lesson.name)) for lesson in experiment.teachers)]
    if not _costs(experiment):
        return rows
    saved = ("", *(_cost(lesson.cost) for lesson in experiment.teachers))
    return [(*row, cost) for row, cost in zip(rows, saved, strict=True)]


def _row(lesson: TeacherResult, prpv: Predictivity | None) -> tuple[str, ...]:
    worth, zero_shot = lesson.worth, one_decimal(lesson.zero_shot)
    predicts = "" if prpv is None else f"{prpv.prpv:g}" + (f" ({span(prpv.interval, 0)})" if prpv.interval else "")
    if worth is None:
        return (lesson.name, predicts, zero_shot, "", "", "")
    return (lesson.name, predicts, zero_shot, count(worth.needed), count(worth.plv, UNKNOWN), _share(worth.reduction))


def convergence_lines(experiment: Experiment) -> list[str]:
    """What counts as converged, and whether the learner without a proxy has."""
    converged = CONVERGED.format(f"{experiment.when.threshold:.1f} of {experiment.best_score:g}")
    unknown = why_unknown(experiment.needs)
    said = [f"{unknown.reason}, so PLV is not known; {unknown.remedy}"] if unknown else []
    return [converged, *said, *(line for lesson in experiment.teachers for line in _say_factor(lesson))]


def _say_factor(lesson: TeacherResult) -> list[str]:
    """The factor by which a proxy divides the target samples that are needed."""
    worth = lesson.worth
    if worth is None or worth.factor.value is None:
        return []
    low, high = worth.factor.low, worth.factor.high
    ends = f"{low or 0.0:.2g} to {high:.2g}" if high is not None else f"{low or 0.0:.2g} or more"
    factor = f"{worth.factor.value:.2g} ({ends})"
    return [f"{lesson.name}: samples needed without the proxy / with it = {factor}"]


def count(figure: Estimate, missing: str = NOT_REACHED) -> str:
    """A number of samples with its interval; without a number, why it is missing."""
    return _with_ends(figure, missing, _samples)


def _cost(figure: Estimate | None) -> str:
    """What is saved in cost with its interval, empty where the learner without a proxy has not converged."""
    return "" if figure is None else _with_ends(figure, UNKNOWN, short)


def _with_ends(figure: Estimate, missing: str, write: Callable[[float], str]) -> str:
    value, ends = missing if figure.value is None else write(figure.value), _ends(figure, write)
    return f"{value} ({ends})" if ends else value


def one_decimal(figure: Estimate) -> str:
    """A score, empty where there is none."""
    return "" if figure.value is None else fixed(figure.value, 1)


def _ends(figure: Estimate, write: Callable[[float], str]) -> str:
    """An interval; an end that the grid does not tell is left open."""
    if figure.low is None:
        return "" if figure.high is None else f"at most {write(figure.high)}"
    low = write(figure.low)
    return f"{low} or more" if figure.high is None else f"{low} to {write(figure.high)}"


def _samples(value: float) -> str:
    """A number of samples, to the ten where it is large: no more is known of it."""
    return fixed(value, 0 if abs(value) < 100.0 else -1)


def _share(figure: Estimate) -> str:
    return "" if figure.value is None else f"{figure.value:.0%}"
