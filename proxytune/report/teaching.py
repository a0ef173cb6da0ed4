"""Learning experiment of `teach`: sentence, the paper's table 1 and observations, figure, page and JSON document."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, astuple, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Group

from proxytune import teaching
from proxytune.arrays import Floats
from proxytune.learning import LEVELS, NONE, Costs, Distribution, LearningCurve, LearningEstimate, doublings
from proxytune.report import figure_style as style
from proxytune.report.study.document import estimate_document
from proxytune.report.text import file_texts, group_texts, table_text
from proxytune.report.view import Drawn, Paragraphs, Part, Table, View, columns_of
from proxytune.report.wording import fixed, listed, percent, short, span
from proxytune.report.writing import picture_of
from proxytune.study import settings_document

Predictivities = Mapping[str, teaching.Predictivity | None]
"""PRPV by proxy; None where it is not known."""
HEADS = ("PRPV", "zero-shot score", "samples needed", "PLV", "reduction")
"""Heads of table 1 beside the proxy's name."""
COST = "PLV in cost"
NOT_REACHED, UNKNOWN = "not converged", "unknown"
CONVERGED = "converged: the mean score is at least {} and stays so"
PLV_MEANING = "PLV (proxy learning value): target samples saved by learning in the proxy first"
COST_MEANING = (
    "PLV in cost: what these cost, in the unit of [teaching.costs]: off_policy {:g}, on_policy {:g}, label {:g}"
)
FIRST = "A zero-shot score does not measure PLV (the paper's first observation)"
SECOND = "A proxy that predicts badly can still teach (the paper's second observation)"
PUBLISHED = tuple(
    head for name in ("zero-shot score", "samples needed", "reduction") for head in (f"{name}, published", "here")
)
SEARCH = '`study` with objective = "plv" looks for'
LESSONS = ("rehearsal", "proxy_lessons", "target_lessons")
PLAIN = ("learner", "proxy_samples", "seeds", "lesson_s", "level", "tolerance", "examinations", *LESSONS)
"""Settings that JSON has as they are."""


def teach_answer(experiment: teaching.Experiment) -> str:
    """Say which proxies save target samples, which save none, and of which that is open."""
    unknown = teaching.why_unknown(experiment.needs)
    if unknown and not experiment.settled:
        return f"PLV (proxy learning value) is unknown: {unknown.reason}."
    saves, none, both = sorted_by_worth(experiment.teachers)
    sentences = [
        f"Target samples saved (PLV, proxy learning value, with 95 % interval): {_list_plv(saves) or 'none is shown'}.",
        f"None saved: {_list_plv(none)}." if none else "",
        f"Open, since the interval reaches to both sides of 0: {_list_plv(both)}." if both else "",
    ]
    return " ".join(filter(None, sentences))


def sorted_by_worth(teachers: Sequence[teaching.TeacherResult]) -> tuple[list[teaching.TeacherResult], ...]:
    """The proxies whose whole interval of PLV lies above 0, those of which none of it does, and the others."""
    saves = [one for one in teachers if one.worth and one.worth.plv.above_zero]
    none = [one for one in teachers if one.worth and one.worth.plv.at_most_zero]
    return saves, none, [one for one in teachers if one not in (*saves, *none)]


def _list_plv(lessons: Sequence[teaching.TeacherResult]) -> str:
    return "; ".join(f"{one.name}: {count(one.worth.plv, UNKNOWN)}" for one in lessons if one.worth)


def teach_next_step(experiment: teaching.Experiment) -> str:
    """The step that brings most."""
    if unknown := teaching.why_unknown(experiment.needs):
        return f"{unknown.remedy}: {unknown.reason}."
    saves, _, both = sorted_by_worth(experiment.teachers)
    if both:
        more = f"{say_more(experiment)}, which narrows the intervals"
        return f"{more}: {listed([one.name for one in both])} cannot be judged yet."
    if saves:
        return f"train in a proxy that saves samples, then on target samples; {SEARCH} a better one."
    return f"train without these proxies; {SEARCH} one that saves samples."


def say_more(experiment: teaching.Experiment) -> str:
    """Say what to raise: the examinations that are chosen or, of a whole grid, its repetitions."""
    taught = teaching.teaching_settings(experiment.settings)
    if taught.examinations is not None:
        return f"raise teaching.examinations from {taught.examinations} to {2 * taught.examinations}"
    seeds = experiment.without.repetitions
    return f"raise teaching.seeds from {seeds} to {2 * seeds}"


