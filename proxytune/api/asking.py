"""Ask and tell: the search on its own, for a simulator that proxytune knows nothing of."""

from collections.abc import Mapping

import pandas as pd

from proxytune.errors import InputError
from proxytune.search.engines.registry import make_proposer
from proxytune.search.proposer import Trial, Values
from proxytune.space import Interval, Space, Theta


class SearchBox:
    """A box of parameters that is searched: ask for a θ, simulate it yourself, tell its score.

    What is asked next is a function of seed and tells alone. Several asks before a tell are a batch.
    """

    def __init__(
        self, box: Mapping[str, tuple[float, float]], *, engine: str = "gp", initial: int = 8, seed: int = 1
    ) -> None:
        """Open a box.

        Args:
            box: Lowest and highest value of each parameter.
            engine: What proposes; one that learns from scores alone.
            initial: How many θ come from the quasi-random design.
            seed: Seed of all that is drawn.

        Raises:
            InputError: If the box is empty or inside out, or there is no such engine.
        """
        if not box:
            raise InputError("the box is empty; give at least one parameter, as in {'trim': (-0.3, 0.3)}")
        self._space = Space(tuple(Interval(name, *ends) for name, ends in sorted(box.items())))
        self._proposer, self._seed = make_proposer(engine, initial), seed
        self._asked: list[Values] = []
        self._scores: dict[int, float | None] = {}

    def ask(self) -> dict[str, float]:
        """The next θ to look at."""
        order = sorted(range(len(self._asked)), key=lambda place: place not in self._scores)
        trials = [
            Trial(self._asked[place], self._scores.get(place), pending=place not in self._scores) for place in order
        ]
        self._asked.append(self._proposer.propose(self._space, trials, self._seed))
        return dict(self._space.theta(self._asked[-1]))

    def tell(self, theta: Theta, score: float | None) -> None:
        """Tell the score of a θ that was asked for; None where it failed.

        Args:
            theta: As `ask` gave it.
            score: What is to be made small.

        Raises:
            InputError: If this θ was not asked for, or has a score already.
        """
        if set(theta) != set(self._space.names):
            raise InputError(f"θ names {', '.join(theta)}; the box has {', '.join(self._space.names)}")
        values = self._space.values(theta)
        open_places = [p for p, asked in enumerate(self._asked) if asked == values and p not in self._scores]
        if not open_places:
            raise InputError(f"θ {dict(theta)} was not asked for, or has a score already; tell what `ask` gave")
        self._scores[open_places[0]] = None if score is None else float(score)

    def trials(self) -> pd.DataFrame:
        """One row per θ told, in the order in which they were asked for, with its score."""
        rows = [{**self._space.theta(self._asked[p]), "score": self._scores[p]} for p in sorted(self._scores)]
        return pd.DataFrame(rows, columns=[*self._space.names, "score"])
