"""Several domain families from Python: each tuned in the same time, taught if that is asked for, and compared."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from proxytune import report, study
from proxytune.api.study import StudyReport, most_episodes, read_study, run_opened
from proxytune.errors import RunError
from proxytune.running import Watcher, watching
from proxytune.storage import Store, locked
from proxytune.teaching import classrooms, teach_families

Say = Callable[[str], None]
Tuning = Callable[[study.Study], AbstractContextManager[Watcher]]
"""Gives what hears of every episode of a family."""
CURVE_POINTS = "points of learning curves"


@dataclass(frozen=True, repr=False)
class FamiliesReport(report.Shown):
    """Comparison of several domain families: which to use, and for what.

    Attributes:
        compared: The tuned families beside one another.
        spent: What this call has simulated.
    """

    compared: study.ComparedFamilies
    spent: study.Spent

    def __repr__(self) -> str:
        return f"FamiliesReport of '{self.compared.settings.name}': {self.sentence}"

    def view(self) -> report.View:
        """What the page shows."""
        return report.families_view(self.compared, self.figure())

    def figures(self) -> dict[str, Figure]:
        """The figure of all families, by name."""
        return {"families": self.figure()}

    def to_frame(self) -> pd.DataFrame:
        """One row per trial of each family."""
        return pd.concat({name: one.trials() for name, one in self.studies.items()}, names=["family"])

    @property
    def sentence(self) -> str:
        """Say which family predicts best, which teaches best, and which is the cheapest."""
        return report.families_sentence(self.compared)

    @property
    def studies(self) -> dict[str, StudyReport]:
        """Reports of each family's study, by name."""
        return {one.name: StudyReport(one.result, study.Spent()) for one in self.compared.families}

    def document(self) -> dict[str, Any]:
        """The JSON document of `study --json`."""
        return report.families_document(self.compared)

    def figure(self) -> Figure:
        """Fresh PRPV, PLV and cost of each family."""
        return report.families_figure(self.compared)

    def write(self) -> tuple[Path, Path]:
        """Write the figure and the page into the study's folder; their paths.

        Raises:
            RunError: If one cannot be written.
        """
        settings, drawn = self.compared.settings, self.figures()
        (figure,), page = report.save_figures(drawn, settings.home / "figures"), settings.home / "report.html"
        report.write_page(page, report.families_view(self.compared, drawn["families"]), report.study_foot(settings))
        return figure, page


def run_families(path: str | Path, *, progress: bool = False, jobs: int | None = None) -> FamiliesReport:
    """Tune every family of a study in the same time, from wherever an earlier call was left, and compare them.

    Args:
        path: The study's folder, or its study.toml.
        progress: Whether to show a bar with the time left.
        jobs: How many processes run episodes, instead of what study.toml says.

    Raises:
        InputError: If anything in the study cannot be used, or it is of one family.
        RunError: If no trial of a family works, or the machine fails; all that was finished is kept.
    """
    settings = _read_several(path)

    def tuning(opened: study.Study) -> AbstractContextManager[Watcher]:
        return watching(progress, most_episodes(opened.settings))

    return run_opened_families(settings, lambda line: None, tuning, jobs=jobs, progress=progress)


def read_families(path: str | Path) -> FamiliesReport:
    """Look at several families as far as they have been tuned; nothing is simulated, and no code of theirs is run.

    Args:
        path: The study's folder, or its study.toml.

    Raises:
        InputError: If one of them has not been run, or was changed since.
        RunError: If no trial of one has a score yet.
    """
    settings = _read_several(path)
    families = tuple(_tuned(read_study(one.home)) for one in settings.families.values())
    thetas = {one.name: dict(one.theta) for one in families}
    lessons = study.read_lessons(settings) if settings.teaching else {}
    still_so = {name: one for name, one in lessons.items() if dict(one.theta) == thetas.get(name)}
    return FamiliesReport(study.ComparedFamilies(settings, families, still_so), study.Spent())


def run_opened_families(
    settings: study.StudySettings,
    say: Say,
    tuning: Tuning,
    *,
    budget: int | None = None,
    jobs: int | None = None,
    retry_failed: bool = False,
    progress: bool = True,
) -> FamiliesReport:
    """Tune the families one after the other, teach by them where the study has [teaching], and compare them.

    All of them are opened before the first is tuned, so that a mistake is told at once. Progress is of the teaching.
    """
    every = {name: study.open_settings(one) for name, one in settings.families.items()}
    studies = {name: study.with_spending(one, budget=budget, jobs=jobs) for name, one in every.items()}
    classrooms(settings)
    reports: dict[str, StudyReport] = {}
    with locked(settings.home):
        for number, (name, opened) in enumerate(studies.items(), start=1):
            say(f"family {number} of {len(studies)}: {name}")
            reports[name] = _tune(name, opened, say, tuning(opened), retry_failed)
        families = tuple(map(_tuned, reports.values()))
        lessons: dict[str, study.Lesson] = {}
        if settings.teaching is not None:
            say("teaching by each at its best θ")
            own, thetas = replace(settings, jobs=jobs or settings.jobs), {one.name: one.theta for one in families}
            lessons = teach_families(own, thetas, lambda points: watching(progress, points, CURVE_POINTS))
            study.save_lessons(settings, lessons)
    spent = sum((one.spent for one in reports.values()), study.Spent())
    return FamiliesReport(study.ComparedFamilies(settings, families, lessons), spent)


def _read_several(path: str | Path) -> study.StudySettings:
    settings = study.read_study_settings(Path(path))
    if not settings.families:
        raise settings.error("families", "is missing; name two at least, as in [families.planar], or use run_study")
    return settings


def _tune(
    name: str, opened: study.Study, say: Say, bars: AbstractContextManager[Watcher], retry_failed: bool
) -> StudyReport:
    try:
        tuned = run_opened(opened, bars, lambda line: say(f"{name}: {line}"), retry_failed)
    except RunError as problem:
        raise type(problem)(f"families.{name}: {problem}") from problem
    tuned.write()
    return tuned


def _tuned(tuned: StudyReport) -> study.TunedFamily:
    opened = tuned.result.study
    with Store.read(opened.settings.home) as store:
        return study.tuned_family(study.StudyRun(opened, store), tuned.result)
