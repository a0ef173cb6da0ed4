"""Score tables as CSV files: columns by commas, semicolons or tabs, with decimal points or commas.

`pandas.read_csv(sep=None)` cannot do it: it cuts a single column "score" at s, fills short rows in silence, and with
`decimal=","` takes 2.5 beside 1,5 for granted, where one of the two may separate thousands.
"""

import csv
import io
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from proxytune.arrays import Floats
from proxytune.errors import ScoresError
from proxytune.files import csv_text, write_whole
from proxytune.scores import forms
from proxytune.scores.table import LARGEST, ScoreTable
from proxytune.settings import NO_CSV, nearest, table_text

SEPARATORS = (",", ";", "\t")
Columns = Mapping[str, str]
"""What a column is called in a file, by what it is called here: `{"agent": "policy"}`."""


@dataclass(frozen=True)
class Cells:
    """The cells of a file, by column: labels and the metrics asked for; `header` has names here, `named` the file's.

    `lines` are the rows' numbers, `decimal` what numbers have before their fractions, `errors` published standard
    errors.
    """

    path: Path
    named: Sequence[str]
    header: Sequence[str]
    lines: Sequence[int]
    cells: Mapping[str, Sequence[str]]
    decimal: str = "."
    errors: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def label(self, name: str) -> Sequence[str]:
        """The labels of this kind, one per row; empty ones where the file has no such column."""
        if (labels := self.cells.get(name)) is None:
            return [""] * len(self.lines)
        if "" in labels:
            line = self.lines[labels.index("")]
            raise ScoresError(f"{self.path}: line {line}, column '{name}': is empty; fill it in")
        return labels

    def published(self, columns: Sequence[str]) -> Floats:
        """The standard errors of these columns, shape (rows, columns); 0 where they are not known."""
        none = [0.0] * len(self.lines)
        return np.reshape([self.errors.get(name, none) for name in columns], (len(columns), len(none))).T

    def numbers(self, columns: Sequence[str]) -> Floats:
        """The numbers of these columns, shape (rows, columns)."""
        values = np.empty((len(self.lines), len(columns)))
        for place, name in enumerate(columns):
            values[:, place] = [_number(cell.replace(self.decimal, ".")) for cell in self.cells[name]]
        for row, place in np.argwhere(~(np.abs(values) < LARGEST)):
            where, cell = f"line {self.lines[row]}, column '{columns[place]}'", self.cells[columns[place]][row]
            remedy = "; give it in another unit" if math.isfinite(values[row, place]) else ""
            raise ScoresError(f"{self.path}: {where}: must be a finite number, got {cell!r}{remedy}")
        return values


def read_cells(
    path: Path,
    metrics: Sequence[str],
    columns: Columns | None = None,
    side: forms.Side | None = None,
    part: str | None = None,
) -> Cells:
    """Read a file of scores, in any form that is known.

    A CSV's columns are separated by commas, semicolons or tabs; with the latter two, decimals may have commas. A column
    that is not there under the name that it is given may have its name from here. `side` is whose columns to take where
    a table has both sides', `part` the dictionary in a Python file.
    """
    named, rows, separator = _opened(path, part)
    ours = {theirs: name for name, theirs in (columns or {}).items() if theirs in named}
    alias = forms.agent_column(named)
    if alias is not None and "agent" not in {*named, *(columns or {})}:
        ours[alias] = "agent"
    # Another column that has such a name is out of the way.
    header = [ours.get(name, f"{name} of the file" if name in ours.values() else name) for name in named]
    whose = {name: column for name in metrics if (column := forms.own_column(name, header, side)) not in (None, name)}
    bare = {column: name for name, column in whose.items()}
    if len(bare) == len(whose):
        header = [bare.get(name, name) for name in header]
    _check_header(path, header, metrics)
    more = {name: forms.beside(name, header, side) for name in metrics}
    wanted = {*forms.LABELS, *metrics, *(column for pair in more.values() for column in pair if column is not None)}
    lines, cells = _columns(path, rows, header, wanted)
    if forms.is_form(path):  # an agent that a dictionary does not have is left out
        kept = [row for row in range(len(lines)) if all(cells[name][row] for name in metrics)]
        lines, cells = [lines[row] for row in kept], {name: [own[row] for row in kept] for name, own in cells.items()}
    found = Cells(path, named, header, lines, cells)
    found = found if separator == "," else replace(found, decimal=_decimal(found, metrics))
    # Of a column that another name than the metric's says to be in per cent
    in_percent = {name: bool(re.search(r"%|\bpercent\b|_pct\b", (whose.get(name) or "").lower())) for name in metrics}
    return _plain_cells(found, metrics, more, in_percent)


