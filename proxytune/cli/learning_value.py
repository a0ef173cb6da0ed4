"""`study` with objective = "plv": which proxy is worth most as a teacher."""

from collections.abc import Callable, Mapping
from pathlib import Path

from proxytune.cli.answer import Answer
from proxytune.report.plv_document import plv_document, plv_table
from proxytune.report.plv_figure import plv_figure
from proxytune.report.writing import save
from proxytune.search.engines import make_proposer
from proxytune.study.lock import locked
from proxytune.study.plv_study import run_plv_study, search_space
from proxytune.study.progress import Bars
from proxytune.study.study import Study
from proxytune.study.teach import open_school, points_of


def taught(study: Study, folder: Path, by_prpv: Callable[[], Mapping[str, tuple[float, float]]]) -> Answer:
    """Run what is left of a study of learning value, narrowing its box by PRPV first where it asks for that."""
    settings = study.settings
    school = open_school(settings)
    widths = school.settings.widths
    search_space(settings, widths, {})
    space = search_space(settings, widths, by_prpv() if school.settings.narrow else {})
    with locked(folder), Bars(points_of(school, school.settings.budget), "points of learning curves") as bars:
        found = run_plv_study(settings, school, make_proposer(settings.engine, settings.initial), space, bars)
    figure = folder / "figures" / "plv.png"
    save(plv_figure(found), figure)
    return Answer({**plv_document(found), "figure": str(figure)}, plv_table(found, {"figure": figure}))
