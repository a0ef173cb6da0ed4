"""`study`: run or resume a study, and sum it up."""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from proxytune.api.families import Spending
from proxytune.api.studies import StudyReport, most_episodes, run_opened
from proxytune.cli.families import compare_families
from proxytune.cli.learning_value import search_by_plv
from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.cluster_options import configure_cluster, on_its_cluster
from proxytune.cli.terminal.live_page import renewed_page
from proxytune.cli.terminal.study_folder import study_folder
from proxytune.report import study_text
from proxytune.running import Bars
from proxytune.study import LEARNING, Spent, Study, StudyResult, open_settings, read_study_settings, with_spending


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study."""
    parser.add_argument(
        "path",
        type=Path,
        metavar="PATH",
        help="a study's folder, or where to copy one that comes with proxytune",
    )
    parser.add_argument(
        "--retry-failed",
        action="store_true",
        help="drive every episode again that has failed [those whose code has changed since]",
    )
    parser.add_argument("--budget", type=int, metavar="N", help="how many trials [study.toml's]")
    parser.add_argument("--jobs", type=int, metavar="N", help="how many processes run episodes [study.toml's]")
    configure_cluster(parser)


@on_its_cluster
def run(arguments: argparse.Namespace) -> Answer:
    """Run what is left of a study; a finished one is summed up again without simulating."""
    begun = time.perf_counter()
    folder = study_folder(arguments.path)
    settings, again = read_study_settings(folder), arguments.retry_failed
    if settings.families:
        return compare_families(settings, Spending(arguments.budget, arguments.jobs, again))
    study = with_spending(open_settings(settings), budget=arguments.budget, jobs=arguments.jobs)
    if study.settings.objective == LEARNING:
        return search_by_plv(study, folder, lambda: _search(study, again).result)
    report = _search(study, again)
    figures, page = report.write(folder)
    costs = _costs(report.result, report.spent, time.perf_counter() - begun)
    document = {**report.document(), **costs, "figures": [str(path) for path in figures], "report": str(page)}
    files = {"figures": figures[0].parent, "report": page}
    return Answer(document, study_text(report.result, _say_costs(costs), files))


def _search(study: Study, retry_failed: bool) -> StudyReport:
    watching = renewed_page(study.settings, study.objective.name, Bars(most_episodes(study.settings)))
    return run_opened(study, watching, _warn, retry_failed)


def _warn(line: str) -> None:
    print(f"proxytune study: {line}", file=sys.stderr)


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
