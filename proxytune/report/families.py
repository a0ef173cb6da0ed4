"""Several domain families compared: sentence, tables, figure, page and JSON document."""

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullFormatter
from rich.console import Group

from proxytune.report import figure_style as style
from proxytune.report.scores import differences_document, score_document
from proxytune.report.study.document import estimate_document, intervals_document, pairs_document
from proxytune.report.study.sentence import KnownParameter, known_parameters
from proxytune.report.teaching import UNKNOWN, count
from proxytune.report.text import file_texts, group_texts, note_texts, section_text
from proxytune.report.view import Paragraphs, Table, View, columns_of
from proxytune.report.wording import fixed, in_pairs, listed, short, span
from proxytune.report.writing import ABOUT, picture_of
from proxytune.study import NOTICEABLE, BestFamilies, ComparedFamilies, Lesson, TunedFamily, settings_document
from proxytune.usefulness import Assessment, Difference

Row = tuple[str, ...]
Spread = tuple[float, float | None, float | None]
"""A value and the ends of its interval; None where an end is not known."""
USES, THETA = "Which simulator, and for what (95 % intervals)", "Best θ of each (95 % region)"
NOT_APART = "cannot be told from it"
BEST, ALIKE, WORSE = "best", NOT_APART, "worse"
LOOKS = {
    BEST: ("o", style.BLUE, style.BLUE),
    ALIKE: ("o", style.BLUE, "white"),
    WORSE: ("s", style.VERMILLION, style.VERMILLION),
}
"""Marker, colour of its edge and of its face: told apart without colours too."""
LONGEST = 16
"""Characters of a name in one line."""


def families_sentence(compared: ComparedFamilies) -> str:
    """Say what to use to predict, to teach and where time is short, and what to do next."""
    return f"{families_answer(compared)} Next: {families_next_step(compared)}"


def families_answer(compared: ComparedFamilies) -> str:
    """Say what to use to predict, to teach and where time is short."""
    teach = [f"To teach: {_say_teaching(compared)}."] if compared.settings.teaching else []
    choice, times = compared.cheapest, compared.seconds_per_episode()
    assert choice.best is not None
    more = {name: _ratio_text(*one) for name, one in compared.times_cheapest(choice.best).items()}
    alike = [f"{name} {more[name]}" for name in choice.alike]
    worse = [f"{name} {time}" for name, time in more.items() if name not in (choice.best, *choice.alike)]
    seconds = seconds_text(*times[choice.best], unit=" s per episode")
    cost = _join_clauses(f"{choice.best}, {seconds}", "times as long", worse, alike)
    return " ".join([f"To predict: {_say_predicting(compared)}.", *teach, f"Cheapest: {cost}."])


def families_next_step(compared: ComparedFamilies) -> str:
    """The step that brings most."""
    choice, fresh = compared.predicts, {one.name: one.fresh for one in compared.families}
    if choice.best is None or (best := fresh.get(choice.best)) is None:
        return "run the study again, to drive every family's best θ afresh."
    if best.chance.explains:
        return f"raise stop.wall_time_s (now {compared.settings.stop.wall_time_s:g}), or add agents that differ more."
    told = "raise starts and measure the target from them too"
    if not choice.alike:
        home = next(one.result.study.settings.home for one in compared.families if one.name == choice.best)
        return f"use {choice.best} to predict; its page: {home / 'report.html'}."
    # Of those that predict alike, one whose episodes are shown to take the shortest
    names = [choice.best, *choice.alike]
    means = {name: one[0] for name, one in compared.seconds_per_episode().items() if name in names}
    cheap = min(means, key=means.__getitem__)
    others = [one for name, one in compared.times_cheapest(cheap).items() if name in names and name != cheap]
    if all(low > NOTICEABLE for _, low, _ in others):
        return f"use {cheap} to predict, which costs least of those; to tell them apart, {told}."
    return f"to tell {listed(names)} apart, {told}."


def prpv_text(fresh: Assessment) -> str:
    """PRPV with its interval."""
    low, high = fresh.prpv_interval.low, fresh.prpv_interval.high
    return str(fresh.prpv.value) if low is None or high is None else in_pairs(fresh.prpv.value, low, high)


def difference_text(one: Difference) -> str:
    """Difference of one PRPV above another, with its interval."""
    ends = "" if one.low is None or one.high is None else f" ({fixed(one.low, 0)} to {fixed(one.high, 0)})"
    return f"+{fixed(one.value, 0)}{ends}"


