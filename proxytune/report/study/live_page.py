"""A study under way as a page: the trials so far, without what takes long to compute."""

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from proxytune.report.numbers import short
from proxytune.report.page.foot import foot_of
from proxytune.report.page.parts import Page, Picture
from proxytune.report.study.page import study_command, study_settings
from proxytune.report.study.trials_table import MEASURES, trials_table
from proxytune.report.style import BLUE, COLUMN, dress
from proxytune.report.writing import png_of
from proxytune.storage import TrialRecord
from proxytune.study import LEARNING, StudySettings

RENEW_S = 5
WAIT = "wait for the end, which brings intervals and figures; `python -m proxytune plot` draws them as of now."
CONTINUE = "run the same command to continue: everything finished is kept."


def live_page(settings: StudySettings, objective: str, trials: Sequence[TrialRecord], doing: str) -> Page:
    """The page of a study that has not ended.

    Args:
        settings: The study's.
        objective: The measure that its trials are searched by.
        trials: Those that have ended, in order.
        doing: What is being done; "" once the study was stopped.
    """
    measures = tuple(dict.fromkeys((objective, *(MEASURES if objective != LEARNING else ()))))
    shown = (_picture(trials, objective), trials_table(trials, tuple(trials[0].theta), measures)) if trials else ()
    return Page(
        settings.name,
        _answer(trials, objective, doing),
        WAIT if doing else CONTINUE,
        shown,
        foot_of(study_command(settings), study_settings(settings)),
        RENEW_S if doing else 0,
    )


def _answer(trials: Sequence[TrialRecord], measure: str, doing: str) -> str:
    """How far it is, and the trial whose score is best so far."""
    state = f"Under way: {doing}." if doing else "Stopped before its end."
    scored = [trial for trial in trials if trial.state == "finished" and trial.score is not None]
    if not scored:
        return f"{state} No trial has a score yet."
    best = min(scored, key=lambda trial: trial.score or 0.0)
    value = best.measures.get(measure)
    score = "" if value is None else f", {measure.upper()} {short(value)}, which may be partly luck"
    return f"{state} Best of {len(trials)} trials so far: trial {best.number}{score}."


def _picture(trials: Sequence[TrialRecord], measure: str) -> Picture:
    caption = "Each point is a trial; trials that failed or were stopped early have none. The best may be luck."
    return Picture(f"{measure.upper()} trial by trial", png_of(_figure(trials, measure)), caption)


def _figure(trials: Sequence[TrialRecord], measure: str) -> Figure:
    figure = Figure(figsize=(COLUMN, 2.2), layout="constrained")
    axes = figure.subplots()
    points = [(trial.number, value) for trial in trials if (value := trial.measures.get(measure)) is not None]
    axes.plot([number for number, _ in points], [value for _, value in points], "o", color=BLUE, markersize=4)
    axes.set_xlim(0.5, len(trials) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("trial", fontsize=8)
    axes.set_ylabel(measure.upper(), fontsize=8)
    dress(axes)
    return figure
