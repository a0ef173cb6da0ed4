"""Before a study: does each parameter of its box move the metrics beyond noise?

The domain instance in the centre of the box is the base. Each parameter is moved to either end of its box, the others
held, under the same seeds (common random numbers): a parameter that does nothing then changes no episode by a hair.
What noise does is told by driving the base again under other seeds, one for each agent and start. Per metric and end, a
one-sided Wilcoxon signed-rank test asks over agents and starts whether |change by the parameter| is larger than |change
by noise|; were the parameter one more source of noise, either would be the larger as often as the other. P-values are
multiplied by the number of tests (Bonferroni: metrics × ends × looks). A parameter that the first half of the starts
already shows to matter is left out of the second look.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.domain import Episode, Outcome, make_episode
from proxytune.seeds import preflight_noise_seed, preflight_seed
from proxytune.space import Interval, Theta
from proxytune.study.settings import StudySettings
from proxytune.study.stages.failing import check_some_work
from proxytune.study.stages.movement import LOOKS, Movement, judge
from proxytune.study.stages.repeatable import check_repeatable, not_repeatable
from proxytune.study.study import Study
from proxytune.study.study_run import StudyRun

PAIRS = 24
"""So many agents × places at least: with fewer, nothing short of a landslide would be beyond noise."""

Array = NDArray[np.float64]


class Place(NamedTuple):
    """Where every agent drives from: the start, and which time from there."""

    start: int
    turn: int


@dataclass(frozen=True)
class Preflight:
    """What a study has learnt of its parameters before its first trial.

    Attributes:
        base: The domain instance from which they were moved.
        movements: One per parameter, in the order of the box.
        episodes: How many episodes it took.
        failure: Why the first of them failed, where all of them did; else empty.
        not_repeatable: One line for each agent that scores otherwise when it drives the same episode again.
    """

    base: Theta
    movements: tuple[Movement, ...]
    episodes: int
    failure: str = ""
    not_repeatable: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """One line for each agent that is not repeatable, and for each parameter that does nothing beyond noise.

        A single one if every episode failed.
        """
        if self.failure:
            return (f"pre-flight: every agent fails everywhere, first with: {self.failure}; correct it",)
        return self.not_repeatable + tuple(one.warning for one in self.movements if not one.moves)


def run_preflight(run: StudyRun) -> Preflight | None:
    """The pre-flight of a study that has no finished trial yet; what is missing of it is simulated now.

    Nothing of it enters a trial. A study whose trials have begun goes on without: None.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
        RunError: If every episode fails alike.
    """
    if run.finished_trials():
        return None
    learnt = _preflight(run, partial(_simulate, run))
    if learnt is None or learnt.failure:
        return learnt
    first = _places(run.settings, 0)[0]
    check_repeatable(run, [_episode(run.settings, learnt.base, agent, first) for agent in run.settings.agents])
    return replace(learnt, not_repeatable=not_repeatable(run.store))


def preflight_of(run: StudyRun) -> Preflight | None:
    """The pre-flight from what has been simulated; None if it is off, or an episode is still missing."""
    return _preflight(run, lambda look, added: None)


def _simulate(run: StudyRun, look: int, added: Sequence[Episode]) -> None:
    what = f"pre-flight {look + 1} of {LOOKS}"
    run.watcher.begin(what, _most(run.settings, look) - len(added))
    outcomes = run.outcomes(added, what)
    run.watcher.finished(what)
    if look == 0:
        check_some_work(outcomes.values(), "the pre-flight")


def _preflight(run: StudyRun, simulate: Callable[[int, Sequence[Episode]], None]) -> Preflight | None:
    settings = run.settings
    if not settings.preflight:
        return None
    movements: dict[str, Movement] = {}
    driven: dict[Episode, Outcome] = {}
    undecided = settings.space.intervals
    for look in range(LOOKS):
        before, now = (_plan(settings, _places(settings, n), undecided) for n in (look - 1, look))
        simulate(look, now[len(before) :])
        known = run.known(now)
        if len(known) < len(now):
            return None
        driven |= known
        movements |= {i.name: _movement(run.study, look, i, known) for i in undecided}
        undecided = tuple(i for i in undecided if not movements[i.name].moves)
    moved = tuple(movements[name] for name in settings.space.names)
    return Preflight(_base(settings), moved, len(driven), _failure(driven), not_repeatable(run.store))


def _failure(driven: Mapping[Episode, Outcome]) -> str:
    """What the first episode failed of, if none succeeded."""
    failures = [outcome.failure for outcome in driven.values() if outcome.metrics is None]
    return failures[0] if failures and len(failures) == len(driven) else ""


def placement_pairs(run: StudyRun) -> Array:
    """The base of the pre-flight under its own and another placement.

    Returns:
        Shape (places, 2, agents, metrics), in the order of the target's table; NaN where an episode failed or was not
        driven; no places where there is no pre-flight.
    """
    study, settings, names = run.study, run.settings, run.study.target.metrics
    known = run.store.outcomes(study.identity, _base(settings)) if settings.preflight else {}
    found = np.full((len(_places(settings, LOOKS - 1)), 2, *study.target.means.shape), np.nan)
    for row, place in enumerate(_places(settings, LOOKS - 1)):
        for column, agent in enumerate(settings.agents):
            both = (_episode(settings, _base(settings), agent, place), _again(settings, agent, place))
            for side, episode in enumerate(both):
                metrics = known[episode].metrics if episode in known else None
                if metrics is not None:
                    found[row, side, column] = [metrics.get(name, np.nan) for name in names]
    return found[~np.isnan(found).all(axis=(1, 2, 3))]


def most_episodes(settings: StudySettings) -> int:
    """How many episodes a pre-flight takes at most."""
    return sum(_most(settings, look) for look in range(LOOKS)) if settings.preflight else 0


def _most(settings: StudySettings, look: int) -> int:
    """How many episodes a look takes that the one before did not, if no parameter is decided."""
    instances = 2 + 2 * len(settings.space.intervals)
    return (len(_places(settings, look)) - len(_places(settings, look - 1))) * len(settings.agents) * instances


def _places(settings: StudySettings, look: int) -> list[Place]:
    """Where agents drive from up to this look: the study's starts in turn, until there are pairs enough."""
    half = max(1, ceil(PAIRS / LOOKS / len(settings.agents)))
    return [Place(k % settings.starts, k // settings.starts) for k in range(half * (look + 1))]


def _base(settings: StudySettings) -> dict[str, float]:
    return {i.name: 0.5 * (i.low + i.high) for i in settings.space.intervals}


def _plan(settings: StudySettings, places: Sequence[Place], undecided: Sequence[Interval]) -> list[Episode]:
    """Place by place: the base, the base under another seed, the ends of the undecided; nothing if there are none."""
    if not undecided:
        return []
    base = _base(settings)
    instances = [base, *({**base, i.name: end} for i in undecided for end in (i.low, i.high))]
    return [
        episode
        for place in places
        for agent in settings.agents
        for episode in (
            _again(settings, agent, place),
            *(_episode(settings, theta, agent, place) for theta in instances),
        )
    ]


def _episode(settings: StudySettings, theta: Theta, agent: str, place: Place) -> Episode:
    return make_episode(theta, agent=agent, start=place.start, seed=preflight_seed(settings.seed, *place))


def _again(settings: StudySettings, agent: str, place: Place) -> Episode:
    """The base under a seed of its own: agents that shared it would share one draw of the noise."""
    seed = preflight_noise_seed(settings.seed, *place, sorted(settings.agents).index(agent))
    return make_episode(_base(settings), agent=agent, start=place.start, seed=seed)


def _movement(study: Study, look: int, interval: Interval, known: Mapping[Episode, Outcome]) -> Movement:
    """Test one parameter on what is known at this look."""
    settings = study.settings
    base = _base(settings)
    instances = [base, *({**base, interval.name: end} for end in (interval.low, interval.high))]
    driven = [
        [known[_again(settings, agent, place)], *(known[_episode(settings, t, agent, place)] for t in instances)]
        for place in _places(settings, look)
        for agent in settings.agents
    ]
    whole = [group for group in driven if all(outcome.metrics is not None for outcome in group)]
    names = [metric.name for metric in settings.metrics]
    values = np.array([[[(o.metrics or {})[name] for name in names] for o in group] for group in whole])
    return judge(interval, names, values.reshape(-1, 4, len(names)))
