"""A study for people: its tables, on the terminal and as files, and its page, also while it runs."""

import shlex
from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.ticker import MaxNLocator
from rich.console import Group

from proxytune.report import figure_style as style
from proxytune.report.html import write_page
from proxytune.report.study.sentence import known_parameters, say_answer, say_next_step, study_sentence
from proxytune.report.text import file_texts, group_texts, latex_text, section_text
from proxytune.report.view import Column, Drawn, Foot, Paragraphs, Part, Table, View, columns_of, foot_of
from proxytune.report.wording import fixed, listed, pairs_span, percent, plain, probability, short, span, with_span
from proxytune.report.writing import ABOUT, picture_of, write_text
from proxytune.storage import TrialRecord
from proxytune.study import LEARNING, PRPV, Preflight, StudyResult, StudySettings
from proxytune.usefulness import LEFT_OUT, PAIRED, PERFECT, Estimate

Rows = list[tuple[str, ...]]
THETA, INFORMATION, SEARCH = "Parameters", "What informs each parameter", "Search"
USEFULNESS = "Usefulness at the best θ (lower is better; 95 % intervals)"
IN_SEARCH, MISFIT = "  in search", "misfit (p)"
AGENTS, METRICS = 2, 1
"""Numbers of agents and metrics that are named of those that inform a parameter most."""
MEASURES = ("prpv", "ppv")


def study_text(result: StudyResult, spent: str, files: Mapping[str, Any]) -> Group:
    """The result of a study as `study` prints it: one sentence, then one table per subject, a fact a row.

    Episodes and seconds of this run are its last fact, and below all stand the files that were written.
    """
    sections = [part for table in study_tables(result, spent).values() for part in section_text(table)]
    return group_texts(study_sentence(result), *sections, *file_texts(files))


def study_tables(result: StudyResult, spent: str = "") -> dict[str, Table]:
    """Tables by title: what is known of θ, how useful the proxy is there, what informs each parameter, the search."""
    tables = (theta_table(result), usefulness_table(result), information_table(result), search_table(result, spent))
    return {table.title: table for table in tables if table.rows}


def theta_table(result: StudyResult) -> Table:
    """A row per parameter, then the shares of the box that are left; the truth has a column only where it is known."""
    share, as_good = result.knowledge.as_good
    truth, rows = result.truth, Rows()
    for known, box in zip(known_parameters(result), result.study.settings.space.intervals, strict=True):
        low, high = known.interval
        true = None if truth is None else truth.get(known.name)
        outside = "" if true is None or low <= true <= high else " (outside)"
        best, inner = f"{short(known.best, 4)} {known.unit}".strip(), span(known.interval)
        told = () if truth is None else ("" if true is None else f"{short(true, 4)}{outside}",)
        beside = (span(as_good[known.name]), f"{short(box.low)} to {short(box.high)}")
        rows.append((known.name, best, inner if known.identified else "unidentified", *told, *beside))
    left = percent(result.knowledge.posterior.share)
    rows.append(("share of the box", "", left, *(() if truth is None else ("",)), percent(share), ""))
    heads = ("best", "95 % interval", *(() if truth is None else ("truth",)), "by PRPV alone", "box")
    return Table(THETA, columns_of(("parameter",), heads), tuple(rows), (*_theta_notes(result), *result.cautions))


def _theta_notes(result: StudyResult) -> list[str]:
    """Say what is not identified, what is odd about the best θ, and which parameters trade off; most needed first."""
    space, learnt, notes = result.study.settings.space, result.knowledge, list[str]()
    if learnt.unidentified:
        count = len(result.trials) + result.earlier
        few = f"{count} trials exclude almost no value of" if count != 1 else "1 trial excludes almost no value of"
        names = listed(list(map(plain, learnt.unidentified)))
        notes.append(f"{few} {names}; unidentified: the interval fills more than 0.9 of the range")
    chance = "changed nothing at all in the pre-flight: unless it acts together with another, its interval is chance"
    notes += [f"{plain(name)} {chance}" for name in space.names if name in result.dead - set(learnt.unidentified)]
    if not result.inside:
        notes.append("the best θ by PRPV is outside the 95 % region, which uses every metric of every agent")
    if result.truth is not None and set(space.names) <= set(result.truth):
        holds = learnt.holds(space.values(result.truth))
        notes.append(f"the 95 % region {'contains' if holds else 'does not contain'} the truth")
    notes += [
        f"{plain(one)} and {plain(other)} trade off: a change of one makes up for the other "
        f"(correlation {fixed(correlation, 1)})"
        for one, other, correlation in sorted(learnt.trades, key=lambda pair: -abs(pair[2]))
    ]
    return notes