def _plain_cells(
    found: Cells,
    metrics: Sequence[str],
    more: Mapping[str, tuple[str | None, str | None]],
    in_percent: Mapping[str, bool],
) -> Cells:
    """Counts as a row per rollout, per cent as shares, and standard errors by themselves."""
    named = any(column is not None for pair in more.values() for column in pair) or any(in_percent.values())
    odd = any(mark in cell for name in metrics for cell in found.cells[name] for mark in "%/o±+")
    if not (named or odd) or ("episode" in found.cells and not odd and not any(in_percent.values())):
        return found
    lines: list[int] = []
    cells: dict[str, list[str]] = {name: [] for name in {*found.cells, "episode"}}
    errors: dict[str, list[float]] = {name: [] for name in metrics}
    for row, line in enumerate(found.lines):
        own = {name: column[row] for name, column in found.cells.items()}
        read = {name: _read(found, own, name, more[name], in_percent[name], line) for name in metrics}
        done, label = [one[2] for one in read.values() if one[2] is not None], own.get("episode", "")
        if done and (len(done) < len(metrics) or len({of for _, of in done}) > 1):
            where = f"{found.path}: line {line}: counts of rollouts"
            raise ScoresError(f"{where} must be one number an agent in every metric; give the metrics one by one")
        # A row of each rollout, successes first
        rollouts = zip(*(["1"] * successes + ["0"] * (of - successes) for successes, of in done), strict=True)
        for place, values in enumerate(rollouts if done else [tuple(one[0] for one in read.values())]):
            lines.append(line)
            episode = f"{own['agent']} {label}#{place}" if done else label
            for name, value in (own | dict(zip(metrics, values, strict=True)) | {"episode": episode}).items():
                cells[name].append(value)
            for name, one in read.items():
                errors[name].append(one[1])
    if "episode" not in found.cells and not all(cells["episode"]):
        if any(cells["episode"]):
            line = lines[cells["episode"].index("")]
            raise ScoresError(f"{found.path}: line {line}: has no counts of rollouts, as other lines have; add them")
        del cells["episode"]
    known = {name: own for name, own in errors.items() if any(own)}
    return replace(found, lines=lines, cells=cells, errors=known)


def _read(
    found: Cells, own: Mapping[str, str], name: str, more: tuple[str | None, str | None], in_percent: bool, line: int
) -> tuple[str, float, tuple[int, int] | None]:
    """What a row says of a metric: its text, its standard error (0: not known), and successes of rollouts."""
    text, error, scale = own[name], 0.0, 100.0 if in_percent else 1.0
    read, where = forms.read_cell(text, in_percent), f"{found.path}: line {line}, column '{name}'"
    if read is not None:
        text, error = repr(read[0]).replace(".", found.decimal), read[1] or 0.0
        if read[2] is not None:
            return text, error, read[2]
        if "success" in name.lower() and not 0.0 <= read[0] <= 1.0:
            raise ScoresError(f"{where}: a success rate lies between 0 and 100 %, got {own[name]!r}; correct the cell")
    counts, errors = more
    value = _number(text.replace(found.decimal, "."))
    if math.isnan(value):
        raise ScoresError(f"{where}: must be a finite number, got {text!r}; write successes of rollouts as '18 of 25'")
    if counts is not None:
        return text, error, forms.counted(value, own[counts], where)
    if errors is not None:
        error = _number(own[errors].replace(found.decimal, ".")) / scale
        if not 0.0 <= error < LARGEST:
            raise ScoresError(f"{where}: its standard error must be zero or more, got {own[errors]!r}")
    return text, error, None


def _number(text: str) -> float:
    """A number as tables have it; NaN for what is none, be it one to Python, as 1_000 is."""
    try:
        return float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        return math.nan


