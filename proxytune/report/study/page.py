"""Page of a study: what was found, what to do next, and all that it stands on; also while it runs."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from proxytune.report import figure_style as style
from proxytune.report.html import write_page
from proxytune.report.study.sentence import say_answer, say_next_step
from proxytune.report.study.tables import INFORMATION, MEASURES, SEARCH, THETA, USEFULNESS, study_tables, trials_table
from proxytune.report.view import Drawn, Foot, Paragraphs, Part, Picture, View, foot_of
from proxytune.report.wording import short
from proxytune.report.writing import ABOUT, picture_of
from proxytune.storage import TrialRecord
from proxytune.study import LEARNING, StudyResult, StudySettings

RENEW_S = 5
WAIT = "wait for the end, which brings intervals and figures; `python -m proxytune plot` draws them as of now."
CONTINUE = "run the same command to continue: everything finished is kept."


def study_view(result: StudyResult, figures: Mapping[str, Drawn]) -> View:
    """A study: its tables, with the figures beside what they are of.

    Args:
        result: What it has found.
        figures: PNG files by the name of the figure, those that there are.
    """
    settings = result.study.settings
    drawn, tables = study_pictures(result, figures), study_tables(result)
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


def study_pictures(result: StudyResult, figures: Mapping[str, Drawn]) -> dict[str, Picture]:
    """Each figure that there is, by its name, with its caption."""
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
    return {name: picture_of("study", name, image, **words) for name, image in figures.items()}


def write_live_page(
    path: Path, settings: StudySettings, objective: str, trials: Sequence[TrialRecord], doing: str
) -> None:
    """Write the page of a study that has not ended, which loads itself again while something is being done.

    Args:
        path: The file.
        settings: The study's.
        objective: The measure that its trials are searched by.
        trials: Those that have ended, in order.
        doing: What is being done; "" once the study was stopped.

    Raises:
        RunError: If it cannot be written.
    """
    view = live_view(settings, objective, trials, doing)
    write_page(path, view, study_foot(settings), RENEW_S if doing else 0)


def live_view(settings: StudySettings, objective: str, trials: Sequence[TrialRecord], doing: str) -> View:
    """A study under way: the trials so far, without what takes long to compute."""
    shown: tuple[Part, ...] = ()
    if trials:
        measures = tuple(dict.fromkeys((objective, *(MEASURES if objective != LEARNING else ()))))
        picture = picture_of("live", "trials", _trials_figure(trials, objective), measure=objective.upper())
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


def _trials_figure(trials: Sequence[TrialRecord], measure: str) -> Figure:
    figure, axes = style.one_panel(2.2)
    points = [(trial.number, value) for trial in trials if (value := trial.measures.get(measure)) is not None]
    axes.plot([number for number, _ in points], [value for _, value in points], "o", color=style.BLUE, markersize=4)
    axes.set_xlim(0.5, len(trials) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    style.dress(axes, "trial", measure.upper())
    return figure
