"""`study`: run or resume a study, and sum it up."""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from proxytune.cli.answer import Answer
from proxytune.cli.learning_value import taught
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
        "path", type=Path, metavar="PATH", help="a study's folder, or where to put one that travels with proxytune"
    )


def run(arguments: argparse.Namespace) -> Answer:
    """Run what is left of a study; a finished one is summed up again without simulating."""
    begun = time.perf_counter()
    folder = study_folder(arguments.path)
    study = open_study(folder)
    _check_engine(study)
    if study.settings.objective == "plv":
        return taught(study, folder, lambda: searched(study, folder)[0].knowledge.as_good[1])
    result, spent = searched(study, folder)
    figures, report = draw(result, folder)
    costs = _costs(result, spent, time.perf_counter() - begun)
    document = {**study_document(result), **costs, "figures": [str(path) for path in figures], "report": str(report)}
    files = {"figure": figures[0], "report": report}
    return Answer(document, study_table(result, _told(costs), files))


def searched(study: Study, folder: Path) -> tuple[StudyResult, Spent]:
    """Search by PRPV from wherever it was left: pre-flight, trials, confirmation; what was found and what it cost."""
    settings = study.settings
    episodes = preflight.most_episodes(settings) + confirmation.most_episodes(settings)
    episodes += settings.budget * len(settings.agents) * settings.starts
    with locked(folder), Store.open(folder) as store:
        with Bars(episodes) as bars:
            run = StudyRun(study, store, bars)
            _prepare(run)
            # The pre-flight tells the noise that the proposer is to forgive.
            run_study(run, make_proposer(settings.engine, settings.initial, goal_of(run)))
            confirmation.run_confirmation(run)
        return result_of(run), run.spent


def _prepare(run: StudyRun) -> None:
    """Run the pre-flight and say at once which parameters do nothing: the study may be stopped for that."""
    check_facts(run)
    if line := note_search(run.study, run.store):
        print(f"proxytune study: {line}", file=sys.stderr)
    preflight.run_preflight(run)
    learnt = preflight.preflight_of(run) if run.spent.episodes else None
    for warning in learnt.warnings if learnt else ():
        print(f"proxytune study: {warning}", file=sys.stderr)


def _check_engine(study: Study) -> None:
    settings = study.settings
    reason = why_not(settings.engine, composed=settings.objective == "prpv")
    if reason:
        raise settings.error("engine", reason)


def draw(result: StudyResult, folder: Path) -> tuple[list[Path], Path]:
    """Draw the study's figures and the report; their paths."""
    drawn = {
        "convergence": convergence,
        "profiles": profiles_figure,
        "evaluations": evaluations_figure,
        "importance": importance_figure,
    }
    figures = [folder / "figures" / f"{name}.png" for name in drawn]
    report = folder / "report.html"
    for figure, draw_one in zip(figures, drawn.values(), strict=True):
        save(draw_one(result), figure)
    write_text(report, page(result, figures))
    return figures, report


def _costs(result: StudyResult, spent: Spent, total: float) -> dict[str, Any]:
    """Episodes and seconds of this run; outside of episodes is what is not spent within them, waiting included."""
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


def _told(costs: dict[str, Any]) -> str:
    episodes, seconds = costs["episodes"], costs["seconds"]
    return (
        f"{episodes['run']} episodes run, {episodes['reused']} reused; "
        f"{seconds['total']:.1f} s, of which {seconds['outside_episodes']:.1f} s outside of episodes"
    )