def teach_text(experiment: teaching.Experiment, prpv: Predictivities, files: Mapping[str, Any]) -> Group:
    """The result of a learning experiment as `teach` prints it, with how well each proxy predicts."""
    table = teach_table(experiment, prpv)
    observations = observation_lines(teaching.observe(experiment, prpv), experiment)
    sentence = f"{teach_answer(experiment)}\n"
    return group_texts(sentence, table_text(replace(table, title="")), *table.notes, *observations, *file_texts(files))


def teach_table(experiment: teaching.Experiment, prpv: Predictivities) -> Table:
    """Table 1: the learner without a proxy, then one row per proxy; PLV in cost is told where costs are stated."""
    worth = next((lesson.worth for lesson in experiment.teachers if lesson.worth), None)
    unseen = UNKNOWN if experiment.needs.gain is None else NOT_REACHED
    rows: list[tuple[str, ...]] = [(NONE, "", "", count(worth.without) if worth else unseen, "", "")]
    rows += [_row(lesson, prpv.get(lesson.name)) for lesson in experiment.teachers]
    heads: tuple[str, ...] = HEADS
    notes, costs = [PLV_MEANING], teaching.teaching_settings(experiment.settings).costs
    # Samples that cost one each are PLV itself.
    if costs != Costs():
        saved = [_with_ends(one.cost, UNKNOWN, short) if one.cost else "" for one in experiment.teachers]
        rows = [(*row, cost) for row, cost in zip(rows, ("", *saved), strict=True)]
        heads, notes = (*HEADS, COST), [PLV_MEANING, COST_MEANING.format(*astuple(costs))]
    notes.append(CONVERGED.format(f"{experiment.when.threshold:.1f} of {experiment.best_score:g}"))
    if unknown := teaching.why_unknown(experiment.needs):
        notes.append(f"{unknown.reason}, so PLV is not known; {unknown.remedy}")
    elif caution := teaching.caution_of_threshold(experiment.needs):
        notes.append(caution)
    for lesson in experiment.teachers:
        factor = lesson.worth.factor if lesson.worth else None
        if factor is not None and factor.value is not None:
            text = _with_ends(replace(factor, low=factor.low or 0.0), "", "{:.2g}".format)
            notes.append(f"{lesson.name}: samples needed without the proxy / with it = {text}")
    return Table("PLV of each proxy (the paper's table 1)", columns_of(("proxy",), heads), tuple(rows), tuple(notes))


def _row(lesson: teaching.TeacherResult, prpv: teaching.Predictivity | None) -> tuple[str, ...]:
    worth, zero_shot = lesson.worth, one_decimal(lesson.zero_shot)
    predicts = "" if prpv is None else f"{prpv.prpv:g}" + (f" ({span(prpv.interval, 0)})" if prpv.interval else "")
    if worth is None:
        return (lesson.name, predicts, zero_shot, "", "", "")
    reduction = "" if worth.reduction.value is None else percent(worth.reduction.value)
    return (lesson.name, predicts, zero_shot, count(worth.needed), count(worth.plv, UNKNOWN), reduction)


def count(figure: LearningEstimate, missing: str = NOT_REACHED) -> str:
    """A number of samples with its interval; without a number, why it is missing."""
    # Large numbers to the ten: no more is known of them.
    return _with_ends(figure, missing, lambda value: fixed(value, 0 if abs(value) < 100.0 else -1))


def _with_ends(figure: LearningEstimate, missing: str, write: Callable[[float], str]) -> str:
    """A figure with its interval; an end that the grid does not tell is left open."""
    value = missing if figure.value is None else write(figure.value)
    if figure.low is None:
        return value if figure.high is None else f"{value} (at most {write(figure.high)})"
    low = write(figure.low)
    return f"{value} ({low} or more)" if figure.high is None else f"{value} ({low} to {write(figure.high)})"


def one_decimal(figure: LearningEstimate) -> str:
    """A score, empty where there is none."""
    return "" if figure.value is None else fixed(figure.value, 1)