def seconds_text(value: float, low: float, high: float, unit: str = "", figures: int = 2) -> str:
    """Seconds, or a ratio, with its interval, to so many significant figures."""
    middle, *ends = (f"{float(f'{one:.{figures}g}'):g}" for one in (value, low, high))
    return f"{middle}{unit} ({' to '.join(ends)})"


def _ratio_text(value: float, low: float, high: float) -> str:
    """A ratio with its interval; one that is shown to be above 1 is not told as 1."""
    return seconds_text(value, low, high, figures=3 if NOTICEABLE < low < 1.05 else 2)


def more_text(lesson: Lesson) -> str:
    """Target samples that it takes more, with the interval; why that is not known."""
    if lesson.failure:
        return "cannot teach"
    return "" if lesson.more is None else count(lesson.more, UNKNOWN)


def differences(compared: ComparedFamilies) -> dict[str, Difference]:
    """Differences of the PRPV of each family above the lowest, by name."""
    return {one.worse: one for one in compared.differences if one.better == compared.predicts.best}


def _say_predicting(compared: ComparedFamilies) -> str:
    choice = compared.predicts
    fresh = next((one.fresh for one in compared.families if one.name == choice.best), None)
    if fresh is None:
        return "not known, since no family has fresh episodes"
    score = f"fresh PRPV (proxy relative predictivity value) {prpv_text(fresh)}"
    if fresh.chance.explains:
        return f"none is shown to be better than chance; lowest is {choice.best}, {score}"
    more = differences(compared)
    if any(one.low is None for one in more.values()):
        return f"{choice.best}, {score}; by how much is not known: nothing was driven twice"
    alike = [f"{name} {difference_text(more[name])}" for name in choice.alike]
    worse = [f"{name} {difference_text(one)}" for name, one in more.items() if name not in choice.alike]
    return _join_clauses(f"{choice.best}, {score}", "worse", worse, alike)


def _say_teaching(compared: ComparedFamilies) -> str:
    choice, lessons = compared.teaches, compared.lessons
    if choice.best is None:
        why = "nothing was taught yet" if not lessons else "learners have not converged; raise teaching.target_samples"
        return f"PLV (proxy learning value) is not known, {why}"
    highest = lessons[choice.best].plv
    saved = UNKNOWN if highest is None else count(highest, UNKNOWN)
    worth = f"PLV (proxy learning value) {saved} target samples saved"
    if highest is None or not highest.above_zero:
        return f"none is shown to save target samples; highest is {choice.best}, {worth}"
    others = [name for name in lessons if name not in (choice.best, *choice.alike)]
    alike = [f"{name}, {more_text(lessons[name])} more samples" for name in choice.alike]
    worse = [f"{name}, {_behind(lessons[name])}" for name in others]
    return _join_clauses(f"{choice.best}, {worth}", "worse", worse, alike)


def _behind(lesson: Lesson) -> str:
    if lesson.failure:
        return "which cannot teach"
    return "not converged" if lesson.more is None else f"{more_text(lesson)} more samples"


def _join_clauses(best: str, how: str, worse: list[str], alike: list[str]) -> str:
    """The best, how others are worse, and which cannot be told from it."""
    others = ((how, worse), (NOT_APART, alike))
    return "; ".join([best, *(f"{head}: {'; '.join(names)}" for head, names in others if names)])


def families_text(compared: ComparedFamilies, files: Mapping[str, Any]) -> Group:
    """Several families as `study` prints them, and what was written."""
    uses, theta = families_tables(compared)
    tables = [*section_text(replace(uses, notes=())), *section_text(theta)]
    return group_texts(families_sentence(compared), *tables, *note_texts(uses.notes), *file_texts(files))


