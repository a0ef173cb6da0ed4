"""One engine on one seed of an objective, from the design to the end of its budget."""

import hashlib
import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from proxytune.search.analytic import Objective
from proxytune.search.engines import make_proposer
from proxytune.search.proposer import Trial, Values
from proxytune.search.surrogate import fit_surrogate


@dataclass(frozen=True)
class RunKey:
    """What a run is a function of.

    Attributes:
        objective: Identity of the objective.
        engine: Name of the engine.
        seed: The instance of the problem, its noise, the design, and what the engine draws.
        budget: How many evaluations.
        initial: How many of them are the design, which all engines share.
        code: Digest of the code of the search.
    """

    objective: str
    engine: str
    seed: int
    budget: int
    initial: int
    code: str


@dataclass(frozen=True)
class Run:
    """What an engine achieved.

    Attributes:
        key: Which run it was.
        regrets: Regret of every visited point, in order; None where the trial failed.
        answer: The visited point with the lowest posterior mean, which is what a study reports.
        answer_regret: Its regret, free of the noise that the engine has seen; None where it failed.
        error: Its distance from the truth in widths of the box, None where truth is not known.
        seconds: Mean time per proposal after the design.
    """

    key: RunKey
    regrets: tuple[float | None, ...]
    answer: Values
    answer_regret: float | None
    error: float | None
    seconds: float

    @property
    def best_regrets(self) -> tuple[float, ...]:
        """The lowest regret of the points visited so far, after each evaluation; infinite while all have failed."""
        lowest, found = math.inf, []
        for regret in self.regrets:
            lowest = min(lowest, math.inf if regret is None else regret)
            found.append(lowest)
        return tuple(found)

    def evaluations_to(self, tolerance: float) -> int | None:
        """How many evaluations it took to visit a point within the tolerance; None if the budget did not suffice."""
        return next((n for n, regret in enumerate(self.best_regrets, 1) if regret <= tolerance), None)


def run_engine(objective: Objective, key: RunKey) -> Run:
    """Spend the budget and take the study's own answer from the trials.

    Raises:
        InputError: If there is no such engine, or it needs a library that is not installed.
        RunError: If no trial has a score.
    """
    proposer, space, spent = make_proposer(key.engine, key.initial, objective.goal(key.seed)), objective.space, 0.0
    trials: list[Trial] = []
    for number in range(key.budget):
        begun = time.perf_counter()
        values = proposer.propose(space, trials, key.seed)
        spent += time.perf_counter() - begun if number >= key.initial else 0.0
        trials.append(Trial(values, objective.score(values, key.seed), objective.outcome(values, key.seed)))
    answer, _ = fit_surrogate(space, trials).incumbent()
    return Run(
        key=key,
        regrets=tuple(objective.regret(trial.values, key.seed) for trial in trials),
        answer=answer,
        answer_regret=objective.fresh_regret(answer, key.seed),
        error=objective.error(answer, key.seed),
        seconds=spent / max(1, key.budget - key.initial),
    )


def search_code() -> str:
    """A digest of the code of the search: with other code, a run is another run."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:12]


def run_document(run: Run) -> dict[str, Any]:
    """A run as plain JSON."""
    return asdict(run)


def run_from(document: Mapping[str, Any]) -> Run:
    """The run that was written so.

    Raises:
        KeyError: If something is missing.
        TypeError: If something is of another kind.
    """
    fields = dict(document)
    key = RunKey(**fields.pop("key"))
    return Run(key, tuple(fields.pop("regrets")), tuple(fields.pop("answer")), **fields)
