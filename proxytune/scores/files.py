"""Score tables as CSV files."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from proxytune.drafts import draft_of
from proxytune.errors import ScoresError
from proxytune.scores.cells import LABELS, Cells, Columns, read_cells
from proxytune.scores.table import ScoreTable
from proxytune.settings import nearest

Files = str | Path | Sequence[str | Path]
"""A file, or several that make one table."""
Row = tuple[str, str, str]
"""Domain, agent and episode."""


def read_scores(
    path: Files, metrics: Iterable[str], domain: str | None = None, columns: Columns | None = None
) -> ScoreTable:
    """Read the scores of one domain from a CSV file, or from several that make one table.

    Columns are separated by commas, semicolons or tabs; with the latter two, decimals may be written with a comma.

    Args:
        path: CSV with the columns agent, episode (not needed for one row per agent), domain (optional) and metrics; or
            several such files.
        metrics: The columns to read; others are ignored.
        domain: Which domain, where there are several.
        columns: What columns are called in the file where that is another name, as in {"agent": "policy"}.

    Raises:
        ScoresError: If the file is not such a table, naming line and column.
    """
    tables, path = read_domains(path, metrics, columns), " and ".join(map(str, _files(path)))
    if domain is None:
        if len(tables) > 1:
            example = next(iter(tables))
            raise ScoresError(f"{path}: has the domains {', '.join(tables)}; choose one, as in {path}:{example}")
        return next(iter(tables.values()))
    if "" in tables:
        raise ScoresError(f"{path}: has no column 'domain'; drop ':{domain}'")
    if domain not in tables:
        raise ScoresError(f"{path}: no domain '{domain}'; {nearest(domain, tables)}")
    return tables[domain]


def read_domains(path: Files, metrics: Iterable[str], columns: Columns | None = None) -> dict[str, ScoreTable]:
    """Read every domain of a CSV file or of several, in their order; without a domain column the only one is "".

    Raises:
        ScoresError: As in read_scores.
    """
    names = tuple(metrics)
    files = [read_cells(file, names, columns) for file in _files(path)]
    _check_alike(files)
    _check_columns(files, columns or {})
    bare = next((cells for cells in files if not cells.lines), None)
    if bare:
        raise ScoresError(f"{bare.path}: has no rows; add one per agent and episode")
    domain, agent, episode = (
        [one for cells in files for one in cells.label(name)] for name in ("domain", "agent", "episode")
    )
    _check_single(files, list(zip(domain, agent, episode, strict=True)))
    values = np.concatenate([cells.numbers(names) for cells in files])
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(domain):
        rows.setdefault(name, []).append(row)
    return {
        name: ScoreTable.from_rows([agent[row] for row in own], [episode[row] for row in own], names, values[own])
        for name, own in rows.items()
    }


def _files(path: Files) -> list[Path]:
    """The files, be it one or several."""
    return [Path(path)] if isinstance(path, str | Path) else [Path(one) for one in path]


def _check_alike(files: Sequence[Cells]) -> None:
    """Refuse files of which one numbers its episodes, or names domains, and another does not."""
    for label, cells in [(label, cells) for label in LABELS for cells in files]:
        other = next((one for one in files if label in one.header), None)
        if other and label not in cells.header:
            raise ScoresError(f"{cells.path}: has no column '{label}', which {other.path} has; add it")


def _check_columns(files: Sequence[Cells], columns: Columns) -> None:
    """Refuse a column map of which a name is in no file."""
    for name, theirs in columns.items():
        if not any(theirs in cells.named for cells in files):
            raise ScoresError(f"{files[0].path}: no column '{theirs}' for '{name}'; {nearest(theirs, files[0].named)}")


def _check_single(files: Sequence[Cells], rows: Sequence[Row]) -> None:
    """Refuse an episode that one agent drove twice in one domain."""
    if len(set(rows)) == len(rows):
        return
    known: dict[Row, Path] = {}
    places = ((cells, line) for cells in files for line in cells.lines)
    for (cells, line), row in zip(places, rows, strict=True):
        if row in known:
            where = f", once in {known[row]}" if known[row] != cells.path else ""
            raise ScoresError(f"{cells.path}: line {line}: {_duplicate(cells, row, where)}")
        known[row] = cells.path


def write_scores(table: ScoreTable, path: Path) -> None:
    """Write a table as CSV, the same bytes for the same table; an interrupted write leaves the old file.

    Raises:
        ScoresError: If the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["agent", "episode", *table.metrics])
    for row, agent in enumerate(table.agents):
        for column, episode in enumerate(table.episodes):
            if table.driven[row, column]:
                writer.writerow([agent, episode, *(repr(float(value)) for value in table.values[row, column])])
    try:
        with draft_of(path) as draft:
            draft.write_text(text.getvalue(), encoding="utf-8", newline="")
    except OSError as problem:
        raise ScoresError(f"{path}: cannot be written ({problem.strerror})") from None


def _duplicate(cells: Cells, row: Row, before: str) -> str:
    domain, agent, episode = row
    where = f" in domain '{domain}'{before}" if "domain" in cells.header else before
    if "episode" in cells.header:
        return f"agent '{agent}' has episode '{episode}' twice{where}; number the episodes"
    remedy = "add a column 'episode', or give its name: --columns episode=NAME"
    return f"agent '{agent}' is there twice{where}; {remedy}"
