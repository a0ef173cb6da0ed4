"""Search for the proxy of highest PLV: sentence, tables, figure, page and JSON document."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.console import Group

from proxytune import teaching
from proxytune.learning import Distribution, describe_distribution
from proxytune.report import figure_style as style
from proxytune.report.html import write_page
from proxytune.report.study.document import estimate_document
from proxytune.report.study.page import study_foot
from proxytune.report.teaching import CONVERGED, PLV_MEANING, UNKNOWN, count, one_decimal, say_more, theta_document
from proxytune.report.text import file_texts, group_texts, table_text
from proxytune.report.view import Paragraphs, Table, View, columns_of
from proxytune.report.wording import listed, short
from proxytune.report.writing import picture_of, save_figure
from proxytune.study import settings_document

MORE_PROXIES = "raise teaching.budget, or widen [parameters], so that other proxies are tried"
CONFIRMED = "Finalists, taught anew with fresh lessons, learners and examinations"
SCORES = ("zero-shot score", "samples needed", "PLV")
HIGHEST = style.LineName("highest\nso far", style.VERMILLION, 0.0)


def plv_answer(study: teaching.PlvStudy) -> str:
    """The finalist of highest PLV, whether it is shown to save anything, and which others may be as good."""
    experiment, best = study.confirmed, teaching.best_teacher(study.confirmed)
    if best is None or best.worth is None:
        return f"Of {len(study.trials)} proxies tried, no finalist is known to save target samples."
    others = [one.name for one in experiment.teachers if one is not best]
    behind = [name for name in others if teaching.saves_more(experiment, best.name, name).above_zero]
    alike = [name for name in others if name not in behind]
    plv, judged = best.worth.plv, "that it saves any is not shown: the interval holds 0"
    if plv.above_zero or plv.at_most_zero:
        judged = "it saves target samples" if plv.above_zero else "it saves none"
    sentences = [
        f"After {len(study.trials)} proxies tried, {best.name} ({describe_distribution(best.proxy)}) has the highest "
        f"PLV (proxy learning value): {count(plv, UNKNOWN)} target samples saved; {judged}.",
        f"It saves more than {listed(behind)}." if behind else "",
        f"That it saves more than {listed(alike)} is not shown." if alike else "",
    ]
    return " ".join(filter(None, sentences))


def plv_next_step(study: teaching.PlvStudy) -> str:
    """The step that brings most."""
    best = teaching.best_teacher(study.confirmed)
    if best is None or best.worth is None:
        unknown = teaching.why_unknown(study.confirmed.needs)
        return f"{unknown.remedy}: {unknown.reason}." if unknown else f"{MORE_PROXIES}."
    if best.worth.plv.at_most_zero:
        return f"train without a proxy, or {MORE_PROXIES}."
    if best.worth.plv.above_zero:
        return f"train in {best.name}: {describe_distribution(best.proxy)}, then on target samples."
    return f"{say_more(study.confirmed)}, which narrows the intervals, or teaching.budget, which tries more proxies."


def plv_text(study: teaching.PlvStudy, files: Mapping[str, Any]) -> Group:
    """The trials as `study` prints them, the best one first, what was searched, and the finalists."""
    finals, tried = (table_text(replace(table, title="")) for table in _tables(study))
    head = f"{study.settings.name}: {len(study.trials)} proxies tried, the one of highest PLV first"
    box = ", ".join(f"{interval.name} [{interval.low:.4g}, {interval.high:.4g}]" for interval in study.space.intervals)
    by = " (narrowed to the θ whose PRPV is as low as the best, within noise)" if study.narrowed else ""
    converged = CONVERGED.format(f"{study.when.threshold:.1f}")
    said = (f"searched: {box}{by}", f"stopped: {study.stopped}", PLV_MEANING, converged, *_cautions(study))
    first, last = f"{plv_answer(study)}\n", f"\n{CONFIRMED}:"
    return group_texts(first, head, tried, *said, *file_texts(files), last, finals, *study.unable.values())


def write_plv_report(study: teaching.PlvStudy, folder: Path) -> tuple[Path, Path]:
    """Draw PLV of every trial, and write the page; the paths of both."""
    figure, page = folder / "figures" / "plv.png", folder / "report.html"
    drawn = plv_figure(study)
    save_figure(drawn, figure)
    finals, tried = _tables(study)
    stopped = Paragraphs("Why the search ended", (f"{study.stopped}.", f"{PLV_MEANING}."))
    picture = picture_of("teach", "plv", drawn)
    finalists = replace(finals, notes=(PLV_MEANING, *study.unable.values(), *_cautions(study)))
    title = f"{study.settings.name}: in which simulator does a learner learn most?"
    view = View(title, plv_answer(study), plv_next_step(study), (finalists, picture, tried, stopped))
    write_page(page, view, study_foot(study.settings))
    return figure, page


def _cautions(study: teaching.PlvStudy) -> list[str]:
    return list(filter(None, [teaching.caution_of_threshold(study.confirmed.needs)]))


def _tables(study: teaching.PlvStudy) -> tuple[Table, Table]:
    """The finalists, and all trials, the best one first: p(θ) by parameter, and what each is worth."""

    def spans(proxy: Distribution) -> list[str]:
        bounds = [proxy.bounds[name] for name in names]
        return [short(low) if low == high else f"{short(low)} to {short(high)}" for low, high in bounds]

    def row(name: str, one: teaching.PlvTrial | teaching.TeacherResult) -> tuple[str, ...]:
        worth = (count(one.worth.needed), count(one.worth.plv, UNKNOWN)) if one.worth else ("", UNKNOWN)
        return (name, *spans(one.proxy), one_decimal(one.zero_shot), *worth)

    experiment, best, names = study.confirmed, teaching.best_teacher(study.confirmed), study.settings.space.names
    ordered = sorted(study.trials, key=lambda trial: (trial is not study.best, trial.number))
    trials = tuple(row(str(trial.number), trial) for trial in ordered)
    leads = [
        count(teaching.saves_more(experiment, best.name, one.name), UNKNOWN) if best and best is not one else ""
        for one in experiment.teachers
    ]
    finals = tuple((*row(one.name, one), lead) for one, lead in zip(experiment.teachers, leads, strict=True))
    heads = (*names, *SCORES)
    return (
        Table(CONFIRMED, columns_of(("finalist",), (*heads, "the best saves more by")), finals),
        Table("Proxies tried, the best first", columns_of(("trial",), heads), trials),
    )


def plv_document(study: teaching.PlvStudy) -> dict[str, Any]:
    """A search by PLV as plain JSON; its keys are promises."""
    experiment, best = study.confirmed, teaching.best_teacher(study.confirmed)
    more = [teaching.saves_more(experiment, best.name, it.name) if best else None for it in experiment.teachers]
    finalists = {
        one.name: {
            "theta": theta_document(one.proxy),
            "zero_shot": one.zero_shot.value,
            "plv": estimate_document(one.worth.plv if one.worth else None),
            "plv_cost": estimate_document(one.cost),
            "needed": estimate_document(one.worth.needed if one.worth else None),
            "best_saves_more": estimate_document(saved),
        }
        for one, saved in zip(experiment.teachers, more, strict=True)
    }
    return {
        "name": study.settings.name,
        "objective": "plv",
        "best": {"index": None, "name": best.name, **finalists[best.name]} if best else None,
        "best_trial": _trial_document(study.best),
        "cautions": _cautions(study),
        "confirmed": {
            "best": best.name if best else None,
            "settled": experiment.settled,
            "finalists": finalists,
            "cannot_teach": dict(study.unable),
        },
        "trials": [_trial_document(trial) for trial in study.trials],
        "searched": {interval.name: [interval.low, interval.high] for interval in study.space.intervals},
        "narrowed_by_prpv": study.narrowed,
        "stopped": study.stopped,
        "convergence": {"level": study.when.level, "threshold": study.when.threshold},
        "settings": dict(settings_document(study.settings)),
    }


def _trial_document(trial: teaching.PlvTrial) -> dict[str, Any]:
    return {
        "index": trial.number,
        "theta": dict(trial.theta),
        "plv": estimate_document(trial.worth.plv),
        "needed": estimate_document(trial.worth.needed),
        "zero_shot": trial.zero_shot.value,
    }


def plv_figure(study: teaching.PlvStudy) -> Figure:
    """Draw PLV with its 95 % interval trial by trial, and the highest so far; crosses did not converge."""
    figure, axes = style.one_panel(2.7)
    grid = study.without.counts[-1]
    for trial in study.trials:
        figures = trial.worth.plv
        if figures.value is None:
            axes.plot(trial.number, 0.0, "x", color="black", markersize=5, label="not converged")
            continue
        low, high = (end if end is not None else far for end, far in ((figures.low, -grid), (figures.high, grid)))
        axes.plot((trial.number, trial.number), (low, high), color=style.BLUE, linewidth=1.0, alpha=0.6)
        axes.plot(trial.number, figures.value, "o", color=style.BLUE, markersize=4, label="PLV")
    values = np.array([teaching.plv_or_worst(trial) for trial in study.trials])
    numbers = np.arange(1, len(values) + 1)
    highest = np.maximum.accumulate(values)
    reached = np.isfinite(highest)
    axes.step(numbers[reached], highest[reached], where="post", color=HIGHEST.colour, lw=1.5, label=HIGHEST.words)
    axes.axhline(0.0, color=style.GREY, linewidth=0.8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    style.dress(axes, "trial", "PLV [target samples saved]")
    if reached.any():
        style.name_lines(axes, [HIGHEST._replace(end=float(highest[-1]))])
    style.legend_below(figure, axes, without=[HIGHEST.words])
    return figure