def observation_lines(found: teaching.Observations | None, experiment: teaching.Experiment) -> tuple[str, ...]:
    """Both observations, each with its evidence; none where PLV is unknown, and the first of several proxies only."""
    if found is None:
        return ()
    lines = []
    if found.zero_shot:
        starts = {one.name: one.zero_shot.value or 0.0 for one in experiment.teachers}
        pairs = [
            f"{ahead} saves more than {behind} though it starts lower ({starts[ahead]:.1f} for {starts[behind]:.1f})"
            for ahead, behind in found.zero_shot.reversed
        ]
        shown = f"shown here, since {listed(pairs)}" if pairs else "no pair of these proxies shows it"
        lines.append(f"{FIRST}: {shown}; {_tau(found.zero_shot, 'zero-shot score')}.")
    poor, shown = list(found.poor_predictors), "none of these proxies shows it"
    if poor:
        save = f"{listed(poor)} {'saves' if len(poor) == 1 else 'save'} samples"
        shown = f"shown here, since {save} though a random ranking would predict as well"
    shown += f"; {_tau(found.prpv, 'PRPV')}" if found.prpv else ""
    return (*lines, f"{SECOND}: {shown}.")


def _tau(found: teaching.RankAgreement, figure: str) -> str:
    """Kendall's τ with its interval, and what it says."""
    interval = f"{fixed(found.low, 2)} to {fixed(found.high, 2)}"
    if found.low > 0.0:
        says = "more pairs agree than not"
    elif found.high < 0.0:
        says = "fewer pairs agree than not"
    else:
        says = "whether more pairs agree than not is open"
    figures = f"Kendall's τ between {figure} and PLV is {fixed(found.tau, 2)} ({interval})"
    return f"{figures}: of {found.proxies} proxies, {says}"


def teach_view(experiment: teaching.Experiment, prpv: Predictivities, figure: Drawn) -> View:
    """A learning experiment: the paper's table 1 and observations, what others published, and the curves."""
    table, found = teach_table(experiment, prpv), teaching.observe(experiment, prpv)
    observations = observation_lines(found, experiment)
    said = [Paragraphs("The paper's two observations", observations)] if observations else []
    picture = picture_of("teach", "teach", figure)
    title = f"{experiment.settings.name}: which proxy is worth learning in?"
    parts: tuple[Part, ...] = (table, *said, *_published(experiment, table.rows), picture)
    return View(title, teach_answer(experiment), teach_next_step(experiment), parts)


def _published(experiment: teaching.Experiment, rows: Sequence[tuple[str, ...]]) -> tuple[Table, ...]:
    """Published figures of these proxies, beside what is found here; nothing where nothing is given."""
    taught = teaching.teaching_settings(experiment.settings)
    if not taught.published:
        return ()
    here = {row[0]: row for row in rows}
    cells = []
    for name, theirs in taught.published.items():
        _, _, zero_shot, needed, _, reduction, *_ = here[name]
        published = (f"{theirs.zero_shot:g}", f"{theirs.samples}", percent(theirs.reduction))
        cells.append((name, published[0], zero_shot, published[1], needed, published[2], reduction))
    notes = tuple(filter(None, [taught.published_in]))
    return (Table("Beside what was published", columns_of(("proxy",), PUBLISHED), tuple(cells), notes),)


def teach_document(experiment: teaching.Experiment, prpv: Predictivities) -> dict[str, Any]:
    """A learning experiment as plain JSON; None where a figure is undefined or was not reached."""
    found, taught = teaching.observe(experiment, prpv), teaching.teaching_settings(experiment.settings)
    return {
        "name": experiment.settings.name,
        "best_score": experiment.best_score,
        "convergence": {
            "level": experiment.when.level,
            "tolerance": experiment.when.tolerance,
            "threshold": experiment.when.threshold,
            "settled": experiment.settled,
        },
        "without": _curve_document(experiment.without),
        "proxies": {lesson.name: _lesson_document(lesson, prpv.get(lesson.name)) for lesson in experiment.teachers},
        "kendall_tau": {
            "zero_shot": _agreement_document(found.zero_shot if found else None),
            "prpv": _agreement_document(found.prpv if found else None),
        },
        "saves_though_it_predicts_by_chance": list(found.poor_predictors) if found else [],
        "settings": {
            **settings_document(experiment.settings),
            "teaching": {
                "target": str(taught.target),
                "target_samples": list(taught.target_samples),
                **{name: getattr(taught, name) for name in PLAIN},
                "costs": asdict(taught.costs),
                "published": {name: asdict(row) for name, row in taught.published.items()},
                "published_in": taught.published_in,
            },
        },
    }


def _agreement_document(found: teaching.RankAgreement | None) -> dict[str, Any] | None:
    """Agreement of a ranking with that by PLV."""
    if found is None:
        return None
    pairs = [list(pair) for pair in found.reversed]
    return {"value": found.tau, "interval": [found.low, found.high], "contrary_pairs": pairs}


