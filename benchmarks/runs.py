"""Runs of search engines: one engine on one seed of a problem, and what many say of an engine beside the first."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from compared_engines import engine_of
from judgement import Judgement, Reading, judge, judgement_from
from numpy.typing import NDArray
from problems import Objective

from proxytune.arrays import Floats
from proxytune.errors import RunError, StoreError
from proxytune.search import BatchPoints, Engine, Search, Trial, Values, make_proposer

RESAMPLES = 4000
LEVELS = (2.5, 97.5)


@dataclass(frozen=True)
class RunKey:
    """What a run is a function of."""

    objective: str  # identity of the objective
    engine: str  # name of the engine
    seed: int  # the instance of the problem, its noise, the design, and what the engine draws
    budget: int  # how many evaluations
    initial: int  # how many of them are the design, which all engines share
    code: str  # digest of the code that the engine's proposals depend on


@dataclass(frozen=True)
class Run:
    """What an engine did, and what that is worth."""

    key: RunKey  # which run it was
    visited: tuple[Values, ...]  # the points in order
    seconds: float  # mean time per proposal after the design
    judgement: Judgement  # what they are worth


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

    def evaluate(self, batch: range, propose: BatchPoints) -> None:
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


def finished_run(objective: Objective, beside: Path, piece: tuple[RunKey, Run | None]) -> Run:
    """The run of a key; one that is there already is judged again.

    Args:
        objective: Where.
        beside: The folder of one's own engines.
        piece: The key, and its run where there is one.
    """
    key, run = piece
    engine = engine_of(key.engine, beside)
    return judged_again(objective, run, engine) if run else run_engine(objective, key, engine)


def read_runs(path: Path) -> dict[RunKey, Run]:
    """Read the finished runs from a file of JSON lines; a line left unfinished by an interruption is skipped."""
    runs = {}
    for line in path.read_bytes().splitlines() if path.exists() else []:
        try:
            run = run_from(json.loads(line))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            continue
        runs[run.key] = run
    return runs


def append_run(path: Path, run: Run) -> None:
    """Add a run to a file of JSON lines.

    Raises:
        StoreError: If it cannot be written.
    """
    try:
        with path.open("a", encoding="utf-8") as file:
            # On a separate line even after one that was left unfinished.
            file.write("\n" * (file.tell() > 0) + json.dumps(run_document(run)))
    except OSError as problem:
        raise StoreError(f"{path}: cannot be written ({problem.strerror}); choose another --output") from None


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % bootstrap interval over seeds."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Region:
    """What the points of an engine's runs tell of θ, read as a study reads them."""

    covered: int | None  # in how many runs the truth is in the 95 % region; None where it is not known
    share: Estimate  # median share of the region in the box
    # for each parameter, in how many runs its 95 % interval holds the truth; None as above
    intervals_covered: Mapping[str, int] | None
    misfits: int  # in how many runs it was said that the proxy lacks something


@dataclass(frozen=True)
class EngineSummary:
    """An engine over all its seeds. Differences and ratios are to the first engine, seed by seed; None for itself."""

    engine: str  # its name
    seeds: int  # how many runs
    score: Estimate | None  # mean score of the answers, free of the noise that the engine has seen; None if all failed
    # that over the truths' own mean score of the same fresh episodes; None where truth is not known, or scores
    # nothing
    of_truth: Estimate | None
    regret_difference: Estimate | None  # how much higher that is on average; the regret is higher by as much
    regret: Estimate  # median regret of the answer
    reached: int  # in how many runs a visited point was within the noise floor, or no worse than the truth
    # median number of evaluations to get there; a run that did not counts as one more than the budget
    evaluations: Estimate
    saved: Estimate | None  # mean number of evaluations by which the first gets there sooner
    ratio: Estimate | None  # mean number of evaluations of the first, as a share of this engine's
    simulated: Estimate | None  # mean simulated seconds to get there, counted likewise; None where nothing is simulated
    error: Estimate | None  # median error of θ in widths of the box; None where truth is not known
    error_difference: Estimate | None  # how much larger that is on average
    region: Region | None  # what its points tell of θ; None where a score has no parts
    seconds: float  # median time per proposal


