"""A study from Python: run or resume it, or look at what it has; the command `study` is this and a terminal."""

import warnings
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from proxytune import report, study
from proxytune.domain import Outcome
from proxytune.running import Watcher, watching
from proxytune.search import History, optimize_result
from proxytune.settings import check_whole
from proxytune.space import Theta
from proxytune.storage import Store, locked


class ReportFiles(NamedTuple):
    """Paths of a study's figures and of its page."""

    figures: list[Path]
    page: Path


@dataclass(frozen=True, repr=False)
class StudyReport(report.Shown):
    """Result of a study.

    Attributes:
        result: All of it.
        spent: What this call has simulated: `spent.episodes`, `spent.seconds`.
    """

    result: study.StudyResult
    spent: study.Spent

    def __repr__(self) -> str:
        return f"StudyReport of '{self.result.study.settings.name}': {self.sentence}"

    def view(self) -> report.View:
        """What the page shows."""
        return report.study_view(self.result, self.figures())

    @property
    def sentence(self) -> str:
        """Say what was found, how good the proxy is there, and what to do next."""
        return report.study_sentence(self.result)

    @property
    def best(self) -> study.Best:
        """The answer: its trial, the PRPV expected there, and how useful the proxy is by every measure."""
        return self.result.best

    @property
    def theta(self) -> dict[str, float]:
        """The best θ: what to run the simulator with."""
        return dict(self.best.trial.theta)

    def trials(self) -> pd.DataFrame:
        """One row per trial that has ended: its θ, state, score and measures.

        The state is "finished", "failed", or "cut" where it was seen early that it could not be the best. The score is
        what the search makes small: the objective, negative where that is to be large; of a trial that was cut, the
        expected one.
        """
        rows = [
            {"trial": one.number, **one.theta, "state": one.state, "score": one.score, **one.measures}
            for one in self.result.trials
        ]
        return pd.DataFrame(rows, columns=None if rows else ["trial"]).set_index("trial")

    to_frame = trials

    def posterior(self, draws: int = 4000, seed: int = 0) -> pd.DataFrame:
        """Draw θ from what is known of it: a column per parameter, in its unit; how they trade off is in the rows.

        Each row is a θ that may have made the target, given every metric of every agent, drawn as often as it is
        probable over the box. Run a simulator at some of them to see what is left open; of one column alone, the
        central 95 % are the interval in the answer, but for the chance of the draws and ends of the box, which are
        held there where they are as probable.

        Args:
            draws: How many rows.
            seed: Of the draws.

        Raises:
            InputError: If the number of draws, or the seed, cannot be used.
        """
        check_whole("draws", draws, 1)
        check_whole("seed", seed)
        return pd.DataFrame(self.result.knowledge.draw(draws, seed), columns=list(self.result.knowledge.space.names))

    def figures(self) -> dict[str, Figure]:
        """Convergence, profiles, evaluations and importance, by name."""
        return report.study_figures(self.result)

    def history(self) -> History:
        """Its trials as a search of any kind has them, for Optuna and scikit-optimize."""
        return study.history_of(self.result)

    def optimize_result(self) -> Any:
        """scikit-optimize's OptimizeResult, as `skopt.plots` draws it: x, fun, x_iters, func_vals, space.

        `x` is the best θ and `fun` the score of its trial; the lowest of `func_vals` would be partly luck. Trials that
        were cut off or failed are left out. What is to be large has its sign turned.
        """
        return optimize_result(self.history())

    def document(self) -> dict[str, Any]:
        """The JSON document of `study --json`."""
        return report.study_document(self.result)

    def write(self, folder: str | Path | None = None, command: str = "") -> ReportFiles:
        """Write the figures and report.html, into the study's folder unless another is given.

        Args:
            folder: Where to.
            command: What the page's foot says makes it again; `study` where nothing is given.

        Raises:
            RunError: If a file cannot be written.
        """
        settings, figures = self.result.study.settings, self.figures()
        home = settings.home if folder is None else Path(folder)
        files = ReportFiles(report.save_figures(figures, home / "figures"), home / "report.html")
        foot = report.study_foot(settings, command or None)
        report.write_page(files.page, report.study_view(self.result, figures), foot)
        return files


def run_study(
    path: str | Path,
    *,
    progress: bool = False,
    retry_failed: bool = False,
    budget: int | None = None,
    jobs: int | None = None,
) -> StudyReport:
    """Run a study, or resume it where it was left; a finished one is summed up again without simulating.

    It may be interrupted at any moment, Ctrl-C or worse: every finished episode is kept, and the next call goes on to
    the same result. What the user should know at once, as of a parameter without effect, is a warning.

    Args:
        path: The study's folder, or its study.toml.
        progress: Whether to show a bar with the time left; where standard error is no terminal, a line per trial.
        retry_failed: Whether to drive every failed episode again; those whose code has changed are in any case.
        budget: How many trials, instead of what study.toml says.
        jobs: How many processes run episodes, instead of what study.toml says.

    Raises:
        InputError: If anything in the study cannot be used, with file, key and remedy.
        RunError: If no trial works, or the machine fails; all that was finished is kept.
    """
    opened = study.with_spending(study.open_study(Path(path)), budget=budget, jobs=jobs)
    if opened.settings.objective == study.LEARNING:
        remedy = f"run it with: python -m proxytune study {opened.settings.home}"
        raise opened.settings.error("objective", f"run_study has no search for '{study.LEARNING}'; {remedy}")
    return run_quietly(opened, progress, retry_failed=retry_failed)


def run_quietly(
    opened: study.Study, progress: bool, known: Sequence[Outcome | Theta] = (), retry_failed: bool = False
) -> StudyReport:
    """Run a study that has been opened, as `run_study` does; what is to be known at once is a warning."""
    bars = watching(progress, most_episodes(opened.settings))
    return run_opened(opened, bars, lambda line: warnings.warn(line, stacklevel=6), retry_failed, known)


def run_opened(
    opened: study.Study,
    bars: AbstractContextManager[Watcher],
    warn: Callable[[str], None],
    retry_failed: bool = False,
    known: Sequence[Outcome | Theta] = (),
) -> StudyReport:
    """Search by predictivity from where it was left: pre-flight, trials, confirmation; `known` is as in `run_stages`.

    Of another search than before, and of parameters without effect, it warns before the first trial. Failed episodes
    are driven again where their code has changed, or all of them.
    """
    settings = opened.settings
    with locked(settings.home), Store.open(settings.home) as store:
        if retry_failed:
            store.forget_failures()
        with bars as watcher:
            under_way = study.StudyRun(opened, store, watcher)
            study.run_stages(under_way, warn, known)
        return StudyReport(study.result_of(under_way), under_way.spent)


def read_study(path: str | Path) -> StudyReport:
    """Look at a study as far as it has been run, also while it is running elsewhere; nothing is simulated.

    Args:
        path: The study's folder, or its study.toml.

    Raises:
        InputError: If the study has not been run, or was changed since.
        RunError: If no trial has a score yet.
    """
    settings = study.read_study_settings(Path(path))
    settings.check_single()
    settings.check_theta()
    with Store.read(settings.home) as store:
        return StudyReport(study.result_of(study.open_read_only(settings, store)), study.Spent())


def most_episodes(settings: study.StudySettings) -> int:
    """Count the episodes that a study takes at most, from pre-flight to confirmation."""
    trials = settings.budget * len(settings.agents) * settings.starts
    nominal = len(settings.agents) * settings.starts
    return trials + study.most_preflight_episodes(settings) + nominal + study.most_confirmation_episodes(settings)
