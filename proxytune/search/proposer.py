"""What proposes the next θ: a pure function of the space, the finished trials and the seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from proxytune.space import Space

Values = tuple[float, ...]
"""A point of the search box: one value per parameter, in the order of the box."""


@dataclass(frozen=True)
class Trial:
    """A finished trial: where it was, and the score that is to be made small.

    Attributes:
        values: The point, in the order of the box.
        score: Its score, or None where the trial failed.
    """

    values: Values
    score: float | None


class Proposer(Protocol):
    """Chooses where to look next, remembering nothing: that is what makes resuming exact."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point; the same for the same trials in whatever order they are given."""
        ...
