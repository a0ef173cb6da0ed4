"""Several tuned families, made up of tables, seconds and learning values."""

from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from proxytune.learning import LearningEstimate
from proxytune.scores import Metric, ScoreTable
from proxytune.study import ComparedFamilies, Lesson
from proxytune.usefulness import assess, donors_of, expect

METRICS = (Metric("distance"),)
AGENTS = [f"agent{number}" for number in range(8)]


def table(shift, noise=0.0, repetition=0):
    """Eight agents from six starts; a shift swaps the order of so many neighbours."""
    order = list(range(8))
    for place in range(0, 2 * shift, 2):
        order[place], order[place + 1] = order[place + 1], order[place]
    scores = {
        (agent, str(start)): {"distance": 10.0 * order[row] + noise * ((row * 7 + start * 3 + repetition) % 5)}
        for row, agent in enumerate(AGENTS)
        for start in range(6)
    }
    return ScoreTable.from_episodes(scores)


def family(name, shift=0, seconds=(1.0, 1.1, 0.9, 1.0), noise=0.1, fresh=True):
    """A tuned family whose agents are in the target's order but for so many pairs of neighbours."""
    target, tables = table(0, 0.1), [table(shift, noise, repetition) for repetition in range(3)]
    twice = [np.stack([one.values, other.values]) for one, other in combinations(tables, 2)]
    expected = expect(fresh=tables, target=target, metrics=METRICS, donors=donors_of(twice, 1)) if fresh else None
    assessment = assess(proxy=tables[0], target=target, metrics=METRICS).as_expected(expected) if fresh else None
    study = SimpleNamespace(target=target, settings=SimpleNamespace(home=Path("study") / "families" / name))
    known = {"fresh": assessment, "expected": expected, "episode_seconds": seconds}
    return SimpleNamespace(name=name, **known, result=SimpleNamespace(study=study))


def compared(*families, lessons=None):
    """These families of one study; lessons are of a study with [teaching]."""
    settings = SimpleNamespace(metrics=METRICS, teaching=lessons is not None, stop=SimpleNamespace(wall_time_s=60.0))
    return ComparedFamilies(settings, families, lessons or {})


def lesson(plv, more=None, needed=(100.0, 80.0, 120.0)):
    """What a family is worth as a teacher, known to 10 samples."""
    saved = LearningEstimate(plv, plv - 10.0, plv + 10.0)
    return Lesson({}, 1.0, LearningEstimate(*needed), saved, more and LearningEstimate(*more))
