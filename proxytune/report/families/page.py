"""Several families as a page."""

from proxytune.report.families.table import THETA, USES, columns_of, theta_rows, use_notes, use_rows
from proxytune.report.families.words import families_answer, families_next_step
from proxytune.report.page.foot import foot_of
from proxytune.report.page.parts import Page, Picture, Table, Words
from proxytune.report.study.page import study_command, study_settings
from proxytune.study import ComparedFamilies

CAPTION = (
    "A row per family, each at the best θ that was found in the same time; lines are 95 % intervals, without an end "
    "that is not known. Filled circles are best, open ones cannot be told from them, squares are worse. Differences "
    "are judged episode by episode (PRPV, time) or draw by draw of the learning curves (PLV), so that they can be told "
    "though the lines overlap."
)


def families_page(compared: ComparedFamilies, figure: bytes) -> Page:
    """Several families as a page: the answer, the figure, both tables, and where each family's own page is.

    Args:
        compared: The tuned families.
        figure: The PNG.
    """
    settings = compared.settings
    uses = Table(USES, columns_of(compared), tuple(use_rows(compared)), tuple(use_notes(compared)))
    theta = Table(THETA, columns_of(compared), tuple(theta_rows(compared)))
    pages = [f"{one.name}: {one.result.study.settings.home / 'report.html'}" for one in compared.families]
    parts = (
        Picture("What each family predicts, teaches and costs", figure, CAPTION),
        uses,
        theta,
        Words("What the numbers are", _meanings(compared)),
        Words("The page of each family", tuple(pages)),
    )
    foot = foot_of(study_command(settings), study_settings(settings))
    return Page(settings.name, families_answer(compared), families_next_step(compared), parts, foot)


def _meanings(compared: ComparedFamilies) -> tuple[str, ...]:
    agents, time = len(compared.settings.agents), compared.settings.stop.wall_time_s
    taught = (
        "PLV, the proxy learning value, counts the target samples that a learner saves by learning in the family at "
        "its best θ first.",
    )
    return (
        f"Each family was tuned until the episodes of its trials had taken {time:g} s: the last trial may take it "
        "beyond. Pre-flight and fresh episodes come on top, and so does the search itself. Intervals are of the θ "
        "found: another seed may find another.",
        "PRPV, the proxy relative predictivity value, counts on how many ordered pairs of the "
        f"{agents} agents family and target disagree which is the better, in episodes that no search has seen. The "
        "intervals of its differences hold for all pairs of families at once.",
        *(taught if compared.settings.teaching else ()),
        "Time per episode is of the episodes at the best θ, every agent from every start, on this machine as busy as "
        "it was then.",
    )
