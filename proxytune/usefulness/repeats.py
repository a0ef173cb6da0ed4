"""Starts and their repeats: an episode labelled START/REPEAT is one of several from START, under other noise each."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from proxytune.scores import ScoreTable

Counts = NDArray[np.int64]
Choice = NDArray[np.bool_]


def start_of(label: str) -> str:
    """The start of an episode: what is before the label's last "/", or the whole label where there is none."""
    return label.rpartition("/")[0] or label


def starts_of(labels: Iterable[str]) -> tuple[str, ...]:
    """The starts of these episodes, each once, in their order."""
    return tuple(dict.fromkeys(map(start_of, labels)))


def start_places(table: ScoreTable) -> Counts:
    """The place of each episode's start among the table's starts."""
    places = {start: place for place, start in enumerate(starts_of(table.episodes))}
    return np.array([places[start_of(label)] for label in table.episodes], dtype=np.int64)


def repeats(table: ScoreTable) -> Counts:
    """How many repeats each agent drove of each start, shape (agents, starts)."""
    places = start_places(table)
    order = np.argsort(places, kind="stable")
    firsts = np.searchsorted(places[order], np.arange(places.max() + 1))
    return np.add.reduceat(table.driven[:, order].astype(np.int64), firsts, axis=1)


def is_repeated(table: ScoreTable) -> bool:
    """Whether every start has at least two repeats, so that a domain can be compared with itself from the same starts.

    Every agent must have driven some start twice. A start that one agent alone drove is no start but a label of that
    agent's own.
    """
    labels, driven = np.bincount(start_places(table)), repeats(table)
    shared = (driven > 0).sum(axis=0) >= 2
    return bool(labels.min() >= 2 and shared.all() and (driven >= 2).any(axis=1).all())


def split_repeats(driven: Choice, places: Counts, keys: NDArray[np.float64]) -> tuple[Choice, Choice]:
    """Which episodes fall into either of two sets that hold the same starts, each as often.

    Where an agent has an odd number of repeats of a start, one is left out. Agents split the same repeats alike.

    Args:
        driven: Which agent drove which episode, shape (agents, episodes).
        places: The place of each episode's start.
        keys: Random numbers, shape (splits, episodes); the lower half of a start's repeats is the first set's.

    Returns:
        Two arrays of shape (agents, splits, episodes).
    """
    first, second = np.zeros((2, len(driven), *keys.shape), dtype=np.bool_)
    for place in range(places.max() + 1):
        columns = np.flatnonzero(places == place)
        own = driven[:, None, columns]
        rank = np.where(own, keys[:, columns], np.inf).argsort(axis=-1).argsort(axis=-1)
        size = own.sum(axis=-1, keepdims=True) // 2
        first[..., columns] = rank < size
        second[..., columns] = (rank >= size) & (rank < 2 * size)
    return first, second


def by_start(table: ScoreTable) -> ScoreTable:
    """The same scores with one episode per start: the mean over its repeats."""
    members, counts = _membership(table).astype(np.float64), repeats(table)
    sums = np.einsum("aem,es->asm", np.nan_to_num(table.values), members)
    values = np.where(counts[..., None] > 0, sums / np.maximum(counts, 1)[..., None], np.nan)
    return ScoreTable(table.agents, starts_of(table.episodes), table.metrics, values)


def _membership(table: ScoreTable) -> NDArray[np.bool_]:
    """Which episode is a repeat of which start, shape (episodes, starts)."""
    places = start_places(table)
    return np.asarray(places[:, None] == np.arange(places.max() + 1), dtype=np.bool_)
