"""`study` with objective = "plv": the proxy whose samples save most on the target."""

from collections.abc import Callable
from pathlib import Path

from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.live_page import renewed_page
from proxytune.report import plv_document, plv_text, write_plv_report
from proxytune.running import Bars
from proxytune.search import make_proposer
from proxytune.storage import Store, locked
from proxytune.study import LEARNING, Study, StudyResult
from proxytune.teaching import PlvSearch, load_setup, most_examinations, search_space


def search_by_plv(study: Study, folder: Path, by_prpv: Callable[[], StudyResult]) -> Answer:
    """Run what is left of a search by PLV; first narrow the box by PRPV where the study asks for it."""
    settings = study.settings
    setup = load_setup(settings)
    widths = setup.settings.widths
    search_space(settings, widths, {})
    predictive = by_prpv() if setup.settings.narrow else None
    space = search_space(settings, widths, predictive.knowledge.as_good[1] if predictive else {})
    terminal = Bars(most_examinations(setup.settings), "points of learning curves")
    watching = renewed_page(settings, LEARNING, terminal)
    with locked(folder), Store.open(folder) as store, watching as bars:
        search = PlvSearch(settings, setup, store, space, bars)
        chosen = predictive.best.trial.theta if predictive else None
        result = search.run(make_proposer(study.engine, settings.initial), chosen)
    figure, page = write_plv_report(result, folder)
    document = {**plv_document(result), "figure": str(figure), "report": str(page)}
    return Answer(document, plv_text(result, {"figure": figure, "report": page}))