def families_tables(compared: ComparedFamilies) -> tuple[Table, Table]:
    """A column per family: what it predicts, teaches and costs, and its best θ with 95 % intervals."""
    columns = columns_of(("",), [one.name for one in compared.families])
    known = [{one.name: one for one in known_parameters(family.result)} for family in compared.families]
    names = dict.fromkeys(name for one in known for name in one)
    theta = tuple((name, *(_theta_cell(one.get(name)) for one in known)) for name in names)
    more, families, costs = differences(compared), compared.families, compared.seconds_per_episode()
    lessons = [compared.lessons.get(one.name) for one in families]
    taught: list[Row] = []
    if compared.settings.teaching:
        behind = ["" if one is None or one.failure else more_text(one) for one in lessons]
        taught = [("PLV", *map(_plv_cell, lessons)), ("  more than highest", *behind)]
    rows: list[Row] = [
        ("fresh PRPV", *(prpv_text(one.fresh) if one.fresh else UNKNOWN for one in families)),
        ("  more than lowest", *(difference_text(more[one.name]) if one.name in more else "" for one in families)),
        *taught,
        ("seconds per episode", *(seconds_text(*costs[one.name]) for one in families)),
        ("seconds of tuning", *(short(one.seconds) for one in families)),
        ("trials", *(str(len(one.result.trials)) for one in families)),
    ]
    notes = ["PRPV is the mean over fresh repetitions at the best θ, from the same starts in every family"]
    notes += [f"{one.name}: {line}" for one in compared.families for line in _say_family(one)]
    notes += [f"{name}: {one.failure}" for name, one in compared.lessons.items() if one.failure]
    return Table(USES, columns, tuple(rows), tuple(notes)), Table(THETA, columns, theta)


def _plv_cell(lesson: Lesson | None) -> str:
    if lesson is None or lesson.plv is None:
        return more_text(lesson) if lesson and lesson.failure else UNKNOWN
    return count(lesson.plv, UNKNOWN)


def _theta_cell(parameter: KnownParameter | None) -> str:
    if parameter is None:
        return ""
    interval = span(parameter.interval) if parameter.identified else "unidentified"
    return f"{short(parameter.best, 4)} {parameter.unit}".strip() + f" ({interval})"


def _say_family(one: TunedFamily) -> list[str]:
    """Notes of a family's own study: a misfit, a perfect one, too few trials, and a time that was not spent."""
    result, settings = one.result, one.result.study.settings
    time, trials = settings.stop.wall_time_s or 0.0, len(result.trials)
    lines = ["no θ explains the target's scores: it lacks something"] if result.knowledge.misfit.fits is False else []
    lines += ["no difference from the target can be seen"] if result.perfect else []
    few = f"{trials} of the {settings.initial} trials of the design were run in its time: its θ is hardly tuned"
    lines += [few] if trials < settings.initial else []
    early = f"{short(one.seconds)} of {time:g} s were spent: {result.stopped or 'its trials have not ended'}"
    return lines + ([early] if one.seconds < time else [])


def families_view(compared: ComparedFamilies, figure: Figure) -> View:
    """Several families: the figure, both tables, and where each family's own page is."""
    settings = compared.settings
    told = ("tuned", "predicts", *(("teaches",) if settings.teaching else ()), "costs")
    seconds, agents = settings.stop.wall_time_s, len(settings.agents)
    meanings = tuple(ABOUT[f"families_{name}"].format(seconds=seconds, agents=agents) for name in told)
    homes = ((one.name, one.result.study.settings.home) for one in compared.families)
    pages = tuple(f"[{name}]({os.path.relpath(home, settings.home)}/report.html)" for name, home in homes)
    parts = (
        picture_of("families", "families", figure),
        *families_tables(compared),
        Paragraphs("What the numbers are", meanings),
        Paragraphs("The page of each family", pages),
    )
    title = f"{settings.name}: which simulator is the most useful?"
    return View(title, families_answer(compared), families_next_step(compared), parts)


def families_document(compared: ComparedFamilies) -> dict[str, Any]:
    """Several tuned families as plain JSON; None where a figure is undefined."""
    costs = compared.seconds_per_episode()
    return {
        "name": compared.settings.name,
        "sentence": families_sentence(compared),
        "best": {
            "predict": _choice_document(compared.predicts),
            "teach": _choice_document(compared.teaches) if compared.settings.teaching else None,
            "cheapest": _choice_document(compared.cheapest),
        },
        "seconds_per_family": compared.settings.stop.wall_time_s,
        "families": {
            one.name: {**_family_document(one, costs[one.name]), **_lesson_document(compared.lessons.get(one.name))}
            for one in compared.families
        },
        "differences": differences_document(compared.differences),
        "settings": dict(settings_document(compared.settings)),
    }


def _choice_document(choice: BestFamilies) -> dict[str, Any]:
    return {"family": choice.best, "cannot_be_told_from": list(choice.alike)}


