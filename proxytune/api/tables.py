"""Usefulness from two DataFrames."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from proxytune.errors import ScoresError
from proxytune.scores import Metric, ScoreTable, read_scores
from proxytune.usefulness import Assessment, assess

Scores = pd.DataFrame | ScoreTable


def score(*, proxy: Scores, target: Scores, metrics: Sequence[str | Metric], seed: int = 0) -> Assessment:
    """Measure how useful a proxy is, from the scores of the same agents on both sides.

    Args:
        proxy: One row per agent and episode, with the columns agent, episode (not needed for one row per agent) and
            metrics.
        target: The same of the target.
        metrics: How agents are compared, as in "distance:max" or "distance:max:5%".
        seed: Seed of resamples and permutations.

    Raises:
        ScoresError: If a table lacks an agent, an episode or a metric, with row and column.
        InputError: If a metric is not one.
    """
    compared = [metric if isinstance(metric, Metric) else Metric.parse(metric) for metric in metrics]
    names = [metric.name for metric in compared]
    sides = {side: _table(scores, side, names) for side, scores in {"proxy": proxy, "target": target}.items()}
    return assess(proxy=sides["proxy"], target=sides["target"], metrics=compared, seed=seed)


def _table(scores: Scores, side: str, names: Sequence[str]) -> ScoreTable:
    """The table, checked by the reader of files, so that there is one way to read scores."""
    if isinstance(scores, ScoreTable):
        return scores
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{side}.csv"
        scores.to_csv(path, index=False)
        try:
            return read_scores(path, names)
        except ScoresError as problem:
            raise ScoresError(str(problem).replace(f"{folder}/", "").replace(".csv", "", 1)) from None
