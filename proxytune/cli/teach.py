"""`teach`: learning curves and PLV, how many target samples each proxy saves."""

import argparse
from pathlib import Path

from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.cluster_options import configure_cluster, on_its_cluster
from proxytune.cli.terminal.study_folder import study_folder
from proxytune.cli.terminal.typed import typed
from proxytune.report import study_foot, teach_document, teach_text, write_teach_report
from proxytune.running import Bars
from proxytune.storage import Store, locked
from proxytune.study import StudyRun, open_study
from proxytune.teaching import check_proxies, count_examinations, load_setup, predictivity, run_experiment


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study."""
    parser.add_argument(
        "path", type=Path, metavar="PATH", help="a study's folder; its study.toml needs a [teaching] table"
    )
    configure_cluster(parser)


@on_its_cluster
def run(arguments: argparse.Namespace) -> Answer:
    """Run what is left of the experiment; a finished one is summed up again without training or driving."""
    folder = study_folder(arguments.path)
    study = open_study(folder)
    setup = load_setup(study.settings)
    # Before anything is written.
    check_proxies(study.settings, setup)
    proxies = setup.settings.proxies
    with locked(folder), Store.open(folder) as store:
        with Bars(count_examinations(setup.settings, len(proxies) + 1), "points of learning curves") as bars:
            experiment = run_experiment(study.settings, setup, bars)
        agents = len(study.settings.agents) * study.settings.starts
        with Bars(agents * len(proxies)) as bars:
            prpv = predictivity(StudyRun(study, store, bars), proxies)
    figure = folder / "figures" / "teach.png"
    page = write_teach_report(experiment, prpv, figure, study_foot(study.settings, typed(arguments)))
    document = {**teach_document(experiment, prpv), "figure": str(figure), "report": str(page)}
    return Answer(document, teach_text(experiment, prpv, {"figure": figure, "report": page}))
