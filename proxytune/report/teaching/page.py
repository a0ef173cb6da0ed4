"""An experiment in teaching, and a search by PLV, as pages."""

from collections.abc import Mapping, Sequence

from proxytune.report.page.parts import Foot, Page, Picture, Table, Words
from proxytune.report.page.tables import terminal_tables
from proxytune.report.teaching.observations import observation_lines
from proxytune.report.teaching.plv_document import CONFIRMED, plv_table
from proxytune.report.teaching.table import COLUMNS, PLV_MEANING, columns_of, convergence_lines, meanings, table_rows
from proxytune.report.teaching.words import plv_answer, plv_next_step, teach_answer, teach_next_step
from proxytune.teaching import Experiment, PlvStudy, Predictivity, observe

CURVES = (
    "One panel per proxy, against the learner without one (grey): mean scores with their 95 % bands, from all "
    "examinations together (dots). A proxy saves samples where its curve comes to the dotted line sooner and stays "
    "above it; the bar at that line is the 95 % interval of how many it needs. The curve begins at the score before "
    "any target sample."
)
PUBLISHED = (
    *(
        "proxy",
        "zero-shot score, published",
        "here",
        "samples needed, published",
        "here",
        "reduction, published",
        "here",
    ),
)
TRIALS = (
    "PLV of each proxy tried, with its 95 % interval; crosses have not converged. Above 0 samples are saved. Where "
    "intervals overlap, the order of the proxies is not known."
)


def teach_page(experiment: Experiment, prpv: Mapping[str, Predictivity | None], figure: bytes, foot: Foot) -> Page:
    """A learning experiment as a page: the paper's table 1 and the curves."""
    lines = (*meanings(experiment), *convergence_lines(experiment))
    observations = observation_lines(observe(experiment, prpv), experiment)
    said = [Words("The paper's two observations", observations)] if observations else []
    rows = tuple(table_rows(experiment, prpv))
    picture = Picture("What each proxy saves, curve by curve", figure, CURVES)
    table = Table("PLV of each proxy (the paper's table 1)", columns_of(experiment), rows, lines)
    name = f"{experiment.settings.name}: proxies as teachers"
    parts: tuple[Table | Picture | Words, ...] = (table, *said, *_published(experiment, rows), picture)
    return Page(name, teach_answer(experiment), teach_next_step(experiment), parts, foot)


def _published(experiment: Experiment, rows: Sequence[tuple[str, ...]]) -> tuple[Table, ...]:
    """What others published of these proxies, beside what is found here; nothing where nothing is given."""
    taught = experiment.settings.teaching
    if taught is None or not taught.published:
        return ()
    here = {row[0]: row for row in rows}
    cells = []
    for name, theirs in taught.published.items():
        _, _, zero_shot, needed, _, reduction = here[name][: len(COLUMNS)]
        published = (f"{theirs.zero_shot:g}", f"{theirs.samples}", f"{theirs.reduction:.0%}")
        cells.append((name, published[0], zero_shot, published[1], needed, published[2], reduction))
    return (Table("Beside what was published", PUBLISHED, tuple(cells), tuple(filter(None, [taught.published_in]))),)


def plv_page(study: PlvStudy, figure: bytes, foot: Foot) -> Page:
    """A search by PLV as a page."""
    table, finals = terminal_tables(plv_table(study, {}))
    proxies = Table("Proxies tried, the best first", table.columns, table.rows)
    stopped = Words("Why the search ended", (f"{study.stopped}.", f"{PLV_MEANING}."))
    picture = Picture("PLV of the proxies tried", figure, TRIALS)
    finalists = Table(CONFIRMED.rstrip(":"), finals.columns, finals.rows, (PLV_MEANING, *study.unable.values()))
    return Page(
        study.settings.name, plv_answer(study), plv_next_step(study), (finalists, picture, proxies, stopped), foot
    )
