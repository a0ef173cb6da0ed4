"""Who is ahead of whom in a column of scores, by sorting: what every pair would say at the cost of few comparisons."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.scores import ROUNDING, Array

FEW_AGENTS = 128
"""Up to so many agents each pair is compared, in many tables at once, which is quicker for them."""
BITS = 64
WORDS = 2**20
"""Most words of 64 bits that one set of agents per agent may take, 8 MiB: more agents go in several blocks."""

Indices = NDArray[np.int64]
Sets = NDArray[np.uint64]
"""One set of agents per row, one bit per agent."""


@dataclass(frozen=True)
class Standing:
    """Where each agent stands in one column.

    Attributes:
        order: Agents from the lowest score to the highest.
        below: How many agents each is ahead of; these come first in the order.
        reach: How many agents are not ahead of each; these come first in the order too.
    """

    order: Indices
    below: Indices
    reach: Indices

    def sets(self, block: slice) -> Sets:
        """The first 0, 1, … agents of the order as sets, shape (agents + 1, words): the bits of this block of words."""
        agents, words = len(self.order), block.stop - block.start
        word = self.order // BITS - block.start
        rows = np.flatnonzero((word >= 0) & (word < words))
        sets = np.zeros((agents + 1, words), dtype=np.uint64)
        sets[rows + 1, word[rows]] = np.uint64(1) << (self.order[rows] % BITS).astype(np.uint64)
        return np.bitwise_or.accumulate(sets, axis=0, out=sets)


def stand(scores: Array, tie: float) -> Standing:
    """Sort a column.

    Args:
        scores: One per agent, finite.
        tie: The largest difference that is still a tie.
    """
    agents = len(scores)
    order = np.argsort(scores)
    ahead_of = _ahead_of(scores[order], tie)
    below, reach = np.empty((2, agents), dtype=np.int64)
    below[order] = ahead_of
    reach[order] = np.searchsorted(ahead_of, np.arange(agents), side="right")
    return Standing(order, below, reach)


def stand_by_rounding(scores: Array) -> Standing:
    """Sort a column in which only rounding makes ties."""
    return stand(scores, ROUNDING * float(np.abs(scores).max()))


def blocks(agents: int) -> Iterator[slice]:
    """The words of a set of agents, as many at a time as memory is to take."""
    words, size = -(-agents // BITS), max(1, WORDS // (agents + 1))
    return (slice(start, min(start + size, words)) for start in range(0, words, size))


def count(sets: Sets) -> int:
    """How many agents all these sets hold together, each set's own."""
    return int(np.bitwise_count(sets).sum(dtype=np.int64))


def _ahead_of(ascending: Array, tie: float) -> Indices:
    """How many of ascending scores each exceeds by more than a tie: those of which the difference as rounded does."""
    guess = np.searchsorted(ascending, ascending - tie)
    last, first = ascending[np.maximum(guess - 1, 0)], ascending[guess]
    if (((ascending - last > tie) | (guess == 0)) & ~(ascending - first > tie)).all():
        return np.asarray(guess, dtype=np.int64)
    low, high = np.zeros(len(ascending), dtype=np.int64), np.arange(len(ascending))
    while (low < high).any():
        middle = (low + high) // 2
        exceeds = ascending - ascending[middle] > tie
        low, high = np.where(exceeds, middle + 1, low), np.where(exceeds, high, middle)
    return low
