"""`study` with objective = "plv": the proxy whose samples save most on the target."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Group
from rich.text import Text

from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.live_page import renewed_page
from proxytune.report.page.foot import foot_of
from proxytune.report.page.rendering import html_of
from proxytune.report.study.page import study_command, study_settings
from proxytune.report.teaching.page import plv_page
from proxytune.report.teaching.plv_document import plv_document, plv_table
from proxytune.report.teaching.plv_figure import plv_figure
from proxytune.report.teaching.words import plv_answer
from proxytune.report.writing import save, write_text
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
    figure = folder / "figures" / "plv.png"
    save(plv_figure(result), figure)
    page, foot = folder / "report.html", foot_of(study_command(settings), study_settings(settings))
    write_text(page, html_of(plv_page(result, figure.read_bytes(), foot)))
    document = {**plv_document(result), "figure": str(figure), "report": str(page)}
    shown = plv_table(result, {"figure": figure, "report": page})
    return Answer(document, Group(Text(f"{plv_answer(result)}\n"), shown))