def summarise(
    runs: Sequence[Run], first: Sequence[Run], tolerance: float, seconds: float | None = None
) -> EngineSummary:
    """Sum up the runs of one engine against those of the first on the same seeds, both in the order of the seeds.

    An evaluation takes so many simulated seconds, if any.
    """
    needed, firsts = _needed(runs, tolerance), _needed(first, tolerance)
    errors, first_errors = _errors(runs), _errors(first)
    other = runs[0].key.engine != first[0].key.engine
    scores = [run.judgement.answer_score for run in runs if run.judgement.answer_score is not None]
    regrets = _regrets(runs)
    return EngineSummary(
        engine=runs[0].key.engine,
        seeds=len(runs),
        score=estimate(np.array(scores), np.mean) if scores else None,
        of_truth=_of_truth(runs),
        regret_difference=estimate(regrets - _regrets(first), np.mean) if other else None,
        regret=estimate(regrets, np.median),
        reached=sum(run.judgement.evaluations_to(tolerance) is not None for run in runs),
        evaluations=estimate(needed, np.median),
        saved=estimate(needed - firsts, np.mean) if other else None,
        ratio=ratio(firsts, needed) if other else None,
        simulated=estimate(needed * seconds, np.mean) if seconds else None,
        error=estimate(errors, np.median) if errors.size else None,
        error_difference=estimate(errors - first_errors, np.mean) if other and errors.size else None,
        region=_region(runs),
        seconds=float(np.median([run.seconds for run in runs])),
    )


def estimate(values: Floats, figure: Callable[..., Floats]) -> Estimate:
    """A figure of the values (n,) and its interval; the figure is a numpy reduction."""
    low, high = np.percentile(figure(values[_resampled(len(values))], axis=1), LEVELS)
    return Estimate(float(figure(values)), float(low), float(high))


def ratio(values: Floats, others: Floats) -> Estimate:
    """Mean of the values (n,) as a share of that of others (n,), the pairs resampled together."""
    rows = _resampled(len(values))
    low, high = np.percentile(values[rows].mean(axis=1) / others[rows].mean(axis=1), LEVELS)
    return Estimate(float(values.mean() / others.mean()), float(low), float(high))


def median_curve(runs: Sequence[Run]) -> tuple[Floats, Floats, Floats]:
    """Median over runs of the lowest regret so far, after each evaluation, and the ends of its interval."""
    curves = np.array([run.judgement.best_regrets for run in runs])
    rows = _resampled(len(curves))
    with np.errstate(invalid="ignore"):  # infinite while all have failed
        ends = np.array([np.percentile(np.median(column[rows], axis=1), LEVELS) for column in curves.T])
    return np.median(curves, axis=0), ends[:, 0], ends[:, 1]


def _resampled(count: int) -> NDArray[np.int64]:
    return np.random.default_rng(0).integers(0, count, (RESAMPLES, count))


def _needed(runs: Sequence[Run], tolerance: float) -> Floats:
    return np.array([run.judgement.evaluations_to(tolerance) or run.key.budget + 1 for run in runs], dtype=float)


def _errors(runs: Sequence[Run]) -> Floats:
    """Errors of θ, of all runs or of none."""
    return np.array([run.judgement.error for run in runs if run.judgement.error is not None])


def _of_truth(runs: Sequence[Run]) -> Estimate | None:
    """The answers' scores as a share of the truths', of which their regret is the difference."""
    found = [
        (one.answer_score, one.answer_score - one.answer_regret)
        for one in (run.judgement for run in runs)
        if one.error is not None and one.answer_score is not None and one.answer_regret is not None
    ]
    answers, truths = np.array(found, dtype=float).reshape(-1, 2).T
    return ratio(answers, truths) if truths.any() else None


def _regrets(runs: Sequence[Run]) -> Floats:
    """A run whose answer has no regret counts as its worst visited point."""
    found = [run.judgement for run in runs]
    worst = [max(regret for regret in one.regrets if regret is not None) for one in found]
    return np.array(
        [high if one.answer_regret is None else one.answer_regret for one, high in zip(found, worst, strict=True)]
    )


def _region(runs: Sequence[Run]) -> Region | None:
    found = [run.judgement.reading for run in runs if run.judgement.reading is not None]
    if not found:
        return None
    return Region(
        covered=_count([reading.holds for reading in found]),
        share=estimate(np.array([reading.share for reading in found]), np.median),
        intervals_covered=_by_parameter(found),
        misfits=sum(reading.fits is False for reading in found),
    )


def _count(flags: Sequence[bool | None]) -> int | None:
    return None if None in flags else sum(bool(flag) for flag in flags)


def _by_parameter(found: Sequence[Reading]) -> dict[str, int] | None:
    held = [reading.intervals_hold for reading in found if reading.intervals_hold is not None]
    if len(held) < len(found):
        return None
    return {name: sum(one[name] for one in held) for name in held[0]}
