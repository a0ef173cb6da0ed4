"""Sweeps and learning curves from Python: usefulness along a parameter, and what a proxy saves in training."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from proxytune import report, sweep, teaching
from proxytune.api.driving import given_theta
from proxytune.errors import InputError
from proxytune.running import watching
from proxytune.space import Theta
from proxytune.storage import Store, locked
from proxytune.study import StudyRun, StudySettings, open_study

MOST_POINTS = 10_000


@dataclass(frozen=True, repr=False)
class SweepReport(report.Shown):
    """Usefulness along one parameter or each of a study's.

    Attributes:
        settings: Of the study.
        curves: One for each parameter that was swept.
        chosen: What the others are held at: "best", "nominal" or "given".
        theta: Their values; those not named are nominal.
        episodes: Number of episodes that this call has run.
        truth: The target's own θ, where it is known.
    """

    settings: StudySettings
    curves: tuple[sweep.SweepCurve, ...]
    chosen: str
    theta: Theta
    episodes: int
    truth: Theta | None

    def __repr__(self) -> str:
        swept = ", ".join(curve.parameter for curve in self.curves)
        return f"SweepReport of '{self.settings.name}': {swept}; {self.held}"

    def view(self) -> report.View:
        """What the page shows."""
        return report.sweep_view(self.settings.name, self.curves, self.figures(), self.held)

    def figures(self) -> dict[str, Figure]:
        """A figure per parameter, and two of all, by name."""
        return report.figures_of_sweep(self.curves, self.truth)

    def to_frame(self) -> pd.DataFrame:
        """All tables, one below the other: parameter, value, each measure."""
        return pd.concat(self.tables(), names=["parameter", "value"])

    @property
    def held(self) -> str:
        """Values at which the other parameters are held, in words."""
        if self.chosen == "best":
            values = report.held_values(self.curves, whose="the study's best θ: ")
            return f"{values}; --at nominal holds the robot's own"
        return "the others are nominal" if self.chosen == "nominal" else report.held_values(self.curves)

    def tables(self) -> dict[str, pd.DataFrame]:
        """For each parameter, one row per value: each measure."""
        return {
            curve.parameter: pd.DataFrame(
                {one.key: [found.value for found in one.estimates.values()] for one in sweep.series_of(curve)},
                index=pd.Index([point.value for point in curve.points], name=curve.parameter),
            )
            for curve in self.curves
        }

    def document(self) -> dict[str, Any]:
        """The JSON document of `sweep --json`, without the files."""
        return {
            "curves": [report.curve_document(curve) for curve in self.curves],
            "episodes": {"run": self.episodes},
            "at": {"chosen": self.chosen, "theta": dict(self.theta)},
        }

    def write(self, folder: str | Path | None = None, command: str = "") -> tuple[list[Path], list[Path]]:
        """Write figures, and CSV, JSON and page, into the study's figures unless another folder is given; their paths.

        Raises:
            RunError: If one cannot be written.
        """
        output = self.settings.home / "figures" if folder is None else Path(folder)
        figures = self.figures()
        drawn = report.save_figures(figures, output)
        page = report.write_sweep_page(self.settings, self.curves, figures, output, self.held, command)
        return drawn, [*report.write_curves(self.curves, output), page]


def run_sweep(
    path: str | Path,
    parameter: str = "all",
    *,
    points: int = 13,
    at: str | Theta | None = None,
    target_model: str | Path | None = None,
    progress: bool = False,
) -> SweepReport:
    """Measure usefulness along a parameter, or along each of a study's; what was simulated before is kept.

    Args:
        path: The study's folder, or its study.toml.
        parameter: The one to sweep, or "all" of the study.
        points: Number of values of the parameter.
        at: The others: values by name, a model.toml, "best" or "nominal"; the study's best once a trial is finished.
        target_model: The target's model.toml, if there is one; adds POD, the proxy observation discrepancy.
        progress: Show a bar.

    Raises:
        InputError: If the study, the parameter or a value cannot be used.
        RunError: If no episode works; all that was finished is kept.
    """
    study = open_study(Path(path))
    if not 2 <= points <= MOST_POINTS:
        raise InputError(f"--points must be between 2 and {MOST_POINTS}, got {points}")
    word = ("best" if sweep.has_answer(study) else "nominal") if at is None else at
    if isinstance(word, Mapping):
        base: Theta = word
    elif word == "best":
        base = sweep.best_theta(study)
    else:
        base = given_theta(word, study.settings, study.family, "--at")
    sweep.check_base(study, base)
    names = study.settings.space.names if parameter == "all" else (parameter,)
    sweeps = [sweep.plan_sweep(sweep.sweep_interval(study, name), base, points) for name in names]
    discrepancy = None
    if target_model:
        discrepancy = sweep.discrepancy_study(study, Path(target_model))
        sweeps = [sweep.with_target(one, Path(target_model), discrepancy) for one in sweeps]
    per_point = len(study.settings.agents) + (discrepancy is not None)
    total = sum(len(one.points) for one in sweeps) * per_point * study.settings.starts
    folder = study.settings.home
    with locked(folder), Store.open(folder) as store:
        with watching(progress, total) as watcher:
            run = StudyRun(study, store, watcher)
            for one in sweeps:
                sweep.run_sweep(run, one, discrepancy)
        curves = tuple(curve for one in sweeps if (curve := sweep.curve_of(run, one)))
    chosen = word if word in ("best", "nominal") else "given"
    return SweepReport(study.settings, curves, str(chosen), sweeps[0].base, run.spent.episodes, study.truth)


@dataclass(frozen=True, repr=False)
class TeachReport(report.Shown):
    """Learning curves and PLV, the proxy learning value (eq. 5): how many target samples each proxy saves.

    Attributes:
        settings: Of the study.
        experiment: What was taught, and what it is worth.
        prpv: How useful the same proxies are as predictors.
    """

    settings: StudySettings
    experiment: teaching.Experiment
    prpv: Mapping[str, teaching.Predictivity | None]

    def __repr__(self) -> str:
        return f"TeachReport of '{self.settings.name}': {report.teach_view(self.experiment, self.prpv, b'').sentence}"

    def view(self) -> report.View:
        """What the page shows."""
        return report.teach_view(self.experiment, self.prpv, self.figures()["teach"])

    def figures(self) -> dict[str, Figure]:
        """The learning curves, by name."""
        return {"teach": report.teach_figure(self.experiment)}

    def table(self) -> pd.DataFrame:
        """One row per proxy: PLV, with the ends of its interval where they are known."""
        rows = {name: one["plv"] or {"value": None} for name, one in self.document()["proxies"].items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("proxy")

    to_frame = table

    def document(self) -> dict[str, Any]:
        """The JSON document of `teach --json`, without the files."""
        return report.teach_document(self.experiment, self.prpv)

    def write(self, command: str = "") -> tuple[Path, Path]:
        """Write the figure and the page into the study's folder; their paths.

        Raises:
            RunError: If one cannot be written.
        """
        drawn = self.figures()
        (figure,) = report.save_figures(drawn, self.settings.home / "figures")
        page = figure.with_suffix(".html")
        foot = report.study_foot(self.settings, command)
        report.write_page(page, report.teach_view(self.experiment, self.prpv, drawn["teach"]), foot)
        return figure, page


def teach(path: str | Path, *, progress: bool = False) -> TeachReport:
    """Train learners from each proxy and on the target, and say how many target samples each proxy saves.

    A finished experiment is summed up again without training or driving.

    Args:
        path: The study's folder, or its study.toml, with a [teaching] table.
        progress: Show a bar.

    Raises:
        InputError: If the study or its [teaching] cannot be used.
        RunError: If training fails; all that was finished is kept.
    """
    study = open_study(Path(path))
    settings, setup = study.settings, teaching.load_setup(study.settings)
    # Before anything is written.
    teaching.check_proxies(settings, setup)
    proxies = setup.settings.proxies
    with locked(settings.home), Store.open(settings.home) as store:
        examinations = teaching.count_examinations(setup.settings, len(proxies) + 1)
        with watching(progress, examinations, "points of learning curves") as bars:
            experiment = teaching.run_experiment(settings, setup, bars)
        with watching(progress, len(settings.agents) * settings.starts * len(proxies)) as bars:
            prpv = teaching.predictivity(StudyRun(study, store, bars), proxies)
    return TeachReport(settings, experiment, prpv)
