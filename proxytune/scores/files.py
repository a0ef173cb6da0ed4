"""Score tables as CSV files."""

import contextlib
import csv
import io
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from proxytune.errors import ScoresError
from proxytune.scores.table import LARGEST, ScoreTable
from proxytune.settings import nearest

LABELS = ("agent", "episode", "domain")


def read_scores(path: str | Path, metrics: Iterable[str], domain: str | None = None) -> ScoreTable:
    """Read the scores of one domain from a CSV file.

    Args:
        path: CSV with the columns agent, episode (not needed for one row per agent), domain (optional) and metrics.
        metrics: The columns to read; others are ignored.
        domain: Which domain, where the file has several.

    Raises:
        ScoresError: If the file is not such a table, naming line and column.
    """
    tables = read_domains(Path(path), metrics)
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


def read_domains(path: Path, metrics: Iterable[str]) -> dict[str, ScoreTable]:
    """Read every domain of a CSV file, in the order of the file; without a domain column the only one is "".

    Raises:
        ScoresError: As in read_scores.
    """
    names = tuple(metrics)
    domains: dict[str, dict[tuple[str, str | int], dict[str, float]]] = {}
    for line, row in _rows(path, names):
        domain, agent, episode = row.get("domain", ""), row["agent"], row.get("episode", "")
        for label in [label for label in LABELS if label in row and not row[label]]:
            raise ScoresError(f"{path}: line {line}, column '{label}': is empty; fill it in")
        scored = domains.setdefault(domain, {})
        if (agent, episode) in scored:
            raise ScoresError(f"{path}: line {line}: {_duplicate(row)}")
        scored[agent, episode] = {name: _number(path, line, name, row[name]) for name in names}
    if not domains:
        raise ScoresError(f"{path}: has no rows; add one per agent and episode")
    return {domain: ScoreTable.from_episodes(scored) for domain, scored in domains.items()}


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
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        draft.write_text(text.getvalue(), encoding="utf-8", newline="")
        draft.replace(path)
    except OSError as problem:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise ScoresError(f"{path}: cannot be written ({problem.strerror})") from None


def _rows(path: Path, metrics: Sequence[str]) -> list[tuple[int, dict[str, str]]]:
    """The file's rows by column name, each with its line number."""
    try:
        reader = csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig"), newline=""), strict=True)
        lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader if cells]
    except FileNotFoundError:
        raise ScoresError(f"{path}: no such file; check the path") from None
    except OSError as problem:
        raise ScoresError(f"{path}: cannot be read ({problem.strerror})") from None
    except (UnicodeDecodeError, csv.Error):
        raise ScoresError(f"{path}: is not a CSV file; save it as comma-separated text (UTF-8)") from None
    if not lines:
        raise ScoresError(f"{path}: is empty; its first line must name the columns, agent and metrics among them")
    header = lines[0][1]
    _check_header(path, header, metrics)
    for line, cells in lines[1:]:
        if len(cells) != len(header):
            raise ScoresError(
                f"{path}: line {line}: has {len(cells)} cells, but the first line names {len(header)} columns"
            )
    return [(line, dict(zip(header, cells, strict=True))) for line, cells in lines[1:]]


def _check_header(path: Path, header: Sequence[str], metrics: Sequence[str]) -> None:
    if "agent" not in header:
        remedy = "rename the one that names the agents" if len(header) > 1 else "separate columns by commas"
        raise ScoresError(f"{path}: no column 'agent'; columns found: {', '.join(header)[:60]}; {remedy}")
    for name in metrics:
        if name not in header:
            others = [column for column in header if column not in LABELS]
            raise ScoresError(f"{path}: no column '{name}'; {nearest(name, others)}")
    for name in (*LABELS, *metrics):
        if header.count(name) > 1:
            raise ScoresError(f"{path}: the first line names the column '{name}' twice; rename one")


def _number(path: Path, line: int, column: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not abs(value) < LARGEST:
        raise ScoresError(f"{path}: line {line}, column '{column}': must be a finite number, got {cell!r}")
    return value


def _duplicate(row: Mapping[str, str]) -> str:
    where = f" in domain '{row['domain']}'" if "domain" in row else ""
    if "episode" in row:
        return f"agent '{row['agent']}' has episode '{row['episode']}' twice{where}; number the episodes"
    return f"agent '{row['agent']}' is there twice{where}; add a column 'episode'"
