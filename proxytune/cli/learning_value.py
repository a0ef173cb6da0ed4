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
from proxytune.teaching.box import search_space
from proxytune.teaching.experiment import count_points, load_setup
from proxytune.teaching.search import PlvSearch


def search_by_plv(study: Study, folder: Path, by_prpv: Callable[[], Mapping[str, tuple[float, float]]]) -> Answer:
    """Run what is left of a search by PLV; first narrow the box by PRPV where the study asks for it."""
    settings = study.settings
    setup = load_setup(settings)
    widths = setup.settings.widths
    search_space(settings, widths, {})
    space = search_space(settings, widths, by_prpv() if setup.settings.narrow else {})
    points = count_points(setup, setup.settings.budget)
    with locked(folder), Store.open(folder) as store, Bars(points, "points of learning curves") as bars:
        search = PlvSearch(settings, setup, store, space, bars)
        result = search.run(make_proposer(study.engine, settings.initial))
    figure = folder / "figures" / "plv.png"
    save(plv_figure(result), figure)
    return Answer({**plv_document(result), "figure": str(figure)}, plv_table(result, {"figure": figure}))
