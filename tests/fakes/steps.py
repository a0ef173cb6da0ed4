"""A score with steps over a box of two parameters, and a search of it: what the tests of the search share."""

import numpy as np

from proxytune.search import Goal, Trial, why_not
from proxytune.space import Interval, Space

SPACE = Space((Interval("delay", 0.0, 0.3), Interval("trim", -0.3, 0.3)))


def steps(values):
    """An integer score with its lowest step around (0.1, 0.1), like PRPV's."""
    return float(np.floor(40 * (abs(values[0] - 0.1) + abs(values[1] - 0.1))))


def whole(outcomes):
    """The score of an outcome that is the score itself."""
    return outcomes[..., 0]


WHOLE = Goal((("agent", "score"),), np.zeros(1), np.zeros(1), whole)
"""An outcome that is the score itself; the target's is 0."""


def goal(compose, values, noise=0.0):
    """The target of so many outputs, each one metric of an agent of its own."""
    values = np.array(values, dtype=float)
    names = tuple((f"agent{number}", "metric") for number in range(len(values)))
    return Goal(names, values, np.full(len(values), noise), compose)


def search(proposer, budget, seed, score=steps):
    """The trials of an uninterrupted search."""
    trials = []
    for _ in range(budget):
        values = proposer.propose(SPACE, trials, seed)
        found = score(values)
        trials.append(Trial(values, found, None if found is None else (found,)))
    return trials


def lacking(engine):
    """Why an engine cannot be tried here, empty if it can."""
    return why_not(engine, composed=True)
