"""Scores and logs from DataFrames: usefulness from two tables, and a log of what its files would hold.

DataFrames given to the readers of files: there is one way to read, and complaints speak of rows.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, overload

import numpy as np
import pandas as pd
import tomlkit
from matplotlib.figure import Figure

from proxytune import report, usefulness
from proxytune.errors import InputError, LogError, ScoresError
from proxytune.files import temporary_folder
from proxytune.logs import Log, read_log
from proxytune.scores import (
    Metric,
    ScoreTable,
    Side,
    agent_column,
    both_metrics,
    check_sides,
    column_names,
    expand,
    read_scores,
)

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
            column_table(title, frame).to_csv(folder / f"{title}.csv", index=False)
        try:
            yield folder
        except InputError as problem:
            raise type(problem)(of_rows(str(problem).replace(f"{folder}/", ""))) from None


def of_rows(told: str) -> str:
    """A complaint about the lines of NAME.csv as one about the rows of the DataFrame NAME."""
    told = re.sub(r"(\.csv: |but )line (\d+)", lambda found: f"{found[1]}row {int(found[2]) - 2}", told)
    return re.sub(r"\b(\w+)\.csv\b", r"\1", told.replace(": row -1:", ":"))


def column_table(title: str, frame: pd.DataFrame) -> pd.DataFrame:
    """The DataFrame with the labels of its index as columns."""
    if not isinstance(frame, pd.DataFrame):
        raise InputError(f"{title}: must be a DataFrame, got {type(frame).__name__}")
    return frame.reset_index([name for name in frame.index.names if name in LABELS and name not in frame.columns])


Scores = pd.DataFrame | ScoreTable | str | Path


@dataclass(frozen=True)
class ScoreReport(report.Shown, usefulness.Assessment):
    """How useful a proxy is, and which agent to deploy: every measure, `.decision`, figures and a page.

    Attributes:
        names: What the proxy and the target are called.
        left_out: The agents that `common` left out, in a line for each side.
    """

    names: tuple[str, str] = ("proxy", "target")
    left_out: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"ScoreReport: {self.sentence}"

    def view(self) -> report.View:
        """What the page shows."""
        return report.score_view(self._named, None, target=self.names[1])

    @property
    def _named(self) -> "dict[str, ScoreReport]":
        return {self.names[0]: self}

    @property
    def sentence(self) -> str:
        """Say how low PRPV is, which agent to deploy, and what that risks."""
        return report.score_sentence(self._named, None, target=self.names[1])

    @property
    def document(self) -> dict[str, Any]:
        """Plain numbers, texts, lists and dicts under the keys of `score --json`."""
        return report.score_document(self)

    def to_frame(self) -> pd.DataFrame:
        """One row per measure and metric: value, and the ends of its 95 % interval."""
        return self.table()

    def figures(self) -> dict[str, Figure]:
        """The figures by name: scatter, flipped_pairs and decision."""
        return report.figures_of_scores(self)

    def sequential(self) -> usefulness.Sequential:
        """Test after each rollout, in the order of the target's table, which agent is the best.

        Raises:
            ScoresError: If scores are not within 0 and 1, an agent has one rollout, or outcomes are sorted.
        """
        columns, _ = usefulness.chosen(self.inputs, self.asked.decide_on)
        return usefulness.sequential_test(self.inputs, columns[0], seed=self.seed)


@dataclass(frozen=True, repr=False)
class Ranking(report.Shown):
    """Several proxies of one target: which is better beyond noise, by PRPV, by regret and by what it saves."""

    proxies: Mapping[str, ScoreReport]
    selection: usefulness.Selection

    def __getitem__(self, name: str) -> ScoreReport:
        return self.proxies[name]

    def __repr__(self) -> str:
        return f"Ranking: {self.sentence}"

    def view(self) -> report.View:
        """What the page shows."""
        return report.score_view(self.proxies, self.selection, target="target")

    def figures(self) -> dict[str, Figure]:
        """The figures of every proxy, as "scatter: NAME"."""
        drawn = ((name, kind, figure) for name, one in self.proxies.items() for kind, figure in one.figures().items())
        return {f"{kind}: {name}": figure for name, kind, figure in drawn}

    @property
    def sentence(self) -> str:
        """Say which proxy is the best, and whether that is beyond noise."""
        return report.score_sentence(self.proxies, self.selection, target="target")

    @property
    def document(self) -> dict[str, Any]:
        """Plain numbers, texts, lists and dicts under the keys of `score --json`."""
        return report.ranking_document(self.proxies, self.selection)

    def to_frame(self) -> pd.DataFrame:
        """One row per proxy, measure and metric: value, and the ends of its 95 % interval."""
        return pd.concat({name: one.to_frame() for name, one in self.proxies.items()}, names=["proxy"])


@overload
def score(both: Scores | None = None, /, *, proxy: Scores | None = None, **options: Any) -> ScoreReport: ...


@overload
def score(both: None = None, /, *, proxy: Mapping[str, Scores], **options: Any) -> Ranking: ...


def score(  # type: ignore[misc]  # the options above are those below
    both: Scores | None = None,
    /,
    *,
    proxy: Scores | Mapping[str, Scores] | None = None,
    target: Scores | None = None,
    metrics: str | Metric | Sequence[str | Metric] | None = None,
    beta: Mapping[str, float] | None = None,
    seed: int = 0,
    resamples: int = 1000,
    columns: Mapping[str, str] | None = None,
    common: bool = False,
    unpaired: bool = False,
    decide_on: str = "",
    rollouts: int | None = None,
    regret: float | None = None,
) -> ScoreReport | Ranking:
    """Measure how useful a proxy, or each of several, is as a predictor, and say which agent to deploy on the target.

    Args:
        both: One table of both sides, as with the columns "Sim success" and "Real success"; else name the two tables.
        proxy: One row per agent and episode, with the columns agent, episode (not needed for one row per agent) and
            the metrics; a DataFrame, a file in any form that the command reads, or a ScoreTable. Several by name, as in
            {"one": table, "other": table}, are ranked.
        target: The same of the target. Equal episodes on both sides are the same start.
        metrics: How agents are compared, as in "distance:max" or ["distance:max:5%", "time_out_of_lane:min"], "*:max"
            for all columns; not needed for a table of both sides' success.
        beta: Weight of each metric in PPV; by default one over its spread on the target.
        seed: Seed of resamples, permutations and draws.
        resamples: How many resamples and permutations to draw.
        columns: What columns are called in the tables, as in {"agent": "policy"}.
        common: Leave out agents that one side has alone, instead of refusing them; `.left_out` says which.
        unpaired: Treat episodes with equal labels as unrelated.
        decide_on: The metric to choose an agent by, or "mean".
        rollouts: Rollouts behind each mean of the target, where it has means alone.
        regret: The regret that is accepted, for what to do next, in the metric's unit.

    Returns:
        Every measure: `.prpv.value`, `.srcc.value["distance"]`, `.noise_floor`, `.chance`, `.notes`; and `.decision`,
        `.saves`, `.next`, `.figures()`, `.page()`, `.to_frame()`. Of several proxies each one's by its name, as in
        `found["one"].prpv.value`; and `.document`, `.selection`, `.page()`, `.to_frame()`.

    Raises:
        ScoresError: If a table lacks an agent or a metric, with side, row and column.
        InputError: If a metric, a weight or another option cannot be used.
    """
    if (both is None) == (proxy is None) or (proxy is None) != (target is None):
        raise InputError("give the proxy's and the target's scores, or one table of both sides")
    names, header = ("proxy", "target") if both is None else ("sim", "real"), _header(target if both is None else both)
    compared = _metrics(metrics, header)
    wanted = [metric.name for metric in compared]
    if both is not None:
        check_sides(names[1], header, wanted)
    several = proxy if isinstance(proxy, Mapping) else None
    if several is not None and (len(several) < 2 or "target" in several):
        raise InputError("proxy: give two tables or more by their names, none of them 'target'; or one table")
    given: Mapping[str, Any] = several or {names[0]: both if proxy is None else proxy}
    sides = {name: _table(one, "proxy", wanted, columns) for name, one in given.items()}
    sides["target"] = _table(target if both is None else both, "target", wanted, columns)
    sides, left_out = usefulness.in_common(sides) if common else (sides, ())
    if unpaired:
        sides = {side: table.unpaired() for side, table in sides.items()}
    asked = usefulness.Asked(decide_on, rollouts, regret)
    other = sides.pop("target")
    found, selection = usefulness.assess_each(
        proxies=sides, target=other, metrics=compared, beta=beta, asked=asked, resamples=resamples, seed=seed
    )
    reports = {}
    for name, one in found.items():
        own = {each.name: getattr(one, each.name) for each in fields(usefulness.Assessment)}
        reports[name] = ScoreReport(**own, names=(name, names[1]), left_out=left_out)
    return reports[names[0]] if selection is None else Ranking(reports, selection)


def _metrics(metrics: str | Metric | Sequence[str | Metric] | None, header: Sequence[str]) -> list[Metric]:
    given = [metrics] if isinstance(metrics, str | Metric) else metrics or []
    if not isinstance(given, Iterable):
        raise InputError(f"metrics: must be texts as 'success:max' or of Metric, got {metrics!r}")
    given = list(given)
    if not given:
        given = [f"{name}:max" for name in both_metrics(header) if "success" in name]
    compared = [
        own for one in given for own in ([one] if isinstance(one, Metric) else map(Metric.parse, expand([one], header)))
    ]
    if not compared:
        raise InputError("no metric is given; name at least one, as in 'success:max'")
    return compared


def _header(scores: Scores | None) -> list[str]:
    if isinstance(scores, pd.DataFrame):
        return [str(name) for name in scores.columns]
    if isinstance(scores, str | Path):
        return column_names(Path(scores))
    return list(scores.metrics) if isinstance(scores, ScoreTable) else []


def _table(scores: Scores | None, side: Side, names: Sequence[str], columns: Mapping[str, str] | None) -> ScoreTable:
    if isinstance(scores, ScoreTable):
        try:
            return scores.select(names)
        except ScoresError as problem:
            raise ScoresError(f"{side}: {problem}") from None
    if isinstance(scores, str | Path):
        return read_scores(scores, names, columns=columns, side=side)
    with as_files({side: _checked(scores, side, columns)}) as folder:
        return read_scores(folder / f"{side}.csv", names, columns=columns, side=side)


def _checked(scores: pd.DataFrame | None, side: str, columns: Mapping[str, str] | None) -> pd.DataFrame:
    """A DataFrame; what it may be like and a file not is refused."""
    if not isinstance(scores, pd.DataFrame):
        kind = type(scores).__name__
        raise InputError(f"{side}: must be a DataFrame, a CSV file or a ScoreTable, got {kind}")
    if "agent" not in (*scores.columns, *scores.index.names, *(columns or ())) and not agent_column(_header(scores)):
        found = ", ".join(map(str, scores.columns))[:60]
        raise ScoresError(f"{side}: no column 'agent'; columns are {found}; name the column or index of agents 'agent'")
    domains = list(scores["domain"].unique()) if "domain" in scores else []
    if len(domains) > 1:
        raise ScoresError(f"{side}: has several domains; select one, as in scores[scores.domain == {domains[0]!r}]")
    return scores


def toml_text(values: Mapping[str, Any], where: str, refuse: type[InputError] = InputError) -> str:
    """The TOML file of what was given in Python; numbers of NumPy may be among it.

    Raises:
        InputError: Or `refuse`, if something is neither text, number, truth value, list nor table.
    """
    try:
        return tomlkit.dumps({key: one.item() if isinstance(one, np.generic) else one for key, one in values.items()})
    except TypeError as problem:
        raise refuse(f"{where}: {problem}; give texts and numbers") from None


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
    with as_files(frames) as folder:
        text = toml_text({"name": "log", **description}, "log.toml", LogError)
        (folder / "log.toml").write_text(text, encoding="utf-8")
        return read_log(folder)
