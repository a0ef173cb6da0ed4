"""Ask and tell: the search on its own, for a simulator that proxytune knows nothing of."""

import math
from collections.abc import Mapping

import pandas as pd

from proxytune.errors import InputError
from proxytune.search import Engine, Trial, Values, make_proposer
from proxytune.settings import check_numbers, check_whole
from proxytune.space import Interval, Space, Theta


class SearchBox:
    """A box of parameters that is searched: ask for a θ, simulate it yourself, tell its score.

    What is asked next is a function of seed and tells alone. Several asks before a tell are a batch: each θ is asked
    for with those not told yet in mind.

        box = SearchBox({"trim": (-0.3, 0.3), "delay": (0.0, 0.3)})
        for _ in range(20):
            theta = box.ask()
            box.tell(theta, simulate(theta))
        theta, score = box.best()
    """

    def __init__(
        self,
        box: Mapping[str, tuple[float, float]],
        *,
        engine: str | Engine = "gp",
        initial: int = 8,
        seed: int = 1,
        maximise: bool = False,
    ) -> None:
        """Open a box.

        Args:
            box: Lowest and highest value of each parameter.
            engine: What proposes: a name of `python -m proxytune list engines`, or your own; it learns from scores.
            initial: How many θ come from the quasi-random design, before the engine proposes.
            seed: Seed of all that is drawn.
            maximise: Whether high scores are good; low ones are if not.

        Raises:
            InputError: If the box is empty or inside out, or the engine cannot be used.
        """
        check_whole("initial", initial, 1)
        check_whole("seed", seed)
        self._space = box_space(box)
        self._proposer, self._seed, self._sign = make_proposer(engine, initial), seed, -1.0 if maximise else 1.0
        self._asked: list[Values] = []
        self._scores: dict[int, float | None] = {}

    def ask(self) -> dict[str, float]:
        """The next θ to simulate."""
        pending = [place for place in range(len(self._asked)) if place not in self._scores]
        trials = [self._trial(place) for place in (*sorted(self._scores), *pending)]
        self._asked.append(self._proposer.propose(self._space, trials, self._seed))
        return self._space.theta(self._asked[-1])

    def tell(self, theta: Theta, score: float | None) -> None:
        """Tell the score of a θ that was asked for.

        Args:
            theta: As `ask` gave it.
            score: How good it is; None where the simulation failed, which counts as the worst score told.

        Raises:
            InputError: If this θ was not asked for or has a score already, or the score is not a finite number.
        """
        place = self._place(theta)
        try:
            value = None if score is None else float(score)
        except (TypeError, ValueError):
            value = math.nan
        if value is not None and not math.isfinite(value):
            raise InputError(f"a score must be a finite number, or None where the simulation failed, got {score!r}")
        self._scores[place] = value

    def best(self) -> tuple[dict[str, float], float]:
        """The θ of the best score told, and that score; where scores are noisy, part of it is luck.

        Raises:
            InputError: If no score has been told.
        """
        told = [(self._sign * value, place) for place, value in self._scores.items() if value is not None]
        if not told:
            raise InputError("no score has been told; ask for a θ and tell its score first")
        score, place = min(told)
        return self._space.theta(self._asked[place]), self._sign * score

    def trials(self) -> pd.DataFrame:
        """One row per θ told, in the order in which they were asked for, with its score."""
        told = sorted(self._scores)
        rows = [{**self._space.theta(self._asked[place]), "score": self._scores[place]} for place in told]
        return pd.DataFrame(rows, columns=[*self._space.names, "score"])

    def _trial(self, place: int) -> Trial:
        score = self._scores.get(place)
        own = None if score is None else self._sign * score
        return Trial(self._asked[place], own, pending=place not in self._scores)

    def _place(self, theta: Theta) -> int:
        """Index of this θ among those asked for, the first that has no score."""
        if set(theta) != set(self._space.names):
            raise InputError(f"θ names {', '.join(theta)}; the box has {', '.join(self._space.names)}")
        check_numbers(theta)
        values = self._space.values(theta)
        places = [place for place, asked in enumerate(self._asked) if asked == values]
        left = [place for place in places if place not in self._scores]
        if not left:
            problem = "has a score already; ask for the next" if places else "was not asked for; tell what `ask` gave"
            raise InputError(f"θ {self._space.theta(values)} {problem}")
        return left[0]


def box_space(box: Mapping[str, tuple[float, float]]) -> Space:
    """The box of these ends by name."""
    if not box:
        raise InputError("the box is empty; give at least one parameter, as in {'trim': (-0.3, 0.3)}")
    intervals = []
    for name, ends in sorted(box.items()):
        try:
            low, high = map(float, ends)
        except (TypeError, ValueError):
            raise InputError(f"{name}: must be (lowest, highest), as in (-0.3, 0.3), got {ends!r}") from None
        intervals.append(Interval(name, low, high))
    return Space(tuple(intervals))