def usefulness_table(result: StudyResult) -> Table:
    """PRPV on fresh episodes and in the search, the noise floor, chance, PPV, and whether the model fits.

    Its notes are not what the sentence says already, nor advice on the options of `score`.
    """
    own, chance, expected = result.best.assessment, result.judged.chance, result.expected
    rows, floor = [*_objective_rows(result), *_prpv_rows(result)], result.floor
    if floor.value is not None and floor.low is not None and floor.high is not None:
        meaning = floor.meaning if expected is None else "what a perfect proxy scores against this target"
        rows.append((f"  {floor.title}", fixed(floor.value, 0), pairs_span(floor.low, floor.high), meaning))
    if excess := result.excess:
        rows.append(("  excess", fixed(excess.value, 0), pairs_span(*excess[1:]), _say_excess(excess)))
    if result.nominal:
        level = result.nominal.expected.prpv.value
        rows.append(("  nominal", fixed(level.value, 0), pairs_span(*level[1:]), "the simulator as it is"))
    as_low = f"a random ranking; as low: {probability(chance.p_value)}"
    rows.append(("  chance", fixed(chance.mean, 1), f"± {fixed(chance.deviation, 1)}", as_low))
    meaning = "proxy predictivity value: error of the scores"
    if expected and expected.ppv:
        found, (value, low, high) = expected.ppv, expected.ppv.value
        more = f"; a perfect proxy's {with_span(*found.floor)}" if found.floor else ""
        rows.append(("PPV", f"{value:.3g}", f"{short(low)} to {short(high)}", meaning + more))
    elif own.ppv.value is not None:
        rows.append(("PPV", f"{own.ppv.value:.3g}", "", meaning))
    misfit = result.knowledge.misfit
    if misfit.p_value is None:
        why = "these tell nothing of θ" if misfit.deviance is None else "too few complete trials"
        rows.append((MISFIT, "–", "", f"no test whether any θ explains the target's scores: {why}"))
    else:
        fits = "some θ may explain" if misfit.fits else "no θ explains"
        rows.append((MISFIT, f"{misfit.p_value:.2g}", "", f"{fits} the target's scores"))
    columns = (*columns_of(("measure",), ("value", "interval")), Column("meaning"))
    notes = tuple(note for note in result.judged.notes if note not in (PAIRED, PERFECT, LEFT_OUT))
    return Table(USEFULNESS, columns, tuple(rows), notes)


def _say_excess(excess: Estimate) -> str:
    if ceil(excess.high) < 0:
        return "less than a perfect proxy, so not worse"
    return "more than a perfect proxy" if excess.low > 0.0 else "more than a perfect proxy; may be none"


def _objective_rows(result: StudyResult) -> Rows:
    """The study's objective at the best θ, in the search and on fresh episodes; nothing where it is PRPV."""
    objective, value = result.study.objective, result.value_of(result.best.trial)
    if objective == PRPV or value is None:
        return []
    rows: Rows = [(objective.label, f"{value:.4g}", "", "the objective, in the search's own episodes")]
    scores = result.confirmation.answer.scores if result.confirmation else ()
    fresh = [objective.sign * score for score in scores if score is not None]
    return [*rows, ("  fresh", f"{sum(fresh) / len(fresh):.4g}", "", "on fresh episodes")] if fresh else rows


def _prpv_rows(result: StudyResult) -> Rows:
    """PRPV that is expected of the best θ, that of the fresh episodes that chose it, and of the search's own."""
    own, confirmation, expected = result.best.assessment, result.confirmation, result.expected
    pairs = f"wrongly ordered pairs, 0 to {own.prpv.range[1]}"
    value = str(own.prpv.value)
    if confirmation is None:
        return [("PRPV", value, "", f"{pairs}; the search's own episodes")]
    if expected is None:
        failed = "none on fresh episodes: an agent failed in all of them"
        return [("PRPV", "–", "", failed), (IN_SEARCH, value, "", pairs)]
    optimism, others = confirmation.answer.optimism or 0.0, len(confirmation.candidates) - 1
    luck = f"{optimism:.3g} lower by luck" if optimism > 0.0 else "no optimism"
    luck = luck if result.study.settings.objective == "prpv" else pairs  # luck is of what was searched by
    rivals = f"; {others} runner{'' if others == 1 else 's'}-up re-run as well" if others else ""
    count = f"in {expected.repetitions} more run{'s' if expected.repetitions > 1 else ''}"
    told = fixed(expected.prpv.value.value, 0), pairs_span(*expected.prpv.value[1:])
    return [("PRPV", *told, f"{pairs}; expected, {count}"), (IN_SEARCH, value, "", f"{luck}{rivals}")]


