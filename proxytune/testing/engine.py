"""What every search engine promises."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from proxytune.search.design import to_unit
from proxytune.search.engines.engine import Engine
from proxytune.search.engines.registry import make_proposer, why_not_engine
from proxytune.search.goal import Goal
from proxytune.search.proposer import Proposer, Trial, Values, propose_batch
from proxytune.space import Interval, Space
from proxytune.testing.claim import ask, claim

BOX = Space((Interval("delay", 0.0, 0.3), Interval("trim", -0.3, 0.3)))
NARROW = Space((Interval("mass", 200.0, 2000.0),))
"""A box of a single parameter."""
INITIAL, BUDGET, SEED, BATCH = 3, 8, 3, 3
Score = Callable[[Space, Values], float | None]
"""The score of a point, None where its trial fails."""


def _stepped(box: Space, values: Values) -> float | None:
    """A score with steps, lowest about a third of the way along each side, as PRPV's are."""
    return float(np.floor(12.0 * np.abs(to_unit(box, values) - 1.0 / 3.0).sum()))


def _at_a_corner(box: Space, values: Values) -> float | None:
    return -float(to_unit(box, values).sum())


def _half_failed(box: Space, values: Values) -> float | None:
    return None if to_unit(box, values)[0] > 0.5 else _stepped(box, values)


def _score_itself(outcomes: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(outcomes[..., 0])


GOAL = Goal((("agent", "score"),), np.zeros(1), np.zeros(1), _score_itself)
"""An outcome that is the score itself, for an engine that learns from outputs; the target's is 0."""


def check_engine(engine: Engine) -> None:
    """Refuse an engine that breaks a promise.

    A proposal is a function of box, trials and seed alone: a new proposer says the same, whatever another was asked
    before; it lies in the box; points proposed together differ, pending ones being told; failed trials do not stop it;
    and the trials that it is told are left as they are.

    Args:
        engine: The engine.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    claim(isinstance(engine, Engine), f"engine {engine!r} is a {type(engine).__name__}; make it an Engine")
    what = f"engine '{engine.name}'"
    reason = why_not_engine(engine, composed=True)
    claim(not reason, f"{what} cannot be used: {reason}")
    for score in (_stepped, _at_a_corner, _half_failed):
        _check(engine, what, BOX, score)
    _check(engine, what, NARROW, _stepped)


def _check(engine: Engine, what: str, box: Space, score: Score) -> None:
    trials: list[Trial] = []
    for _ in range(BUDGET):
        values = _proposed(_made(engine, what), what, box, trials)
        trials.append(_trial(values, score(box, values)))
    used = _made(engine, what)
    for stop in (BUDGET - 1, INITIAL, BUDGET - 2):
        again = _proposed(used, what, box, trials[:stop])
        claim(again == trials[stop].values, f"{what} proposes otherwise when asked again; remember nothing")
    batch = ask(what, lambda: propose_batch(_made(engine, what), box, trials, SEED, BATCH))
    claim(len(set(batch)) == BATCH, f"{what} proposes {batch} together; points that are pending must not be repeated")
    for values in batch:
        _claim_inside(what, box, values)


def _made(engine: Engine, what: str) -> Proposer:
    return ask(what, lambda: make_proposer(engine, INITIAL, GOAL))


def _proposed(proposer: Proposer, what: str, box: Space, trials: Sequence[Trial]) -> Values:
    told = list(trials)
    values = ask(what, lambda: proposer.propose(box, told, SEED))
    claim(told == list(trials), f"{what} changes the trials that it is told; copy them first")
    _claim_inside(what, box, values)
    return values


def _claim_inside(what: str, box: Space, values: Values) -> None:
    sides = [f"{side.name} in [{side.low:g}, {side.high:g}]" for side in box.intervals]
    inside = len(values) == len(sides) and all(i.low <= v <= i.high for i, v in zip(box.intervals, values, strict=True))
    claim(inside, f"{what} proposes {values}; give one value for each of {', '.join(sides)}")


def _trial(values: Values, score: float | None) -> Trial:
    return Trial(values, score, None if score is None else (score,))
