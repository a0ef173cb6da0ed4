"""Which agents and metrics inform each parameter, and what would inform it more."""

from collections.abc import Sequence

from proxytune.search import Information
from proxytune.study import StudyResult

Row = tuple[str, str, str, str]

INFORMATION_COLUMNS: Row = ("parameter", "most informative agents", "metric", "limited by")
AGENTS, METRICS = 2, 1
"""How many of each are named."""


def information_rows(result: StudyResult) -> list[Row]:
    """A row for every parameter of which the scores hold information, with shares of Fisher's information."""
    return [_row(one) for one in result.knowledge.information if _largest(one.agents, AGENTS)]


def _row(one: Information) -> Row:
    return (one.name, _largest(one.agents, AGENTS), _largest(one.metrics, METRICS), one.limit)


def _largest(shares: Sequence[tuple[str, float]], count: int) -> str:
    return ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in shares[:count] if share >= 0.005)
