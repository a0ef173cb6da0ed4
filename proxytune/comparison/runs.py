"""One engine on one seed of an objective, from the design to the end of its budget."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from proxytune.comparison.analytic import Objective
from proxytune.comparison.judgement import Judgement, judge, judgement_from
from proxytune.errors import RunError
from proxytune.search import Engine, Propose, Search, Trial, Values, make_proposer


@dataclass(frozen=True)
class RunKey:
    """What a run is a function of.

    Attributes:
        objective: Identity of the objective.
        engine: Name of the engine.
        seed: The instance of the problem, its noise, the design, and what the engine draws.
        budget: How many evaluations.
        initial: How many of them are the design, which all engines share.
        code: Digest of the code that the engine's proposals depend on.
    """

    objective: str
    engine: str
    seed: int
    budget: int
    initial: int
    code: str


@dataclass(frozen=True)
class Run:
    """What an engine did, and what that is worth.

    Attributes:
        key: Which run it was.
        visited: The points in order.
        seconds: Mean time per proposal after the design.
        judgement: What they are worth.
    """

    key: RunKey
    visited: tuple[Values, ...]
    seconds: float
    judgement: Judgement


def run_engine(objective: Objective, key: RunKey, engine: Engine) -> Run:
    """Spend the budget, and judge what came of it.

    Raises:
        InputError: If there is no such engine, or it needs a library that is not installed.
        RunError: If no trial has a score, with why the first has none.
    """
    learns = engine.learns_from == "outputs"
    goal = objective.goal(key.seed) if learns else None
    proposer = make_proposer(engine, key.initial, goal)
    visits = Visits(objective, key)
    try:
        Search(objective.space, proposer, key.seed, key.budget, key.initial).run(visits)
        points = tuple(trial.values for trial in visits.trials())
        judgement = judge(objective, points, key.seed, by_outputs=learns)
    except RunError as problem:
        if why := visits.first_failure():
            raise RunError(f"{problem}; seed {key.seed}, the first θ: {why}") from None
        raise
    return Run(key, points, visits.seconds / max(1, key.budget - key.initial), judgement)


class Visits:
    """The points that an engine visits, as the search loop evaluates them.

    Attributes:
        seconds: How long the proposals after the design have taken.
    """

    def __init__(self, objective: Objective, key: RunKey) -> None:
        self.seconds = 0.0
        self._objective, self._key = objective, key
        self._trials: list[Trial] = []

    def trials(self) -> Sequence[Trial]:
        """The visits so far, in order."""
        return list(self._trials)

    def first_failure(self) -> str:
        """Why the first visit has no score, where none has; else empty."""
        if any(trial.score is not None for trial in self._trials):
            return ""
        return "".join(self._objective.failure(trial.values, self._key.seed) for trial in self._trials[:1])

    def ended(self) -> str:
        """Why no further point is visited; empty while one is."""
        return "the budget is spent" if len(self._trials) >= self._key.budget else ""

    def evaluate(self, batch: range, propose: Propose) -> None:
        """Score the next point."""
        begun = time.perf_counter()
        points = propose()
        self.seconds += time.perf_counter() - begun if batch.start >= self._key.initial else 0.0
        objective, seed = self._objective, self._key.seed
        self._trials += [Trial(v, objective.score(v, seed), objective.outcome(v, seed)) for v in points]


def judged_again(objective: Objective, run: Run, engine: Engine) -> Run:
    """A finished run, judged by the code of today: nothing is proposed, and nothing of a point is evaluated twice."""
    found = judge(objective, run.visited, run.key.seed, by_outputs=engine.learns_from == "outputs")
    return Run(run.key, run.visited, run.seconds, found)


def run_document(run: Run) -> dict[str, Any]:
    """A run as plain JSON."""
    return asdict(run)


def run_from(document: Mapping[str, Any]) -> Run:
    """The run that was written so.

    Raises:
        KeyError: If something is missing.
        TypeError: If something is of another kind.
    """
    visited = tuple(tuple(values) for values in document["visited"])
    return Run(RunKey(**document["key"]), visited, document["seconds"], judgement_from(document["judgement"]))
