"""`study` with objective = "plv": which proxy is worth most as a teacher."""

from collections.abc import Callable, Mapping
from pathlib import Path

from proxytune.cli.answer import Answer
from proxytune.report.teaching.plv_document import plv_document, plv_table
from proxytune.report.teaching.plv_figure import plv_figure
from proxytune.report.writing import save
from proxytune.running.progress import Bars
from proxytune.search.engines.registry import make_proposer
from proxytune.storage.lock import locked
from proxytune.study.study import Study
from proxytune.teaching.experiment import count_points, load_setup
from proxytune.teaching.search import run_plv_study, search_space


def taught(study: Study, folder: Path, by_prpv: Callable[[], Mapping[str, tuple[float, float]]]) -> Answer:
    """Run what is left of a study of learning value, narrowing its box by PRPV first where it asks for that."""
    settings = study.settings
    school = load_setup(settings)
    widths = school.settings.widths
    search_space(settings, widths, {})
    space = search_space(settings, widths, by_prpv() if school.settings.narrow else {})
    with locked(folder), Bars(count_points(school, school.settings.budget), "points of learning curves") as bars:
        found = run_plv_study(settings, school, make_proposer(settings.engine, settings.initial), space, bars)
    figure = folder / "figures" / "plv.png"
    save(plv_figure(found), figure)
    return Answer({**plv_document(found), "figure": str(figure)}, plv_table(found, {"figure": figure}))