def information_table(result: StudyResult) -> Table:
    """A row for every parameter of which the scores hold information, with shares of Fisher's information."""

    def largest(shares: Sequence[tuple[str, float]], count: int) -> str:
        return ", ".join(f"{name} {percent(share)}" for name, share in shares[:count] if share >= 0.005)

    rows = tuple(
        (one.name, agents, largest(one.metrics, METRICS), one.limit)
        for one in result.information
        if (agents := largest(one.agents, AGENTS))
    )
    return Table(INFORMATION, columns_of(("parameter", "most informative agents", "metric", "limited by")), rows)


def search_table(result: StudyResult, spent: str = "") -> Table:
    """Trials and why they ended, the pre-flight, trials stopped early, what PRPV depends on, what failed."""
    count, budget = len(result.trials), result.study.settings.budget
    number = f"{count} (budget {budget})" if count > budget else f"{count} of {budget}"
    ended = f"; ended: {result.stopped}" if result.stopped else ""
    best = f"trial {result.best.trial.number}" if result.best.trial.number else "a θ that no trial visited"
    rows: Rows = [("trials", f"{number}; best: {best}{ended}")]
    if result.earlier:
        rows.append(("earlier", f"{result.earlier} trials of {', '.join(result.study.settings.learn_from)}"))
    if result.low_fidelity:
        names = ", ".join(result.study.settings.low_fidelity)
        rows.append(("low fidelity", f"{result.low_fidelity} trials of {names}, corrected by this proxy's"))
    if result.preflight is not None:
        rows += [("pre-flight", line) for line in _preflight_lines(result, result.preflight)]
    if result.pruned:
        episodes, seconds = result.spared
        trials = f"{len(result.pruned)} trial{'' if len(result.pruned) == 1 else 's'} that could not be the best"
        rows.append(("stopped early", f"{trials}; saved {episodes} episodes ({seconds:.3g} s)"))
    ordered = sorted(result.importances, key=lambda one: -one.share)
    shares = [f"{one.name} {one.share:.2f} ({one.interval[0]:.2f} to {one.interval[1]:.2f})" for one in ordered]
    rows.append(("Sobol index", f"total, of {result.study.objective.label} over the box: {', '.join(shares)}"))
    if result.failed_episodes:
        failed = sum(trial.state == "failed" for trial in result.trials)
        lost = f", and with them {failed} of {count} trials" if failed else ""
        head = f"{result.failed_episodes} of {result.episodes} episodes{lost}; the first:"
        rows += [("failed", head), *(("", line) for line in result.failures)]
    if spent:
        rows.append(("episodes", spent))
    return Table(SEARCH, columns_of(("", "")), tuple(rows))


def _preflight_lines(result: StudyResult, preflight: Preflight) -> list[str]:
    """What the pre-flight warned of, but for the parameters that trials have identified since."""
    vague = {*result.knowledge.unidentified, *result.dead}
    settled = {one.warning for one in preflight.movements if one.pairs and one.interval.name not in vague}
    warnings = [line.removeprefix("pre-flight: ") for line in preflight.warnings if line not in settled]
    identified = " or is identified" if any(settled) else ""
    return warnings or [f"every parameter changes some metric beyond noise{identified}"]


def trials_table(trials: Sequence[TrialRecord], names: Sequence[str], measures: Sequence[str] = MEASURES) -> Table:
    """Every trial that has ended: its θ, in the order of these names, and its measures, the first of which counts."""
    rows = Rows()
    for trial in trials:
        first, *others = (trial.measures.get(name) for name in measures)
        counts = "failed" if first is None else f"{first:g}"
        if trial.bound is not None:
            counts = f"stopped early, at least {trial.bound:g}"
        theta = (f"{trial.theta[name]:.4g}" for name in names)
        beside = ("" if value is None else f"{value:.3g}" for value in others)
        rows.append((str(trial.number), *theta, counts, *beside, str(trial.failed_episodes)))
    heads = ("trial", *names, *(name.upper() for name in measures), "failed episodes")
    return Table("Trials", columns_of((), heads), tuple(rows))


def write_study_tables(result: StudyResult, trials: pd.DataFrame, folder: Path) -> list[Path]:
    """Write trials.csv, a row per trial, and as LaTeX parameters.tex and usefulness.tex; their paths."""
    texts = {"trials.csv": trials.to_csv(lineterminator="\n")}
    for name, table, width in (("parameters", theta_table(result), None), ("usefulness", usefulness_table(result), 3)):
        heads = [one.name for one in table.columns]
        texts[f"{name}.tex"] = latex_text(heads[:width], [row[:width] for row in table.rows])
    for name, text in texts.items():
        write_text(folder / name, text)
    return [folder / name for name in texts]


