"""The tables of `score`: one proxy's measures, and proxies ranked."""

from collections.abc import Mapping, Sequence

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proxytune.usefulness import MEASURES, PRPV, Assessment, Measure, Measured, Selection, SuccessRates

Row = tuple[str, str, str, str, str]
BESIDE_PRPV = tuple(measure for measure in MEASURES if measure is not PRPV)


def measures(assessment: Assessment, *, proxy: str, target: str) -> Group:
    """Show every measure of one proxy with its interval, direction and meaning, and the notes below."""
    table = _table(f"{proxy} as a proxy of {target}: {_sizes(assessment)}")
    for column in ("measure", "value", "95 % interval", "better", "what it says"):
        table.add_column(column, justify="right" if column in ("value", "95 % interval") else "left", overflow="fold")
    beside = [row for measure in BESIDE_PRPV for row in _rows(measure, assessment)]
    for row in (*_prpv_rows(assessment), *beside):
        table.add_row(*map(escape, row))
    return Group(table, *map(_rates, assessment.success_rates), *_notes({proxy: assessment}))


def _rates(rates: SuccessRates) -> Table:
    """The success rate of each agent on both sides."""
    table = _table(f"{rates.metric}: success rates with their own 95 % intervals (Wilson)")
    for column in ("agent", "in the proxy", "episodes", "on the target", "episodes"):
        table.add_column(column, justify="left" if column == "agent" else "right", overflow="fold")
    for agent, target in rates.target.items():
        sides = [
            (f"{one.value:.2f} ({one.low:.2f} to {one.high:.2f})", str(one.episodes))
            for one in (rates.proxy[agent], target)
        ]
        table.add_row(escape(agent), *sides[0], *sides[1])
    return table


def ranking(assessments: Mapping[str, Assessment], selection: Selection, *, target: str) -> Group:
    """Show proxies best first, each with those that are worse beyond noise, and the notes below."""
    first = next(iter(assessments.values()))
    beside = [measure for measure in BESIDE_PRPV if measure.in_paper]
    table = _table(f"{len(assessments)} proxies of {target}: {_sizes(first)}")
    titles = [row[0] for measure in beside for row in _rows(measure, first)]
    for column in ("", "proxy", PRPV.name, "95 % interval", "chance", "p", *map(escape, titles)):
        table.add_column(column, justify="left" if column == "proxy" else "right", overflow="fold")
    table.add_column("better beyond noise than", overflow="fold")
    for rank, (name, value) in enumerate(selection.ranking, 1):
        found = assessments[name]
        inner = _ends((found.prpv_interval.low, found.prpv_interval.high))
        random = (_number(found.chance.mean), f"{found.chance.p_value:.2g}")
        others = [row[1] for measure in beside for row in _rows(measure, found)]
        worse = [pair.worse for pair in selection.differences if pair.better == name and pair.beyond_noise]
        table.add_row(*map(escape, (str(rank), name, str(value), inner, *random, *others, ", ".join(worse))))
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
    random, better = assessment.chance, PRPV.better
    return [
        (PRPV.name, str(prpv.value), _ends((inner.low, inner.high)), better, f"{PRPV.meaning} to {prpv.range[1]}"),
        ("  normalised", _number(prpv.normalised), "", better, "0 to 1"),
        ("  flipped pairs", str(len(prpv.pairs)), "", better, reading),
        ("  expected", _number(inner.expected), "", better, "mean over resampled episodes"),
        (f"  {noise.title}", _number(noise.value), _ends((noise.low, noise.high)), "", noise.meaning),
        (
            "  chance",
            _number(random.mean),
            f"± {random.deviation:.3g}",
            "",
            f"as low by chance: p = {random.p_value:.2g}",
        ),
    ]


def _rows(measure: Measure, assessment: Assessment) -> list[Row]:
    """One row, or one per metric."""
    return [
        (measure.name_for(metric), _number(value), _ends(ends), measure.better, measure.meaning)
        for metric, (value, ends) in measure.measured(assessment).items()
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


def measured_text(found: Measured) -> str:
    """A value with its interval."""
    ends = _ends(found.interval)
    return f"{_number(found.value)} ({ends})" if ends else _number(found.value)


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}".replace("-", "−")


def _ends(ends: tuple[float | None, float | None] | None) -> str:
    if ends is None or ends[0] is None or ends[1] is None:
        return ""
    return f"{_number(ends[0])} to {_number(ends[1])}"