def column_names(path: Path, part: str | None = None) -> list[str]:
    """The columns of a file, as its first line names them."""
    return _opened(path, part)[0]


def _opened(path: Path, part: str | None) -> tuple[list[str], Iterator[forms.Line], str]:
    """The columns that a file's first line names, its rows, and what separates columns: a comma if nothing does."""
    if forms.is_form(path):
        named, lines = forms.form_rows(path, part)
        return named, iter(lines), ","
    text = table_text(path, ScoresError)
    first = next((line for line in text.splitlines() if line.strip()), "")
    separator = max(SEPARATORS, key=first.count)
    rows = _rows(path, text, separator)
    _, names = next(rows, (0, []))
    if not names:
        raise ScoresError(f"{path}: is empty; its first line must name the columns, agent and metrics among them")
    return [cell.strip() for cell in names], rows, separator


def _rows(path: Path, text: str, separator: str) -> Iterator[forms.Line]:
    """Line number and cells of each line that is not empty."""
    lines = io.TextIOWrapper(io.BytesIO(text.encode()), encoding="utf-8", newline="")
    reader = csv.reader(lines, strict=True, delimiter=separator)
    try:
        for cells in reader:
            if cells:
                yield reader.line_num, cells
    except csv.Error:
        raise ScoresError(f"{path}: {NO_CSV}") from None


def _columns(
    path: Path, rows: Iterable[forms.Line], header: Sequence[str], names: Collection[str]
) -> tuple[list[int], dict[str, list[str]]]:
    """Line numbers, and the cells of the columns of these names."""
    places = {name: header.index(name) for name in names if name in header}
    cells: dict[str, list[str]] = {name: [] for name in places}
    lines = []
    for line, row in rows:
        if len(row) != len(header):
            named = f"the first line names {len(header)} columns"
            raise ScoresError(f"{path}: line {line}: has {len(row)} cells, but {named}")
        lines.append(line)
        for name, place in places.items():
            cells[name].append(row[place].strip())
    return lines, cells


def _check_header(path: Path, header: Sequence[str], metrics: Sequence[str]) -> None:
    found = f"columns found: {', '.join(header)[:60]}"
    if "agent" not in header:
        remedy = f"rename the one that names the agents, or give its name: --columns agent={header[0][:20]}"
        remedy = f"{remedy} (in study.toml: target_columns)" if len(header) > 1 else "separate columns by commas"
        raise ScoresError(f"{path}: no column 'agent'; {found}; {remedy}")
    for name in metrics:
        if name not in header:
            others = [column for column in header if column not in forms.LABELS]
            raise ScoresError(f"{path}: no column '{name}'; {nearest(name, others)}")
    for name in (*forms.LABELS, *metrics):
        if header.count(name) > 1:
            raise ScoresError(f"{path}: the first line names the column '{name}' twice; rename one")


def _decimal(found: Cells, metrics: Sequence[str]) -> str:
    """The decimal sign of a file's numbers."""
    lines, cells = found.lines, found.cells
    numbers = [(line, name, cell) for name in metrics for line, cell in zip(lines, cells[name], strict=True)]
    commas, points = (next((one for one in numbers if mark in one[2]), None) for mark in ",.")
    if commas and points:
        line, name, cell = commas
        other = f"line {points[0]} has {points[2]!r}"
        where = f"line {line}, column '{name}'"
        raise ScoresError(f"{found.path}: {where}: {cell!r} has a comma, but {other}; write all alike")
    return "," if commas else "."


Files = str | Path | Sequence[str | Path]
"""A file, or several that make one table."""
Row = tuple[str, str, str]
"""Domain, agent and episode."""