RENEW_S = 5
WAIT = "wait for the end, which brings intervals and figures; `python -m proxytune plot` draws them as of now."
CONTINUE = "run the same command to continue: everything finished is kept."


def study_view(result: StudyResult, figures: Mapping[str, Drawn]) -> View:
    """A study: its tables, with the figures, those that there are by name, beside what they are of."""
    settings, tables = result.study.settings, study_tables(result)
    nothing = " Where almost nothing is grey, the parameter is unidentified: these trials exclude almost no value."
    fresh = " The diamond is the answer in episodes that the search has not seen: only that is free of luck."
    hollow = "; open ones were stopped early, and theirs is an estimate"
    words = {
        "truth": " The triangle is the θ that made the target." if result.truth is not None else "",
        "unidentified": nothing if result.knowledge.unidentified else "",
        "fresh": fresh if result.expected else "",
        "nominal": " The square is the simulator as it is, at its nominal θ." if result.nominal else "",
        "floor": " What lies within the green band is within noise." if result.floor.value is not None else "",
        "cut": hollow if any(trial.bound is not None for trial in result.trials) else "",
    }
    drawn = {name: picture_of("study", name, image, **words) for name, image in figures.items()}
    parts = (
        tables[THETA],
        drawn.get("profiles"),
        tables[USEFULNESS],
        drawn.get("convergence"),
        tables.get(INFORMATION),
        drawn.get("importance"),
        drawn.get("evaluations"),
        tables[SEARCH],
        Paragraphs("What PRPV and the intervals are", (ABOUT["study"].format(agents=len(settings.agents)),)),
        trials_table(result.trials, settings.space.names),
    )
    present: tuple[Part, ...] = tuple(part for part in parts if part is not None)
    title = f"{settings.name}: which θ makes the simulator useful?"
    return View(title, say_answer(result), f"{say_next_step(result)}.", present)


def study_foot(settings: StudySettings, command: str | None = None) -> Foot:
    """The foot of a page of a study: the command, that of `study` if none is given, and what study.toml says."""
    stated = [
        ("domain family", settings.family),
        ("proxy", settings.proxy.name if settings.proxy else "the family's nominal model"),
        ("target", ", ".join(path.name for path in settings.targets)),
        ("metrics", ", ".join(str(metric) for metric in settings.metrics)),
        ("agents", ", ".join(settings.agents)),
        ("starts", str(settings.starts)),
        ("engine", settings.engine),
        ("seed", str(settings.seed)),
    ]
    own = f"python -m proxytune study {shlex.quote(str(settings.home))}"
    return foot_of(own if command is None else command, [(name, value) for name, value in stated if value])


def write_live_page(
    path: Path, settings: StudySettings, objective: str, trials: Sequence[TrialRecord], doing: str
) -> None:
    """Write the page of a study that has not ended, which loads itself again while something is being done.

    The trials are those that have ended, in order; what is being done is "" once the study was stopped.
    """
    write_page(path, live_view(settings, objective, trials, doing), study_foot(settings), RENEW_S if doing else 0)


def live_view(settings: StudySettings, objective: str, trials: Sequence[TrialRecord], doing: str) -> View:
    """A study under way: the trials so far, without what takes long to compute."""
    shown: tuple[Part, ...] = ()
    if trials:
        measures = tuple(dict.fromkeys((objective, *(MEASURES if objective != LEARNING else ()))))
        figure, axes = style.one_panel(2.2)
        points = [(one.number, value) for one in trials if (value := one.measures.get(objective)) is not None]
        axes.plot([number for number, _ in points], [value for _, value in points], "o", color=style.BLUE, markersize=4)
        axes.set_xlim(0.5, len(trials) + 0.5)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        style.dress(axes, "trial", objective.upper())
        picture = picture_of("live", "trials", figure, measure=objective.upper())
        shown = (picture, trials_table(trials, tuple(trials[0].theta), measures))
    sentence = f"{f'Under way: {doing}.' if doing else 'Stopped before its end.'} {_say_best(trials, objective)}"
    return View(f"{settings.name}: which θ makes the simulator useful?", sentence, WAIT if doing else CONTINUE, shown)


def _say_best(trials: Sequence[TrialRecord], measure: str) -> str:
    """The trial whose score is best so far."""
    scored = [trial for trial in trials if trial.state == "finished" and trial.score is not None]
    if not scored:
        return "No trial has a score yet."
    best = min(scored, key=lambda trial: trial.score or 0.0)
    value = best.measures.get(measure)
    score = "" if value is None else f", {measure.upper()} {short(value)}, which may be partly luck"
    return f"Best of {len(trials)} trials so far: trial {best.number}{score}."
