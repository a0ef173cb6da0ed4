"""Scores of proxies: sentence, tables, page, JSON document and table file of `score`."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Group

from proxytune.files import csv_text
from proxytune.report import decision
from proxytune.report.html import write_page
from proxytune.report.score_figures import MOST, flipped_pairs_figure, scatter_figure
from proxytune.report.text import Cell, group_texts, latex_text, note_texts, table_text
from proxytune.report.view import Column, Foot, Paragraphs, Picture, Table, View, columns_of
from proxytune.report.wording import listed, short, short_span, with_span
from proxytune.report.writing import file_names, picture_of, save_figures, write_text
from proxytune.usefulness import ALL, MEASURES, PRPV, Assessment, Difference, Measure, Measured, Selection, SuccessRates

Row = tuple[str, str, str, str, str]
Assessments = Mapping[str, Assessment]
BESIDE_PRPV = tuple(measure for measure in MEASURES if measure is not PRPV)
REST = {"scatter": "; those whose rank differs most are named", "flipped_pairs": "; the axes are ranks on the target"}
"""What a caption ends with where agents are too many to be named."""


def score_sentence(assessments: Assessments, selection: Selection | None, *, target: str) -> str:
    """Say how low PRPV is and what that is worth; of several proxies which is best, and than which beyond noise."""
    if selection is None:
        ((proxy, assessment),) = assessments.items()
        return f"{_say_prpv(assessment, proxy, target)} {decision.decision_sentence(assessment, target)}"
    best = selection.ranking[0][0]
    worse = [pair.worse for pair in selection.differences if pair.better == best and pair.beyond_noise]
    beyond = f"beyond noise better than {listed(worse)}" if worse else "not beyond noise better than any other"
    alike = [pair.worse for pair in selection.differences if pair.better == best and pair.value == 0.0]
    ranks = f"{listed([best, *alike])} rank" if alike else f"{best} ranks"
    each = f" (PRPV {selection.ranking[0][1]} each)" if alike else ""
    return f"{ranks} the agents most like {target}{each}, {beyond}. {_say_prpv(assessments[best], best, target)}"


def _say_prpv(assessment: Assessment, proxy: str, target: str) -> str:
    prpv, inner, random = assessment.prpv, assessment.prpv_interval, assessment.chance
    floor = assessment.noise_floor
    chance = f"{short(random.mean)} ± {short(random.deviation)}, p = {random.p_value:.2g}"
    level = "" if floor.value is None else with_span(floor.value, floor.low, floor.high)
    if random.too_few:
        worth = f"as low as any order of these agents has, which chance may be too ({chance})"
    elif random.explains:
        worth = f"no better than chance ({chance})"
    elif assessment.at_noise_floor:
        worth = f"no difference from the target can be seen (noise floor {level})"
    else:
        perfect = f"; a perfect proxy scores {level}" if floor.kind == "same starts" and level else ""
        worth = f"better than chance ({chance}){perfect}"
    value = with_span(str(prpv.value), inner.low, inner.high)
    score = f"has a PRPV (proxy relative predictivity value) of {value}, of at most {prpv.range[1]}"
    return f"As a proxy of {target}, {proxy} {score}: {worth}."


def score_next_step(assessments: Assessments, selection: Selection | None) -> str:
    """The step that brings most."""
    if selection is not None:
        best = selection.ranking[0][0]
        if all(pair.beyond_noise for pair in selection.differences if pair.better == best):
            return f"use {best}, or tune its parameters with `python -m proxytune study`."
        return "score more agents or more episodes, to tell the best proxies apart."
    (assessment,) = assessments.values()
    if assessment.prpv_interval.low is None:
        return "score every agent in at least two episodes on both sides, or state their number; that gives intervals."
    if assessment.chance.explains:
        return "score more agents, or agents whose scores differ more, until chance can be excluded."
    if assessment.at_noise_floor:
        return "use this proxy; to see a difference from the target, score more starts."
    return "see below which pairs it ranks wrongly; tune its parameters with `python -m proxytune study`."


def score_text(assessments: Assessments, selection: Selection | None, left_out: Sequence[str], *, target: str) -> Group:
    """The scores as `score` prints them: the sentence, every measure of one proxy or several ranked, and notes."""
    notes = _remarks(assessments, "note")
    if selection is None:
        ((_, assessment),) = assessments.items()
        notes += [f"decision: {line}" for line in decision.decision_table(assessment, target).notes]
    else:
        notes += [f"note: {line}" for line in _untold(selection)]
        notes += [f"decision: {line}" for line in decision.choices_sentences(assessments, selection, target)]
    floor = _floors(assessments) if selection is not None else []
    tables = map(table_text, _tables(assessments, selection, target))
    sentence = score_sentence(assessments, selection, target=target)
    return group_texts(f"{sentence}\n", *tables, *floor, *notes, *note_texts(left_out))


def _remarks(assessments: Assessments, note: str = "") -> list[str]:
    """Cautions, then notes, each once, with the proxies that it is said of, where it is not all."""
    kinds = (("beware", "cautions"), (note, "notes"))
    said = [(kind, {name: getattr(one, lines) for name, one in assessments.items()}) for kind, lines in kinds]
    return [
        f"{kind}{whose}: {line}".removeprefix(": ").lstrip() for kind, each in said for line, whose in _said_of(each)
    ]


def _untold(selection: Selection) -> list[str]:
    return [f"no intervals of the differences: {selection.reason}"] if selection.reason else []


def _floors(assessments: Assessments) -> list[str]:
    """What a perfect proxy scores, or halves of the target, each once: it depends on the starts of a proxy."""
    noises = {name: one.noise_floor for name, one in assessments.items()}
    lines = {
        name: [f"{short(one.value)}, 95 % interval {short_span(one.low, one.high)}: {one.meaning}"]
        for name, one in noises.items()
        if one.value is not None
    }
    titles = {line: noises[name].title for name, (line,) in lines.items()}
    return [f"{titles[line]}{whose} {line}" for line, whose in _said_of(lines)]


def _said_of(each: Mapping[str, Sequence[str]]) -> list[tuple[str, str]]:
    """Each line once, and in brackets the proxies that it is said of, where it is not all."""
    said: dict[str, list[str]] = {}
    for name, lines in each.items():
        for line in lines:
            said.setdefault(line, []).append(name)
    return [(line, "" if len(names) == len(each) else f" ({', '.join(names)})") for line, names in said.items()]


def score_view(
    assessments: Assessments, selection: Selection | None, figures: Sequence[Picture] = (), *, target: str
) -> View:
    """One proxy, or several ranked, with what was drawn; all figures are, where none is given."""
    figures = figures or [picture for *_, picture in _all_drawn(assessments, selection)]
    tables = _tables(assessments, selection, target)
    said = score_sentence(assessments, selection, target=target), score_next_step(assessments, selection)
    if selection is None:
        return View(f"{next(iter(assessments))}: how well does it predict {target}?", *said, (*figures, *tables))
    choices = Paragraphs("Which proxy to choose by", tuple(decision.choices_sentences(assessments, selection, target)))
    return View(f"Which of {len(assessments)} proxies predicts {target} best?", *said, (*tables, choices, *figures))


def figures_of_scores(assessment: Assessment) -> dict[str, Figure]:
    """The figures of one proxy, by name."""
    figures = {"scatter": scatter_figure(assessment), "flipped_pairs": flipped_pairs_figure(assessment.prpv)}
    return {**figures, "decision": decision.decision_figure(assessment.decision)}


def _all_drawn(assessments: Assessments, selection: Selection | None) -> Iterator[tuple[str, Figure, Picture]]:
    """The figures of every proxy: name of the file, figure, and what the page has of it."""
    files = file_names(assessments)
    for name, assessment in assessments.items():
        file, whose = ("", "") if selection is None else (f"_{files[name]}", f": {name}")
        for kind, figure in figures_of_scores(assessment).items():
            rest = REST.get(kind, "") if len(assessment.inputs.agents) > MOST else ""
            yield f"{kind}{file}", figure, picture_of("score", kind, figure, whose=whose, rest=rest)


def write_score_report(
    assessments: Assessments, selection: Selection | None, folder: Path, foot: Foot, *, target: str
) -> tuple[list[Path], Path]:
    """Draw the figures of every proxy, and write the page; the paths of both."""
    drawn, page = list(_all_drawn(assessments, selection)), folder / "report.html"
    paths = save_figures({file: figure for file, figure, _ in drawn}, folder)
    view = score_view(assessments, selection, [picture for *_, picture in drawn], target=target)
    write_page(page, view, foot)
    return paths, page


def _tables(assessments: Assessments, selection: Selection | None, target: str) -> list[Table]:
    """Every measure of one proxy with success rates below, or proxies ranked; all cautions and notes once."""
    notes = tuple(_remarks(assessments))
    if selection is not None:
        return [_ranking(assessments, selection, target, (*notes, *_untold(selection)))]
    ((proxy, assessment),) = assessments.items()
    beside = [row for measure in BESIDE_PRPV for row in _rows(measure, assessment)]
    columns = (*columns_of(("measure",), ("value", "95 % interval")), *columns_of(("better", "what it says")))
    title = f"{proxy} as a proxy of {target}: {_sizes(assessment)}"
    prpv, inner = assessment.prpv, assessment.prpv_interval
    noise, random = assessment.noise_floor, assessment.chance
    flips = [f"{sum(pair.flip == flip for pair in prpv.pairs)} {flip}" for flip in ("reversed", "lost", "invented")]
    better, span = PRPV.better, short_span(inner.low, inner.high)
    by_chance = f"as low by chance: p = {random.p_value:.2g}"
    rows: list[Row] = [
        (PRPV.name, str(prpv.value), span, better, f"{PRPV.meaning} to {prpv.range[1]}"),
        ("  normalised", _number(prpv.normalised), "", better, "0 to 1"),
        ("  flipped pairs", str(len(prpv.pairs)), "", better, ", ".join(flips)),
        (f"  {noise.title}", _number(noise.value), short_span(noise.low, noise.high), "", noise.meaning),
        ("  chance", _number(random.mean), f"± {random.deviation:.3g}", "", by_chance),
    ]
    return [
        decision.decision_table(assessment, target),
        Table(title, columns, (*rows, *beside), notes),
        *map(_rates, assessment.success_rates),
    ]


def _rates(rates: SuccessRates) -> Table:
    both = ((agent, rates.proxy[agent], target) for agent, target in rates.target.items())
    rows = tuple((agent, str(p), str(p.episodes), str(t), str(t.episodes)) for agent, p, t in both)
    title = f"{rates.metric}: success rates with their own 95 % intervals (Wilson)"
    return Table(title, columns_of(("agent",), ("in the proxy", "episodes", "on the target", "episodes")), rows)


def _ranking(assessments: Assessments, selection: Selection, target: str, notes: tuple[str, ...]) -> Table:
    """Proxies best first, each with those that are worse beyond noise."""
    first = next(iter(assessments.values()))
    beside = [measure for measure in BESIDE_PRPV if measure.in_paper]
    titles = [row[0] for measure in beside for row in _rows(measure, first)]
    heads = columns_of((), (PRPV.name, "95 % interval", "chance", "p", *titles))
    columns = (Column("", numbers=True), Column("proxy"), *heads, Column("better beyond noise than"))
    rows = []
    for rank, (name, value) in enumerate(selection.ranking, 1):
        found = assessments[name]
        inner = short_span(found.prpv_interval.low, found.prpv_interval.high)
        random = (short(found.chance.mean), f"{found.chance.p_value:.2g}")
        others = [row[1] for measure in beside for row in _rows(measure, found)]
        worse = [pair.worse for pair in selection.differences if pair.better == name and pair.beyond_noise]
        rows.append((str(rank), name, str(value), inner, *random, *others, ", ".join(worse)))
    return Table(f"{len(assessments)} proxies of {target}: {_sizes(first)}", columns, tuple(rows), notes)


def _sizes(assessment: Assessment) -> str:
    inputs = assessment.inputs
    counts = [
        f"{low if low == high else f'{low} to {high}'} {side} episode{'' if high == 1 else 's'}"
        for side, (low, high) in zip(("proxy", "target"), inputs.episodes, strict=True)
    ]
    return f"{len(inputs.agents)} agents, {counts[0]} and {counts[1]} each"


def _rows(measure: Measure, assessment: Assessment) -> list[Row]:
    """One row, or one per metric."""
    return [
        (measure.name_for(metric), _number(value), short_span(*(ends or (None, None))), measure.better, measure.meaning)
        for metric, (value, ends) in measure.measured(assessment).items()
    ]


def _number(value: float | None) -> str:
    return "–" if value is None else short(value)


def write_score_table(assessments: Assessments, path: Path) -> None:
    """Write every measure of every proxy: as CSV a row for each, as LaTeX a row per measure and a column per proxy."""
    rows, cells = list[Sequence[Cell]](), dict[str, list[str]]()
    for name, assessment in assessments.items():
        for measure, (metric, found) in ((one, own) for one in MEASURES for own in one.measured(assessment).items()):
            ends = found.interval or (None, None)
            rows.append((name, measure.key_for(metric), found.value, *ends, measure.better))
            cells.setdefault(measure.name_for(metric), []).append(with_span(_number(found.value), *ends))
    if path.suffix == ".csv":
        write_text(path, csv_text(("proxy", "measure", "value", "low", "high", "better"), rows))
    else:
        write_text(path, latex_text(("measure", *assessments), [(title, *texts) for title, texts in cells.items()]))


def score_document(assessment: Assessment) -> dict[str, Any]:
    """Every figure of one proxy as plain JSON, whose keys are promises; None where undefined, and a note says why."""
    inner, noise = assessment.prpv_interval, assessment.noise_floor
    random, inputs = assessment.chance, assessment.inputs
    found = {measure: measure.measured(assessment) for measure in MEASURES}
    values = {measure.key: _per_metric(measure, one, lambda it: it.value) for measure, one in found.items()}
    intervals = {
        measure.key: _per_metric(measure, one, lambda it: it.interval and list(it.interval))
        for measure, one in found.items()
        if measure is not PRPV  # which has keys of its own
    }
    return {
        PRPV.key: values[PRPV.key],
        "prpv_normalised": assessment.prpv.normalised,
        "prpv_interval": ends_document(inner.low, inner.high),
        "expected_prpv": inner.expected,
        "noise_floor": noise.value,
        "noise_floor_interval": ends_document(noise.low, noise.high),
        "noise_floor_kind": noise.kind,
        "at_noise_floor": assessment.at_noise_floor,
        "chance": random.mean,
        "chance_deviation": random.deviation,
        "p_value": random.p_value,
        "ppv": values["ppv"],
        "beta": dict(assessment.ppv.beta),
        **values,
        "intervals": intervals if assessment.intervals else None,
        "pairs": [{"better": pair.better, "worse": pair.worse, "flip": pair.flip} for pair in assessment.prpv.pairs],
        "success_rates": {
            rates.metric: {
                agent: {"proxy": vars(rates.proxy[agent]), "target": vars(rates.target[agent])}
                for agent in inputs.agents
            }
            for rates in assessment.success_rates
        },
        "agents": list(inputs.agents),
        "metrics": [str(metric) for metric in inputs.metrics],
        "episodes": {
            "proxy": list(inputs.episodes[0]),
            "target": list(inputs.episodes[1]),
            "paired": inputs.paired,
            "resamples": inner.resamples,
        },
        **decision.decision_document(assessment),
        "cautions": list(assessment.cautions),
        "notes": list(assessment.notes),
    }


def ranking_document(assessments: Assessments, selection: Selection) -> dict[str, Any]:
    """Every figure of several proxies, best first, and of the differences between them."""
    ranked = enumerate(selection.ranking, start=1)
    return {
        "proxies": [{"proxy": name, "rank": rank, **score_document(assessments[name])} for rank, (name, _) in ranked],
        "differences": differences_document(selection.differences),
        "choices": differences_document(selection.choices),
        "together": decision.together_document(selection),
        "cautions": list(dict.fromkeys(line for one in assessments.values() for line in one.cautions)),
        "notes": _untold(selection),
    }


def differences_document(differences: Sequence[Difference]) -> list[dict[str, Any]]:
    """Differences of every two, the better first; by what else than PRPV one is better is told too."""
    return [
        {
            "better": one.better,
            "worse": one.worse,
            "difference": one.value,
            "interval": ends_document(one.low, one.high),
            "beyond_noise": one.beyond_noise,
            **({"on": one.on} if one.on != "prpv" else {}),
        }
        for one in differences
    ]


def ends_document(low: float | None, high: float | None) -> list[float] | None:
    """The ends of an interval; None where one is not known."""
    return None if low is None or high is None else [low, high]


def _per_metric(measure: Measure, found: Mapping[str, Measured], plain: Callable[[Measured], Any]) -> Any:
    """One plain value, or one for each metric by its name."""
    return {metric: plain(one) for metric, one in found.items()} if measure.per_metric else plain(found[ALL])
