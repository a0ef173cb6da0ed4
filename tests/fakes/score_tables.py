"""Tables of scores for tests: of means, of single episodes, and drawn at random around agents in order."""

import numpy as np

from proxytune.scores import ScoreTable
from proxytune.usefulness import bootstrap_means, compare, why_not_repeated
from proxytune.usefulness.resampling import prpv_interval


def table_of(values, labels=None, metrics="mn"):
    """Agents A0, A1, … from values of shape (agents, episodes) or (agents, episodes, metrics)."""
    values = np.asarray(values, dtype=float)
    values = values[..., None] if values.ndim == 2 else values
    agents, episodes, columns = values.shape
    labels = map(str, range(episodes)) if labels is None else labels
    return ScoreTable(tuple(f"A{i}" for i in range(agents)), tuple(labels), tuple(metrics[:columns]), values)


def of_means(*rows, metrics="mn"):
    """Agents A, B, … with one episode each, a row of its metrics each."""
    scores = np.asarray(rows, dtype=float).reshape(len(rows), -1)
    return ScoreTable(tuple("ABCDEFGHIJ"[: len(rows)]), ("1",), tuple(metrics[: scores.shape[1]]), scores[:, None])


def ordered(seed, episodes=6, agents=5):
    """Two metrics of agents that are in order but for a noise of their distance."""
    return table_of(np.random.default_rng(seed).normal(size=(agents, episodes, 2)) + np.arange(agents)[:, None, None])


def bootstrap_prpv(*, proxy, target, metrics, resamples=1000, seed=0):
    """The interval of PRPV alone."""
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    repeated = not why_not_repeated(inputs)
    return prpv_interval(inputs, bootstrap_means(inputs, resamples=resamples, seed=seed) if repeated else None)
