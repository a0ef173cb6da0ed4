"""`study`: run or resume a study, and sum it up."""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from proxytune.cli.answer import Answer
from proxytune.cli.learning_value import search_by_plv
from proxytune.cli.study_folder import study_folder
from proxytune.report.study.convergence import convergence
from proxytune.report.study.document import study_document
from proxytune.report.study.importance_figure import importance_figure
from proxytune.report.study.page import page
from proxytune.report.study.profiles_figure import profiles_figure
from proxytune.report.study.search_figures import evaluations_figure
from proxytune.report.study.table import study_table
from proxytune.report.writing import save, write_text
from proxytune.running.progress import Bars
from proxytune.search.engines.registry import make_proposer, why_not
from proxytune.storage.lock import locked
from proxytune.storage.store import Store
from proxytune.study import confirmation, preflight
from proxytune.study.evaluation import Spent
from proxytune.study.knowledge import goal_of
from proxytune.study.provenance import note_search
from proxytune.study.result import StudyResult, result_of
from proxytune.study.run import check_facts, run_study
from proxytune.study.study import Study, open_study
from proxytune.study.study_run import StudyRun


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study."""
    parser.add_argument(
        "path",
        type=Path,
        metavar="PATH",
        help="a study's folder, or where to copy one that comes with proxytune",
    )


def run(arguments: argparse.Namespace) -> Answer:
    """Run what is left of a study; a finished one is summed up again without simulating."""
    begun = time.perf_counter()
    folder = study_folder(arguments.path)
    study = open_study(folder)
    _check_engine(study)
    if study.settings.objective == "plv":
        return search_by_plv(study, folder, lambda: search_by_prpv(study, folder)[0].knowledge.as_good[1])
    result, spent = search_by_prpv(study, folder)
    figures, report = draw(result, folder)
    costs = _costs(result, spent, time.perf_counter() - begun)
    document = {**study_document(result), **costs, "figures": [str(path) for path in figures], "report": str(report)}
    files = {"figures": figures[0].parent, "report": report}
    return Answer(document, study_table(result, _say_costs(costs), files))


def search_by_prpv(study: Study, folder: Path) -> tuple[StudyResult, Spent]:
    """Run what is left of pre-flight, trials and confirmation; return the result and what this run cost."""
    settings = study.settings
    episodes = preflight.most_episodes(settings) + confirmation.most_episodes(settings)
    episodes += settings.budget * len(settings.agents) * settings.starts
    with locked(folder), Store.open(folder) as store:
        with Bars(episodes) as bars:
            run = StudyRun(study, store, bars)
            _prepare(run)
            # The proposer allows for the noise that the pre-flight measured.
            run_study(run, make_proposer(settings.engine, settings.initial, goal_of(run)))
            confirmation.run_confirmation(run)
        return result_of(run), run.spent


def _prepare(run: StudyRun) -> None:
    """Run the pre-flight and warn at once of parameters without effect, so that the user can stop the study."""
    check_facts(run)
    if line := note_search(run.study, run.store):
        print(f"proxytune study: {line}", file=sys.stderr)
    preflight.run_preflight(run)
    report = preflight.preflight_of(run) if run.spent.episodes else None
    for warning in report.warnings if report else ():
        print(f"proxytune study: {warning}", file=sys.stderr)


def _check_engine(study: Study) -> None:
    settings = study.settings
    reason = why_not(settings.engine, composed=settings.objective == "prpv")
    if reason:
        raise settings.error("engine", reason)


def draw(result: StudyResult, folder: Path) -> tuple[list[Path], Path]:
    """Draw the study's figures and write its report; return their paths."""
    figures_by_name = {
        "convergence": convergence,
        "profiles": profiles_figure,
        "evaluations": evaluations_figure,
        "importance": importance_figure,
    }
    figures = [folder / "figures" / f"{name}.png" for name in figures_by_name]
    report = folder / "report.html"
    for figure, draw_one in zip(figures, figures_by_name.values(), strict=True):
        save(draw_one(result), figure)
    write_text(report, page(result, figures))
    return figures, report


def _costs(result: StudyResult, spent: Spent, total: float) -> dict[str, Any]:
    """Episodes and seconds of this run; what is spent outside episodes includes waiting."""
    jobs = result.study.settings.jobs
    return {
        "episodes": {
            "run": spent.episodes,
            "reused": result.episodes - (spent.episodes - spent.unused),
            "failed": result.failed_episodes,
        },
        "seconds": {
            "total": total,
            "episodes": spent.seconds,
            "outside_episodes": max(0.0, total - spent.seconds / jobs),
        },
    }


def _say_costs(costs: dict[str, Any]) -> str:
    episodes, seconds = costs["episodes"], costs["seconds"]
    return (
        f"{episodes['run']} run, {episodes['reused']} reused; "
        f"{seconds['total']:.0f} s, of which {seconds['outside_episodes']:.0f} s outside episodes"
    )
