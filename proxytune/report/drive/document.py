"""What is said of an episode: its scores in proxy and target, and when the two part."""

from collections.abc import Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

from proxytune.report.numbers import short
from proxytune.report.style import with_unit
from proxytune.study import APART_M, SideBySide


def episode_document(pair: SideBySide, study_seed: int) -> dict[str, Any]:
    """Scores as plain numbers.

    Args:
        pair: The episode.
        study_seed: From which its own is derived, as study.toml and `--seed` have it.
    """
    return {
        "agent": pair.episode.agent,
        "start": pair.episode.start,
        "seed": study_seed,
        "theta": dict(pair.episode.theta),
        "proxy": {"metrics": dict(pair.proxy.metrics)},
        "target": None if pair.target is None else {"metrics": dict(pair.target.metrics)},
        "parted_s": pair.parted_s,
    }


def episode_table(pair: SideBySide, first: Sequence[str]) -> Table:
    """A row for each metric, those that the study compares first."""
    table = Table(box=None, pad_edge=False)
    table.add_column("metric", overflow="fold")
    for side in pair.sides:
        table.add_column(side, justify="right", overflow="fold")
    for name in [*first, *(name for name in pair.proxy.metrics if name not in first)]:
        values = [short(episode.metrics[name]) if name in episode.metrics else "" for episode in pair.sides.values()]
        table.add_row(Text(with_unit(name, pair.units[name])), *values)
    return table


def parting(pair: SideBySide) -> str:
    """When proxy and target part, in a sentence; empty where that cannot be told."""
    if pair.target is None:
        return ""
    if not (pair.proxy.has_places and pair.target.has_places):
        return "The domain family keeps no places (x, y): where proxy and target part cannot be told."
    if pair.parted_s is None:
        return f"Their places stay within {100.0 * APART_M:g} cm of each other while both drive."
    return f"Their places are first more than {100.0 * APART_M:g} cm apart at {pair.parted_s:.1f} s."
