"""`study` with objective = "plv": the proxy whose samples save most on the target."""

from collections.abc import Callable, Mapping
from pathlib import Path

from proxytune.cli.terminal.answer import Answer
from proxytune.report.teaching.plv_document import plv_document, plv_table
from proxytune.report.teaching.plv_figure import plv_figure
from proxytune.report.writing import save
from proxytune.running.progress import Bars
from proxytune.search.engines.registry import make_proposer
from proxytune.storage.lock import locked
from proxytune.storage.store import Store
from proxytune.study.study import Study
from proxytune.teaching.experiment import open_school, points_of
from proxytune.teaching.search import PlvSearch, search_space


def search_by_plv(study: Study, folder: Path, by_prpv: Callable[[], Mapping[str, tuple[float, float]]]) -> Answer:
    """Run what is left of a search by PLV; first narrow the box by PRPV where the study asks for it."""
    settings = study.settings
    school = open_school(settings)
    widths = school.settings.widths
    search_space(settings, widths, {})
    space = search_space(settings, widths, by_prpv() if school.settings.narrow else {})
    points = points_of(school, school.settings.budget)
    with locked(folder), Store.open(folder) as store, Bars(points, "points of learning curves") as bars:
        search = PlvSearch(settings, school, store, space, bars)
        result = search.run(make_proposer(study.engine, settings.initial))
    figure = folder / "figures" / "plv.png"
    save(plv_figure(result), figure)
    return Answer({**plv_document(result), "figure": str(figure)}, plv_table(result, {"figure": figure}))
