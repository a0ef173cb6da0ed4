"""The tables of `score`: one proxy's measures, and proxies ranked."""

from collections.abc import Mapping, Sequence

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proxytune.usefulness import Assessment, Selection

Row = tuple[str, str, str, str, str]


def measures(assessment: Assessment, *, proxy: str, target: str) -> Group:
    """Show every measure of one proxy with its interval, direction and meaning, and the notes below."""
    table = _table(f"{proxy} as a proxy of {target}: {_sizes(assessment)}")
    for column in ("measure", "value", "95 % interval", "better", "what it says"):
        table.add_column(column, justify="right" if column in ("value", "95 % interval") else "left")
    for row in (*_prpv_rows(assessment), _ppv_row(assessment), *_metric_rows(assessment)):
        table.add_row(*map(escape, row))
    return Group(table, *_notes({proxy: assessment}))


def ranking(assessments: Mapping[str, Assessment], selection: Selection, *, target: str) -> Group:
    """Show proxies best first, each with those that are worse beyond noise, and the notes below."""
    first = next(iter(assessments.values()))
    metrics = [metric.name for metric in first.inputs.metrics]
    table = _table(f"{len(assessments)} proxies of {target}: {_sizes(first)}")
    for column in (
        "",
        "proxy",
        "PRPV",
        "95 % interval",
        "chance",
        "p",
        "PPV",
        *(f"SRCC {escape(name)}" for name in metrics),
    ):
        table.add_column(column, justify="left" if column == "proxy" else "right")
    table.add_column("better beyond noise than")
    for rank, (name, value) in enumerate(selection.ranking, 1):
        found = assessments[name]
        inner = _ends((found.prpv_interval.low, found.prpv_interval.high))
        random = (_number(found.chance.mean), f"{found.chance.p_value:.2g}")
        correlations = [_number(found.srcc.value[metric]) for metric in metrics]
        worse = [pair.worse for pair in selection.differences if pair.better == name and pair.beyond_noise]
        figures = (str(rank), name, str(value), inner, *random, _number(found.ppv.value), *correlations)
        table.add_row(*map(escape, (*figures, ", ".join(worse))))
    noise = first.noise_floor
    floor = f"{noise.title} {_number(noise.value)}, 95 % interval {_ends((noise.low, noise.high))}: {noise.meaning}"
    return Group(table, *([Text(floor)] if noise.value is not None else []), *_notes(assessments))


def _table(title: str) -> Table:
    return Table(title=escape(title), title_justify="left", title_style="bold", box=None, pad_edge=False)


def _sizes(assessment: Assessment) -> str:
    inputs = assessment.inputs
    sides = (("proxy", inputs.proxy_episodes), ("target", inputs.target_episodes))
    counts = [
        f"{low if low == high else f'{low} to {high}'} {side} episode{'' if high == 1 else 's'}"
        for side, (low, high) in sides
    ]
    return f"{len(inputs.agents)} agents, {counts[0]} and {counts[1]} each"


def _prpv_rows(assessment: Assessment) -> list[Row]:
    prpv, inner, noise = assessment.prpv, assessment.prpv_interval, assessment.noise_floor
    flips = [sum(pair.flip == flip for pair in prpv.pairs) for flip in ("reversed", "lost", "invented")]
    reading = f"{flips[0]} reversed, {flips[1]} lost, {flips[2]} invented"
    random = assessment.chance
    return [
        ("PRPV", str(prpv.value), _ends((inner.low, inner.high)), "lower", f"0 (same order) to {prpv.range[1]}"),
        ("  normalised", _number(prpv.normalised), "", "lower", "0 to 1"),
        ("  flipped pairs", str(len(prpv.pairs)), "", "lower", reading),
        ("  expected", _number(inner.expected), "", "lower", "mean over resampled episodes"),
        (f"  {noise.title}", _number(noise.value), _ends((noise.low, noise.high)), "", noise.meaning),
        (
            "  chance",
            _number(random.mean),
            f"± {random.deviation:.3g}",
            "",
            f"as low by chance: p = {random.p_value:.2g}",
        ),
    ]


def _ppv_row(assessment: Assessment) -> Row:
    ends = assessment.intervals.ppv if assessment.intervals else None
    return ("PPV", _number(assessment.ppv.value), _ends(ends), "lower", "weighted error of an agent's scores, from 0")


def _metric_rows(assessment: Assessment) -> list[Row]:
    inner = assessment.intervals
    measured = (
        ("SRCC", assessment.srcc.value, inner and inner.srcc, "higher", "Pearson, −1 to 1"),
        ("Kendall τ", assessment.kendall_tau.value, inner and inner.kendall_tau, "higher", "−1 to 1"),
        ("MMRV", assessment.mmrv.value, inner and inner.mmrv, "lower", "in the metric's unit, from 0"),
    )
    return [
        (f"{title} {name}", _number(value), _ends(intervals[name] if intervals else None), better, meaning)
        for title, values, intervals, better, meaning in measured
        for name, value in values.items()
    ]


def _notes(assessments: Mapping[str, Assessment]) -> list[Text]:
    """Notes, each said once, with the proxies it holds for where it does not hold for all."""
    lines: dict[str, list[str]] = {}
    for name, assessment in assessments.items():
        for note in assessment.notes:
            lines.setdefault(note, []).append(name)
    return [Text(f"note{_whose(names, len(assessments))}: {note}") for note, names in lines.items()]


def _whose(names: Sequence[str], proxies: int) -> str:
    return "" if len(names) == proxies else f" ({', '.join(names)})"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}".replace("-", "−")


def _ends(ends: tuple[float | None, float | None] | None) -> str:
    if ends is None or ends[0] is None or ends[1] is None:
        return ""
    return f"{_number(ends[0])} to {_number(ends[1])}"