def read_scores(
    path: Files,
    metrics: Iterable[str],
    domain: str | None = None,
    columns: Columns | None = None,
    side: forms.Side | None = None,
) -> ScoreTable:
    """Read the scores of one domain from a CSV file, or from several that make one table.

    LeRobot's eval_info.json, folders of them and dictionaries {task: {agent: score}} are read too. Columns are
    separated by commas, semicolons or tabs; with the latter two, decimals may be written with a comma.

    Args:
        path: CSV with the columns agent, episode (not needed for one row per agent), domain (optional) and metrics; or
            several such files.
        metrics: The columns to read; others are ignored.
        domain: Which domain, where there are several.
        columns: What columns are called in the file where that is another name, as in {"agent": "policy"}.
        side: Whose columns to take where a table has both sides', as "Sim success (%)" and "Real success (%)".

    Raises:
        ScoresError: If the file is not such a table, naming line and column.
    """
    part = domain if any(file.suffix == ".py" for file in _files(path)) else None
    tables, path = read_domains(path, metrics, columns, side, part), " and ".join(map(str, _files(path)))
    if domain is None or part is not None:
        if len(tables) > 1:
            example = next(iter(tables))
            raise ScoresError(f"{path}: has the domains {', '.join(tables)}; choose one, as in {path}:{example}")
        return next(iter(tables.values()))
    if "" in tables:
        raise ScoresError(f"{path}: has no column 'domain'; drop ':{domain}'")
    if domain not in tables:
        raise ScoresError(f"{path}: no domain '{domain}'; {nearest(domain, tables)}")
    return tables[domain]


def read_domains(
    path: Files,
    metrics: Iterable[str],
    columns: Columns | None = None,
    side: forms.Side | None = None,
    part: str | None = None,
) -> dict[str, ScoreTable]:
    """Read every domain of a CSV file or of several, in their order; without a domain column the only one is ""."""
    names = tuple(metrics)
    files = [read_cells(file, names, columns, side, part) for file in _files(path)]
    for label, cells in [(label, cells) for label in forms.LABELS for cells in files]:
        # Where one file numbers its episodes, or names domains, others do too.
        other = next((one for one in files if label in one.header), None)
        if other and label not in cells.header:
            raise ScoresError(f"{cells.path}: has no column '{label}', which {other.path} has; add it")
    for name, theirs in (columns or {}).items():
        if not any(theirs in cells.named for cells in files):
            raise ScoresError(f"{files[0].path}: no column '{theirs}' for '{name}'; {nearest(theirs, files[0].named)}")
    if bare := next((cells for cells in files if not cells.lines), None):
        raise ScoresError(f"{bare.path}: has no rows; add one per agent and episode")
    domain, agent, episode = (
        [one for cells in files for one in cells.label(name)] for name in ("domain", "agent", "episode")
    )
    _check_single(files, list(zip(domain, agent, episode, strict=True)))
    values = np.concatenate([cells.numbers(names) for cells in files])
    published = np.concatenate([cells.published(names) for cells in files])
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(domain):
        rows.setdefault(name, []).append(row)
    tables = {}
    for name, own in rows.items():
        table = ScoreTable.from_rows([agent[row] for row in own], [episode[row] for row in own], names, values[own])
        of_agent = {agent[row]: published[row] for row in own}
        errors = np.array([of_agent[who] for who in table.agents]) if published.any() else None
        tables[name] = replace(table, errors=errors)
    return tables


def _files(path: Files) -> list[Path]:
    """The files, be it one or several."""
    return [Path(path)] if isinstance(path, str | Path) else [Path(one) for one in path]


def _check_single(files: Sequence[Cells], rows: Sequence[Row]) -> None:
    """Refuse an episode that one agent drove twice in one domain."""
    known: dict[Row, Path] = {}
    places = ((cells, line) for cells in files for line in cells.lines)
    for (cells, line), row in zip(places, rows, strict=True):
        if row in known:
            domain, agent, episode = row
            where = f" in domain '{domain}'" if "domain" in cells.header else ""
            where += f", once in {known[row]}" if known[row] != cells.path else ""
            problem = f"agent '{agent}' has episode '{episode}' twice{where}; number the episodes"
            if "episode" not in cells.header:
                remedy = "add a column 'episode', or give its name: --columns episode=NAME"
                problem = f"agent '{agent}' is there twice{where}; {remedy}"
            raise ScoresError(f"{cells.path}: line {line}: {problem}")
        known[row] = cells.path


def write_scores(table: ScoreTable, path: Path) -> None:
    """Write a table as CSV, the same bytes for the same table; an interrupted write leaves the old file."""
    driven = np.argwhere(table.driven)
    rows = ([table.agents[row], table.episodes[at], *map(repr, table.values[row, at].tolist())] for row, at in driven)
    write_whole(path, csv_text(["agent", "episode", *table.metrics], rows), kind=ScoresError)