def _lesson_document(lesson: teaching.TeacherResult, prpv: teaching.Predictivity | None) -> dict[str, Any]:
    worth = lesson.worth
    figures = ("without", "needed", "plv", "factor", "reduction")
    return {
        "theta": theta_document(lesson.proxy),
        "prpv": prpv.prpv if prpv else None,
        "prpv_interval": list(prpv.interval) if prpv and prpv.interval else None,
        "prpv_chance": {"mean": prpv.chance.mean, "p_value": prpv.chance.p_value} if prpv else None,
        "zero_shot": lesson.zero_shot.value,
        "zero_shot_interval": [lesson.zero_shot.low, lesson.zero_shot.high],
        **{name: estimate_document(getattr(worth, name) if worth else None) for name in figures},
        "plv_cost": estimate_document(lesson.cost),
        **_curve_document(lesson.curve),
    }


def theta_document(proxy: Distribution) -> dict[str, Any]:
    """p(θ): a number where a parameter is fixed, else its bounds."""
    return {name: low if low == high else [low, high] for name, (low, high) in proxy.bounds.items()}


def _curve_document(curve: LearningCurve) -> dict[str, Any]:
    scores = [[None if score != score else score for score in row] for row in curve.scores.tolist()]
    return {"target_samples": list(curve.counts), "scores": scores, "examinations": len(curve.examined)}


WITHOUT, WITH = ("without a proxy", style.GREY, "--", "x"), ("with the proxy", style.BLUE, "-", "o")
"""Of the learner's curve: its name, colour, line and mark."""


def teach_figure(experiment: teaching.Experiment) -> Figure:
    """Draw the learning curve with each proxy against that without one, a panel each, with 95 % bands.

    Above the dotted line a learner counts as converged; the bar on it says how many samples that takes.
    """
    lessons, grid = experiment.teachers, teaching.teaching_settings(experiment.settings).target_samples
    shown = [grid[place] for place in sorted({0, 1, (len(grid) + 1) // 2, len(grid) - 1})]
    figure, panels = style.panel_grid(len(lessons), 1.25, 0.6, sharex=True, sharey=True)
    for axes, lesson in zip(panels, lessons, strict=True):
        worth = lesson.worth
        _draw_learner(axes, experiment, NONE, worth.without if worth else None)
        _draw_learner(axes, experiment, lesson.name, worth.needed if worth else None)
        axes.axhline(experiment.when.threshold, color="0.3", linewidth=0.8, linestyle=":", label="converged")
        axes.set_xticks(_places(experiment, np.array(shown, dtype=float)), [f"{count:g}" for count in shown])
        axes.set_title(lesson.name, fontsize=8)
        style.dress(axes)
    for axes in panels[-2:]:
        # Also where the panel below, which would have them, is empty.
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("target samples", fontsize=8)
    for axes in panels[::2]:
        axes.set_ylabel("score [s]", fontsize=8)
    style.legend_below(figure, *panels)
    return figure


def _draw_learner(axes: Axes, experiment: teaching.Experiment, name: str, needed: LearningEstimate | None) -> None:
    """Draw a learner's curve with its band and examinations, and the interval of the samples that it needs."""
    label, colour, line, mark = WITHOUT if name == NONE else WITH
    draws, curve = experiment.needs.draws, experiment.needs.curves[name]
    at, scores, examined = _places(experiment, draws.counts), draws.scores[name], curve.examined
    low, high = np.quantile(scores, LEVELS, axis=0)
    axes.fill_between(at, low, high, color=colour, alpha=0.18, linewidth=0)
    axes.plot(at, scores.mean(axis=0), line, color=colour, linewidth=1.2, label=label)
    seen = _places(experiment, np.array(curve.counts, dtype=float))[examined[:, 1]]
    axes.plot(seen, curve.scores[tuple(examined.T)], mark, color=colour, markersize=2, alpha=0.35)
    if needed is not None and needed.low is not None:
        # Off the line of convergence, so that the bars of both learners stay apart
        level = experiment.when.threshold + (-1.2 if name == NONE else 1.2)
        ends = np.array([needed.low, experiment.needs.last if needed.high is None else needed.high])
        axes.hlines(level, *_places(experiment, ends), color=colour, linewidth=2.5)


def _places(experiment: teaching.Experiment, counts: Floats) -> Floats:
    """Places of counts on the axis: as doublings, none at 0."""
    return doublings(counts, experiment.needs.draws.first)
