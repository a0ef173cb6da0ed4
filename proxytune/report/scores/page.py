"""What `score` finds as a page."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from proxytune.report.page.parts import Foot, Page, Picture, Table
from proxytune.report.page.tables import terminal_tables
from proxytune.report.scores.figures import MOST
from proxytune.report.scores.table import measures, ranking
from proxytune.report.scores.words import score_answer, score_next_step
from proxytune.usefulness import Assessment, Selection

SCATTER = (
    "A point is an agent: its mean score on the target (across) and in the proxy (up), with standard errors. On the "
    "dashed line both agree; two points that fall from left to right are a pair ranked wrongly. Names are in the "
    f"proxy's order, highest score on top; of more than {MOST} agents those whose rank differs most are named."
)
FLIPPED = (
    "A square is a pair of agents, in the target's order, best first. Grey pairs are ranked as on the target; coloured "
    "ones are what PRPV counts: reversed, lost (a tie in the proxy alone) or invented (a tie on the target alone). "
    f"Of more than {MOST} agents the axes are ranks on the target."
)
SAID = {
    "scatter": ("Scores in the proxy and on the target", SCATTER),
    "flipped_pairs": ("Pairs of agents that the proxy ranks wrongly", FLIPPED),
}
"""Title and caption of each kind of figure."""


class Drawn(NamedTuple):
    """A figure: its kind, the proxy that it is of, and the PNG."""

    kind: str
    proxy: str
    image: bytes


def score_page(
    assessments: Mapping[str, Assessment],
    selection: Selection | None,
    drawn: Sequence[Drawn],
    foot: Foot,
    *,
    target: str,
) -> Page:
    """One proxy, or several ranked, as a page.

    Args:
        assessments: Of each proxy, by name.
        selection: The proxies ranked; None where there is one.
        drawn: The figures.
        foot: The page's.
        target: Name of the target.
    """
    several = selection is not None
    pictures = [_picture(one, several) for one in drawn]
    tables = _tables(assessments, selection, target)
    names = f"{len(assessments)} proxies" if several else f"{next(iter(assessments))} as a proxy"
    return Page(
        f"{names} of {target}",
        score_answer(assessments, selection, target=target),
        score_next_step(assessments, selection),
        (*tables, *pictures) if several else (*pictures, *tables),
        foot,
    )


def _tables(assessments: Mapping[str, Assessment], selection: Selection | None, target: str) -> list[Table]:
    """What the terminal shows, each note once."""
    if selection is None:
        ((proxy, assessment),) = assessments.items()
        first, *others = terminal_tables(measures(assessment, proxy=proxy, target=target))
    else:
        first, *others = terminal_tables(ranking(assessments, selection, target=target))
    notes = dict.fromkeys(note for assessment in assessments.values() for note in assessment.notes)
    return [replace(first, notes=tuple(notes)), *others]


def _picture(drawn: Drawn, several: bool) -> Picture:
    title, caption = SAID[drawn.kind]
    return Picture(f"{title}: {drawn.proxy}" if several else title, drawn.image, caption)
