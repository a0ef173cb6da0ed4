"""The tables that `score` compares, as they are named on the command line."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from proxytune.errors import InputError
from proxytune.scores import ScoreTable, column_names, read_domains, read_scores
from proxytune.settings import nearest


def read_sides(
    arguments: argparse.Namespace, metrics: Sequence[str]
) -> tuple[tuple[str, ScoreTable], dict[str, ScoreTable]]:
    """The target with its name, and every proxy by name.

    Raises:
        InputError: If a table cannot be used, or a column that --columns names is in none of them.
    """
    columns = _columns(arguments.columns)
    _check_columns(columns, [split_source(source)[0] for source in (*arguments.target, *arguments.proxy)])
    target = _read_target(arguments.target, metrics, columns)
    return target, _read_proxies(arguments.proxy, arguments.target, metrics, columns)


def split_source(source: str) -> tuple[Path, str | None]:
    """Split FILE or FILE:DOMAIN into its parts."""
    path, colon, domain = source.rpartition(":")
    if not colon or Path(source).exists() or not path:
        return Path(source), None
    return Path(path), domain


def _columns(text: str) -> dict[str, str]:
    columns: dict[str, str] = {}
    for pair in filter(None, text.split(",")):
        name, equals, theirs = (part.strip() for part in pair.partition("="))
        if not (name and equals and theirs):
            raise InputError(f"--columns {text}: write NAME=COLUMN,..., as in agent=policy,episode=trial")
        columns[name] = theirs
    return columns


def _check_columns(columns: Mapping[str, str], files: Sequence[Path]) -> None:
    found = list(dict.fromkeys(name for path in files for name in column_names(path))) if columns else []
    for name, theirs in columns.items():
        if theirs not in found:
            raise InputError(f"--columns {name}={theirs}: no table has a column '{theirs}'; {nearest(theirs, found)}")


def _read_target(sources: Sequence[str], metrics: Sequence[str], columns: Mapping[str, str]) -> tuple[str, ScoreTable]:
    parts = [split_source(source) for source in sources]
    if len({domain for _, domain in parts}) > 1:
        raise InputError(f"--target {sources[1]}: several files make one table; give all of them one domain, or none")
    paths, domain = [path for path, _ in parts], parts[0][1]
    name = domain or ", ".join(path.stem for path in paths)
    return name, read_scores(paths, metrics, domain, _present(columns, paths))


def _read_proxies(
    sources: Sequence[str], target: Sequence[str], metrics: Sequence[str], columns: Mapping[str, str]
) -> dict[str, ScoreTable]:
    """Every proxy by name: its domain, or its file's name, or what was typed where those are not unique."""
    of_target = dict(map(split_source, target))
    proxies: dict[str, ScoreTable] = {}
    for source in sources:
        path, domain = split_source(source)
        here = _present(columns, [path])
        tables = {domain: read_scores(path, metrics, domain, here)} if domain else read_domains(path, metrics, here)
        if not domain and len(tables) > 1 and of_target.get(path):
            tables.pop(of_target[path] or "", None)
        for label, table in tables.items():
            name = label or path.stem
            name = name if name not in proxies else f"{path}:{label}" if label else str(path)
            if name in proxies:
                raise InputError(f"--proxy {source}: is given twice; give each proxy once")
            proxies[name] = table
    return proxies


def _present(columns: Mapping[str, str], paths: Sequence[Path]) -> dict[str, str]:
    """Those of the column map that these files have: another table may have the names of this program."""
    found = {name for path in paths for name in column_names(path)} if columns else set()
    return {name: theirs for name, theirs in columns.items() if theirs in found}