def _family_document(one: TunedFamily, cost: tuple[float, float, float]) -> dict[str, Any]:
    result, settings = one.result, one.result.study.settings
    fresh = score_document(one.fresh) if one.fresh else {}
    return {
        "family": settings.family,
        "domain": dict(settings.domain.values),
        "theta": dict(one.theta),
        "theta_interval": intervals_document(result.knowledge.intervals),
        "prpv": pairs_document(result.best.trial.prpv),
        "fresh": {key: fresh.get(key) for key in ("prpv", "prpv_interval", "noise_floor", "chance")},
        "seconds_per_episode": cost[0],
        "seconds_per_episode_interval": list(cost[1:]),
        "trials": len(result.trials),
        "seconds": one.seconds,
        "stopped": result.stopped or None,
        "cannot_be_told_from_perfect": bool(result.perfect),
        "fits": result.knowledge.misfit.fits,
        "folder": str(settings.home),
    }


def _lesson_document(lesson: Lesson | None) -> dict[str, Any]:
    if lesson is None:
        return dict.fromkeys(("plv", "plv_interval", "needed", "more", "zero_shot", "cannot_teach"))
    return {
        "plv": lesson.plv.value if lesson.plv else None,
        "plv_interval": [lesson.plv.low, lesson.plv.high] if lesson.plv else None,
        "needed": estimate_document(lesson.needed),
        "more": estimate_document(lesson.more),
        "zero_shot": lesson.zero_shot,
        "cannot_teach": lesson.failure or None,
    }


class Panel(NamedTuple):
    """One of the figure's panels: what its axis says, values of families that have one, and whether ratios count."""

    title: str
    values: Mapping[str, Spread]
    choice: BestFamilies
    ratios: bool = False


def families_figure(compared: ComparedFamilies) -> Figure:
    """Draw each family's fresh PRPV, PLV where there is [teaching], and seconds per episode, with 95 % intervals."""
    names = [one.name for one in compared.families]
    prpv: dict[str, Spread] = {
        one.name: (one.fresh.prpv.value, one.fresh.prpv_interval.low, one.fresh.prpv_interval.high)
        for one in compared.families
        if one.fresh
    }
    known = {name: one.plv for name, one in compared.lessons.items() if one.plv and one.plv.value is not None}
    plv: dict[str, Spread] = {name: (one.value or 0.0, one.low, one.high) for name, one in known.items()}
    panels = [Panel("fresh PRPV\n[ordered pairs]", prpv, compared.predicts)]
    panels += [Panel("PLV\n[samples saved]", plv, compared.teaches)] if compared.lessons else []
    panels.append(Panel("time per\nepisode [s]", dict(compared.seconds_per_episode()), compared.cheapest, ratios=True))
    short_names = [name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…" for name in names]
    figure, (drawn,) = style.grid_of(1.0 + 0.24 * len(names), 1, len(panels), sharey=True)
    for axes, panel in zip(drawn, panels, strict=True):
        _draw(axes, panel, names)
    drawn[0].set_yticks(range(len(names)), short_names)
    drawn[0].set_ylim(len(names) - 0.5, -0.5)
    shown = {_standing(panel, name) for panel in panels for name in names if panel.values.get(name)}
    for label, (marker, edge, face) in LOOKS.items():
        if label in shown:
            drawn[0].plot([], [], marker, color=edge, markerfacecolor=face, markersize=4.5, label=label)
    style.legend_below(figure, *drawn)
    return figure


DECADE = 10.0
"""A logarithmic axis of less than this factor has few powers of ten, or none."""


def _draw(axes: Axes, panel: Panel, names: list[str]) -> None:
    for place, name in enumerate(names):
        if (value := panel.values.get(name)) is None:
            axes.annotate(
                "not known", (0.5, place), xycoords=("axes fraction", "data"), fontsize=7, ha="center", va="center",
                color="0.3",
            )  # fmt: skip
            continue
        middle, low, high = value
        marker, edge, face = LOOKS[_standing(panel, name)]
        ends = [middle if end is None else end for end in (low, high)]
        axes.plot(ends, [place, place], color=edge, linewidth=1.2)
        axes.plot([middle], [place], marker, color=edge, markerfacecolor=face, markersize=4.5)
    style.dress(axes, panel.title)
    axes.margins(x=0.15)
    if panel.ratios:
        axes.set_xscale("log")
        low, high = axes.get_xlim()
        if high < DECADE * low:
            axes.xaxis.set_major_locator(MaxNLocator(2))
        # Exponents would be smaller than can be read.
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        return
    axes.xaxis.set_major_locator(MaxNLocator(3))
    if not any(end is not None and end < 0.0 for value in panel.values.values() for end in value):
        axes.set_xlim(left=0.0)


def _standing(panel: Panel, name: str) -> str:
    return BEST if name == panel.choice.best else ALIKE if name in panel.choice.alike else WORSE
