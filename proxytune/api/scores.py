"""Scores and logs from DataFrames: usefulness from two tables, and a log of what its files would hold.

DataFrames given to the readers of files: there is one way to read, and complaints speak of rows.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas as pd
import tomlkit

from proxytune.errors import InputError, LogError, ScoresError
from proxytune.files import temporary_folder
from proxytune.logs import Log, read_log
from proxytune.scores import Metric, ScoreTable, read_scores
from proxytune.usefulness import Assessment, assess

LABELS = ("agent", "episode", "time")
"""What may be an index instead of a column."""


@contextmanager
def as_files(frames: Mapping[str, pd.DataFrame]) -> Iterator[Path]:
    """A folder with each DataFrame as NAME.csv, while a reader reads it.

    Raises:
        InputError: What the reader raises, in terms of the DataFrames; rows are counted from 0.
    """
    with temporary_folder() as folder:
        for title, frame in frames.items():
            _with_labels(title, frame).to_csv(folder / f"{title}.csv", index=False)
        try:
            yield folder
        except InputError as problem:
            raise type(problem)(_in_rows(str(problem).replace(f"{folder}/", ""))) from None


def _with_labels(title: str, frame: pd.DataFrame) -> pd.DataFrame:
    """The DataFrame with the labels of its index as columns."""
    if not isinstance(frame, pd.DataFrame):
        raise InputError(f"{title}: must be a DataFrame, got {type(frame).__name__}")
    return frame.reset_index([name for name in frame.index.names if name in LABELS and name not in frame.columns])


def _in_rows(problem: str) -> str:
    """A complaint about lines of a file as one about rows of a DataFrame."""
    rows = re.sub(r"^(\w+)\.csv: line (\d+)", lambda found: f"{found[1]}: row {int(found[2]) - 2}", problem)
    return re.sub(r"\b(\w+)\.csv\b", r"\1", rows.replace(": row -1:", ":"))


Scores = pd.DataFrame | ScoreTable | str | Path


def score(
    *,
    proxy: Scores,
    target: Scores,
    metrics: str | Metric | Sequence[str | Metric],
    beta: Mapping[str, float] | None = None,
    seed: int = 0,
) -> Assessment:
    """Measure how useful a proxy is as a predictor, from the scores of the same agents on both sides.

    Args:
        proxy: One row per agent and episode, with the columns agent, episode (not needed for one row per agent) and
            the metrics; a DataFrame, a CSV file or a ScoreTable.
        target: The same of the target. Equal episodes on both sides are the same start.
        metrics: How agents are compared, as in "distance:max" or ["distance:max:5%", "time_out_of_lane:min"].
        beta: Weight of each metric in PPV; by default one over its spread on the target.
        seed: Seed of resamples and permutations.

    Returns:
        Every measure: `.prpv.value`, `.srcc.value["distance"]`, `.noise_floor`, `.chance`, `.notes`.

    Raises:
        ScoresError: If a table lacks an agent or a metric, with side, row and column.
        InputError: If a metric, a weight or the seed cannot be used.
    """
    if seed < 0:
        raise InputError(f"seed must be at least 0, got {seed}")
    given = [metrics] if isinstance(metrics, str | Metric) else metrics
    compared = [metric if isinstance(metric, Metric) else Metric.parse(metric) for metric in given]
    names = [metric.name for metric in compared]
    sides = {side: _table(scores, side, names) for side, scores in (("proxy", proxy), ("target", target))}
    return assess(proxy=sides["proxy"], target=sides["target"], metrics=compared, beta=beta, seed=seed)


def _table(scores: Scores, side: str, names: Sequence[str]) -> ScoreTable:
    if isinstance(scores, ScoreTable):
        return _selected(scores, side, names)
    if isinstance(scores, str | Path):
        return read_scores(scores, names)
    _check_columns(scores, side)
    with as_files({side: scores}) as folder:
        return read_scores(folder / f"{side}.csv", names)


def _selected(scores: ScoreTable, side: str, names: Sequence[str]) -> ScoreTable:
    try:
        return scores.select(names)
    except ScoresError as problem:
        raise ScoresError(f"{side}: {problem}") from None


def _check_columns(scores: pd.DataFrame, side: str) -> None:
    """Refuse what a DataFrame may be like and a file not."""
    if not isinstance(scores, pd.DataFrame):
        kind = type(scores).__name__
        raise InputError(f"{side}: must be a DataFrame, a CSV file or a ScoreTable, got {kind}")
    if "agent" not in (*scores.columns, *scores.index.names):
        found = ", ".join(map(str, scores.columns))[:60]
        raise ScoresError(f"{side}: no column 'agent'; columns are {found}; name the column or index of agents 'agent'")
    domains = list(scores["domain"].unique()) if "domain" in scores else []
    if len(domains) > 1:
        raise ScoresError(f"{side}: has several domains; select one, as in scores[scores.domain == {domains[0]!r}]")


Description = Mapping[str, str | float]


def log_of(samples: pd.DataFrame, description: Description, commands: pd.DataFrame | None = None) -> Log:
    """A log from what its files would hold.

    Args:
        samples: The columns of samples.csv: episode, time [s], commands, x, y [m], heading [rad].
        description: The keys of log.toml, as in {"robot": "duckiebot", "command": "duty", "rate_hz": 20}.
        commands: The columns of commands.csv, where commands have times of their own.

    Raises:
        LogError: If it is no such log, with table, row and column.
    """
    frames = {"samples": samples} if commands is None else {"samples": samples, "commands": commands}
    stated = {"name": "log", **description}
    with as_files(frames) as folder:
        (folder / "log.toml").write_text(_toml(stated), encoding="utf-8")
        return read_log(folder)


def _toml(stated: Description) -> str:
    plain = {key: value.item() if isinstance(value, np.generic) else value for key, value in stated.items()}
    try:
        return tomlkit.dumps(plain)
    except TypeError as problem:
        raise LogError(f"log.toml: {problem}; give texts and numbers") from None
