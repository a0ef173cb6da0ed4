"""A study's result for people: on the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proxytune.report.numbers import probability, short
from proxytune.report.study.finding import finding_of
from proxytune.report.study.search_lines import search_lines
from proxytune.report.study.theta_table import TOLD_BY, theta_columns, theta_lines, theta_rows, told_rows
from proxytune.report.study.verdict import sentence
from proxytune.study.result import StudyResult
from proxytune.usefulness import NoiseFloor

THETA, WORTH, TOLD, SEARCH = (
    "What is known of θ",
    "What the proxy is worth at the best θ",
    "Who tells what of θ",
    "The search",
)

OF_THE_PROXY = "the proxy at the best θ against itself, same starts: what a perfect proxy would score"


def worth_lines(result: StudyResult) -> list[str]:
    """PRPV, what it is to be held against, whether the model fits, PPV; one line each, then what to take with care."""
    found = result.best.assessment
    inner, worst = found.prpv_interval, found.prpv.range[1]
    interval = "" if inner.low is None else f", interval {inner.low:.1f} to {inner.high:.1f}"
    lines = [
        *fresh_lines(result),
        *floor_lines(result.floor, "" if result.judged is found else OF_THE_PROXY),
        chance_line(result),
        misfit_line(result),
        f"PRPV {found.prpv.value} of at most {worst}{interval}, in the search's own episodes; lower is better",
    ]
    if found.ppv.value is not None:
        lines.append(f"PPV {found.ppv.value:.3g}; lower is better")
    return [*lines, *result.judged.notes]


def fresh_lines(result: StudyResult) -> list[str]:
    """PRPV of the best θ on fresh episodes, and how much of the search's own was luck; nothing without them."""
    if result.confirmation is None:
        return []
    answer, rivals = result.confirmation.answer, len(result.confirmation.candidates) - 1
    if answer.assessment is None or answer.optimism is None:
        return ["fresh episodes: no PRPV, since an agent failed in all of them"]
    inner = answer.assessment.prpv_interval
    interval = "" if inner.low is None else f", interval {inner.low:.1f} to {inner.high:.1f}"
    luck = f"{answer.optimism:.3g} of it was luck" if answer.optimism > 0 else "it was not luck"
    compared = f"; confirmed against {rivals} θ nearly as good" if rivals else ""
    return [f"on fresh episodes PRPV {answer.assessment.prpv.value}{interval}: {luck}{compared}"]


def floor_lines(floor: NoiseFloor, meaning: str = "") -> list[str]:
    """What the noise floor is, by its kind; nothing without one."""
    if floor.value is None or floor.low is None or floor.high is None:
        return []
    return [
        f"{floor.title} {short(floor.value)} ({short(floor.low)} to {short(floor.high)}): {meaning or floor.meaning}"
    ]


def chance_line(result: StudyResult) -> str:
    """What a proxy that knows nothing would score, and how often as low."""
    found = result.judged.chance
    known = f"as low with {probability(found.p_value)}"
    return f"chance {found.mean:.1f} ± {found.deviation:.1f}: a proxy that knows nothing; {known}"


def misfit_line(result: StudyResult) -> str:
    """Whether any θ explains the target."""
    found = result.knowledge.misfit
    if found.p_value is None:
        return "misfit: too few whole trials to tell whether any θ explains the target's scores"
    means = "some θ may explain the target's scores" if found.fits else "no θ explains the target's scores"
    return f"misfit: {means} ({probability(found.p_value)})"


def study_table(result: StudyResult, spent: str, files: Mapping[str, Any]) -> RenderableType:
    """The result of a study as `study` shows it: one sentence, the table of θ, and the rest in groups."""
    paths = [f"{what}: {path}" for what, path in files.items()]
    return Group(
        Text(sentence(finding_of(result))),
        *_group(THETA, theta_lines(result), _table(theta_columns(result), theta_rows(result))),
        *_group(WORTH, worth_lines(result)),
        *(_group(TOLD, [], _table(TOLD_BY, told)) if (told := told_rows(result)) else []),
        *_group(SEARCH, [*search_lines(result), spent, *paths]),
    )


def _group(title: str, lines: Sequence[str], table: Table | None = None) -> list[RenderableType]:
    shown = [] if table is None else [table]
    return [Text(f"\n{title}", style="bold"), *shown, *(Text(line) for line in lines)]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in head:
        table.add_column(name)
    for row in rows:
        table.add_row(*map(escape, row))
    return table
