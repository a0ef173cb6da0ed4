"""Before a study: does each parameter move the metrics, does each agent do the same again, and how large is noise?

The domain instance in the centre of the box is the base. Each parameter is moved to either end of its box, the others
held, under the same seeds (common random numbers): a parameter that does nothing then changes no episode by a hair.
What noise does is told by driving the base again under other seeds, one for each agent and start. Per metric and end, a
one-sided Wilcoxon signed-rank test asks over agents and starts whether |change by the parameter| is larger than |change
by noise|; were the parameter one more source of noise, either would be the larger as often as the other. P-values are
multiplied by the number of tests (Bonferroni: metrics × ends × looks). A parameter that the first half of the starts
already shows to matter is left out of the second look. Where every episode fails alike there is nothing to search: the
study stops and says of what.

What a trial comes to must not depend on which process drove which episode before. So one episode of each agent is
driven twice more, by one process, one after the other (`check_repeatable`): an agent that draws from what no episode
seeds, or remembers earlier episodes, comes to other scores. The agents that proxytune brings are one fleet there.

`noise_of` says how far chance alone puts proxy and target apart at the same θ, which a search has to forgive. Both
sides drive from the same starts, so it is the placement noise that differs, not the starts. The base has been driven
under two placements, from which follows the variance of a difference of two episodes. Without shared starts, or without
a pre-flight, there is the spread between episodes only, which is far larger: starts differ more than placements.
"""

import functools
import itertools
import re
import warnings
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import NamedTuple

import numpy as np
from scipy.stats import wilcoxon

from proxytune.arrays import Floats
from proxytune.domain import DomainFamily, Episode, Outcome, make_episode
from proxytune.errors import RunError
from proxytune.running import Fleet, Rescue, run_fleet, working
from proxytune.seeds import preflight_noise_seed, preflight_seed
from proxytune.space import Interval, Theta
from proxytune.storage import Store
from proxytune.study.apart import centre_of, users_agents
from proxytune.study.opening import Study
from proxytune.study.settings import StudySettings
from proxytune.study.study_run import StudyRun, needed_metrics
from proxytune.usefulness import start_of

LEVEL = 0.05
"""Of all tests of one parameter together."""
LOOKS = 2
"""How often a parameter may be tested, each time on more starts."""


@dataclass(frozen=True)
class Movement:
    """The effect on the metrics of moving one parameter across its box."""

    interval: Interval  # the parameter and its box
    p_value: float  # how likely noise alone is to change a metric as much, corrected for all tests; the lowest of them
    metric: str  # the metric of that test
    change: float  # median over agents and starts of how much the parameter changes it
    noise: float  # median of how much noise does
    pairs: int  # over how many agents and starts; failed episodes are left out
    dead: bool  # whether no metric of any of their episodes changed at all

    @property
    def moves(self) -> bool:
        """True if the parameter changes a metric beyond noise."""
        return self.p_value < LEVEL

    @property
    def warning(self) -> str:
        """The problem of the parameter and what to do, in one line; empty if there is none."""
        if self.moves:
            return ""
        name, box = self.interval.name, f"[{self.interval.low:g}, {self.interval.high:g}]"
        if not self.pairs:
            return f"pre-flight: '{name}' cannot be tested: every agent fails somewhere in {box}; narrow its box"
        if self.dead:
            remedy = "remove it from [parameters], add agents that depend on it, or widen its box"
            return f"pre-flight: '{name}' changes nothing at all across {box}; {remedy}"
        remedy = "add agents that depend on it, starts or metrics, or widen its box"
        return f"pre-flight: '{name}' is not shown to change a metric across {box} by {self.pairs} pairs; {remedy}"


def judge(interval: Interval, names: Sequence[str], values: Floats) -> Movement:
    """Test a parameter by the metric and end that tell most; of (…, 4, metrics), the base again, it, and both ends."""

    def likely(changes: Floats, noise: Floats) -> float:
        """The p-value of the signed ranks of |change| − |noise|, were neither the larger."""
        apart = changes - noise
        # Left to itself scipy permutes where there are ties, which takes more than a second a test.
        return float(wilcoxon(apart, alternative="greater", method="approx").pvalue) if apart.any() else 1.0

    changes = np.abs(values[:, [0, 2, 3]] - values[:, [1]])
    tests = [(likely(changes[:, end, m], changes[:, 0, m]), end, m) for end in (1, 2) for m in range(len(names))]
    p_value, end, m = min(tests)
    middle = np.median(changes[:, [0, end], m], axis=0) if len(changes) else (0.0, 0.0)
    return Movement(
        interval=interval,
        p_value=min(1.0, p_value * len(tests) * LOOKS),
        metric=names[m],
        change=float(middle[1]),
        noise=float(middle[0]),
        pairs=len(changes),
        dead=not changes[:, 1:].any(),
    )


NOT_REPEATABLE = "not_repeatable"
"""The fact in study.db: a line for each agent that scores otherwise in the same episode, in their order."""
REMEDY = "draw from random or numpy.random, which each episode seeds, and keep nothing from one episode to the next"
Again = tuple[Episode, Mapping[str, float] | None]
"""An episode with its scores when it was driven once more; None where it failed."""


def check_repeatable(run: StudyRun, episodes: Sequence[Episode]) -> None:
    """Drive an episode of each agent twice more, once for each study, and keep which come to other scores."""
    if NOT_REPEATABLE in run.store.facts():
        return
    known = {one: outcome.metrics for one, outcome in run.known(episodes).items() if outcome.metrics is not None}
    run.watcher.begin("pre-flight: each agent twice", 0)
    users = users_agents(run.settings)
    shipped = tuple(one for one in known if one.agent not in users)
    fleets = [fleet for fleet in (*((one,) for one in known if one.agent in users), shipped) if fleet]
    needed = tuple(needed_metrics(run.settings, run.study.family))
    drive: Callable[[Fleet], list[Again]] = functools.partial(_drive_twice, run.study.family, needed)
    with run.watched() as watch:
        rescue: Rescue[Fleet, list[Again]] = watch.rescue(2.0, lambda fleet, _: [(one, None) for one in fleet])
        with working(drive, fleets, run.settings.jobs, rescue) as driven:
            others = {one.agent for again in driven for one, scores in again if scores != known[one]}
    told = [agent for agent in run.settings.agents if agent in others]
    lines = [f"pre-flight: agent '{agent}' scores otherwise in the same episode; {REMEDY}" for agent in told]
    run.store.save_fact(NOT_REPEATABLE, lines)


def not_repeatable(store: Store) -> tuple[str, ...]:
    """One line for each agent that came to other scores; none where that was not looked at."""
    return tuple(store.facts().get(NOT_REPEATABLE, ()))


def _drive_twice(family: DomainFamily, needed: Sequence[str], fleet: Fleet) -> list[Again]:
    both = run_fleet(family, fleet, needed) + run_fleet(family, fleet, needed)
    return [(outcome.episode, outcome.metrics) for outcome in both]


def check_some_work(outcomes: Collection[Outcome], where: str) -> None:
    """Refuse to go on if every episode, of whom `where` says, has failed of the same."""

    def kind(failed: Outcome) -> str:
        """The failure, whichever the agent and whatever the numbers."""
        return re.sub(r"\d+", "", failed.failure.replace(f"'{failed.episode.agent}'", ""))

    failures = [outcome for outcome in outcomes if outcome.metrics is None]
    if failures and len(failures) == len(outcomes) and len(set(map(kind, failures))) == 1:
        told = f"{failures[0].failure}; every agent fails so, in all {len(failures)} episodes of {where}"
        raise RunError(f"{told}: correct it and run the same command again")


PAIRS = 24
"""So many agents × places at least: with fewer, nothing short of a landslide would be beyond noise."""


class Place(NamedTuple):
    """The start that every agent drives from, and which time from there."""

    start: int
    turn: int


@dataclass(frozen=True)
class Preflight:
    """The knowledge of a study of its parameters before its first trial."""

    base: Theta  # the domain instance from which they were moved
    movements: tuple[Movement, ...]  # one per parameter, in the order of the box
    episodes: int  # how many episodes it took
    failure: str = ""  # why the first of them failed, where all of them did; else empty
    not_repeatable: tuple[str, ...] = ()  # a line for each agent that scores otherwise in the same episode

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

    Nothing of it enters a trial. A study whose trials have begun goes on without: None. An EpisodeError if an episode
    fails and the study is to stop then, a RunError if every episode fails alike.
    """
    if run.finished_trials():
        return None
    learnt = preflight_of(run, drive=True)
    if learnt is None or learnt.failure:
        return learnt
    first = _places(run.settings, 0)[0]
    check_repeatable(run, [_episode(run.settings, learnt.base, agent, first) for agent in run.settings.agents])
    return replace(learnt, not_repeatable=not_repeatable(run.store))


def preflight_of(run: StudyRun, *, drive: bool = False) -> Preflight | None:
    """The pre-flight from what has been simulated, or is now; None if it is off, or an episode is still missing."""
    settings = run.settings
    if not settings.preflight:
        return None
    movements: dict[str, Movement] = {}
    driven: dict[Episode, Outcome] = {}
    undecided = settings.space.intervals
    for look in range(LOOKS):
        before, now = (_plan(settings, _places(settings, n), undecided) for n in (look - 1, look))
        if drive:
            what, added = f"pre-flight {look + 1} of {LOOKS}", now[len(before) :]
            run.watcher.begin(what, _most(settings, look) - len(added))
            outcomes = run.outcomes(added, what)
            run.watcher.finished(what)
            if look == 0:
                check_some_work(outcomes.values(), "the pre-flight")
        known = run.known(now)
        if len(known) < len(now):
            return None
        driven |= known
        movements |= {i.name: _movement(run.study, look, i, known) for i in undecided}
        undecided = tuple(i for i in undecided if not movements[i.name].moves)
    moved = tuple(movements[name] for name in settings.space.names)
    failures = [outcome.failure for outcome in driven.values() if outcome.metrics is None]
    failure = failures[0] if failures and len(failures) == len(driven) else ""
    return Preflight(centre_of(settings), moved, len(driven), failure, not_repeatable(run.store))


def placement_pairs(run: StudyRun) -> Floats:
    """The base of the pre-flight under its own and another placement: (places, 2, agents, metrics), as the target's.

    NaN where an episode failed or was not driven; no places where there is no pre-flight.
    """
    study, settings, names = run.study, run.settings, run.study.target.metrics
    known = run.store.outcomes(study.identity, centre_of(settings)) if settings.preflight else {}
    found = np.full((len(_places(settings, LOOKS - 1)), 2, *study.target.means.shape), np.nan)
    for row, place in enumerate(_places(settings, LOOKS - 1)):
        for column, agent in enumerate(settings.agents):
            again, base = _group(settings, agent, place, ())
            for side, episode in enumerate((base, again)):
                metrics = known[episode].metrics if episode in known else None
                if metrics is not None:
                    found[row, side, column] = [metrics.get(name, np.nan) for name in names]
    return found[~np.isnan(found).all(axis=(1, 2, 3))]


def most_preflight_episodes(settings: StudySettings) -> int:
    """The number of episodes that a pre-flight takes at most."""
    return sum(_most(settings, look) for look in range(LOOKS)) if settings.preflight else 0


def _most(settings: StudySettings, look: int) -> int:
    """The number of episodes that a look takes and the one before did not, if no parameter is decided."""
    instances = 2 + 2 * len(settings.space.intervals)
    return (len(_places(settings, look)) - len(_places(settings, look - 1))) * len(settings.agents) * instances


def _places(settings: StudySettings, look: int) -> list[Place]:
    """The places that agents drive from up to this look: the study's starts in turn, until there are pairs enough."""
    half = max(1, ceil(PAIRS / LOOKS / len(settings.agents)))
    return [Place(k % settings.starts, k // settings.starts) for k in range(half * (look + 1))]


def _plan(settings: StudySettings, places: Sequence[Place], undecided: Sequence[Interval]) -> list[Episode]:
    """Place by place, and agent by agent, the groups of the undecided parameters; nothing if there are none."""
    pairs = itertools.product(places if undecided else (), settings.agents)
    return [episode for place, agent in pairs for episode in _group(settings, agent, place, undecided)]


def _group(settings: StudySettings, agent: str, place: Place, moved: Sequence[Interval]) -> list[Episode]:
    """The base with a new seed, to measure the noise, the base, and each parameter that is moved at its two ends."""
    base = centre_of(settings)
    # The agent's own: agents that shared it would share one draw of the noise.
    seed = preflight_noise_seed(settings.seed, *place, sorted(settings.agents).index(agent))
    again = make_episode(base, agent=agent, start=place.start, seed=seed)
    instances = [base, *({**base, i.name: end} for i in moved for end in (i.low, i.high))]
    return [again, *(_episode(settings, one, agent, place) for one in instances)]


def _episode(settings: StudySettings, theta: Theta, agent: str, place: Place) -> Episode:
    return make_episode(theta, agent=agent, start=place.start, seed=preflight_seed(settings.seed, *place))


def _movement(study: Study, look: int, interval: Interval, known: Mapping[Episode, Outcome]) -> Movement:
    settings = study.settings
    pairs = itertools.product(_places(settings, look), settings.agents)
    driven = [[known[one] for one in _group(settings, agent, place, [interval])] for place, agent in pairs]
    whole = [group for group in driven if all(outcome.metrics is not None for outcome in group)]
    names = settings.metric_names
    values = np.array([[[(o.metrics or {})[name] for name in names] for o in group] for group in whole])
    return judge(interval, names, values.reshape(-1, 4, len(names)))


PRIOR_PAIRS = 2
"""An agent's own pairs are few, so the median over the agents counts as so many more."""
PLACEMENT = "placement"
"""The fact with the variance that a bank's table knows, by agent and metric; of a run bank, its pre-flight tells."""
UNKNOWN_NOISE = 0.1
"""Where nothing tells: standard deviation of a mean, as a share of the spread over agents."""


@dataclass(frozen=True, eq=False)
class NoiseVariance:
    """Variance of the difference of proxy's and target's mean scores at the same θ (agents, metrics)."""

    variance: Floats
    caution: str = ""  # what is lost; empty where both have the same starts and a pre-flight told what placement does


def noise_of(run: StudyRun) -> NoiseVariance:
    """Estimate noise before the first trial; a function of the pre-flight and the target's table."""
    study = run.study
    driven = study.settings.starts
    measured = np.maximum(1, study.target.counts)[:, None]
    placed = placement_variance(run)
    if shares_starts(study) and placed is not None:
        return NoiseVariance(placed * (1.0 / driven + 1.0 / measured))
    remedy = "to know θ better, measure the target from the study's own starts and leave the pre-flight on"
    if set(map(start_of, study.target.episodes)) == {str(start) for start in range(1, driven + 1)}:
        remedy += f"; if its episodes 1 to {driven} are these starts, number them 0 to {driven - 1}"
    if study.target.counts.min() >= 2:
        values = study.target.values
        count = np.sum(~np.isnan(values), axis=1, keepdims=True)
        # Squared distances of an agent's episodes from its mean, scaled so that their mean is the variance
        apart = np.asarray((values - np.nanmean(values, axis=1, keepdims=True)) ** 2 * (count / (count - 1)))
        between = _shrunk(np.moveaxis(apart, 1, 0))
        caution = f"noise is estimated from the spread between the target's episodes, which is too large; {remedy}"
        return NoiseVariance(between * (1.0 / driven + 1.0 / measured), caution)
    spread = np.ptp(study.target.means, axis=0) * UNKNOWN_NOISE
    caution = f"noise is unknown and assumed to be {UNKNOWN_NOISE:.0%} of the spread between agents; {remedy}"
    return NoiseVariance(np.broadcast_to(spread**2, study.target.means.shape), caution)


def placement_variance(run: StudyRun) -> Floats | None:
    """Variance of metrics by placement alone (agents, metrics), by pre-flight or a bank's table; None without."""
    pairs, table = placement_pairs(run), run.study.target
    if pairs.size:
        return _shrunk((pairs[:, 0] - pairs[:, 1]) ** 2) / 2.0
    known = run.store.facts().get(PLACEMENT, {})
    found = np.array([[known.get(agent, {}).get(name, np.nan) for name in table.metrics] for agent in table.agents])
    return None if np.isnan(found).any() else found


def shares_starts(study: Study) -> bool:
    """True if the target was driven from the study's own starts, each as often, by every agent."""
    each = Counter(map(start_of, study.target.episodes))
    wanted = {str(start) for start in range(study.settings.starts)}
    return study.target.complete and set(each) == wanted and len(set(each.values())) == 1


def _shrunk(squares: Floats) -> Floats:
    """Mean squares (agents, metrics), drawn to their median: few pairs tell little of an agent."""
    counts = np.sum(~np.isnan(squares), axis=0)
    sums = np.nansum(squares, axis=0)
    with warnings.catch_warnings():
        # Of a metric that no pair has, nothing is known.
        warnings.simplefilter("ignore", RuntimeWarning)
        middle = np.nanmedian(np.where(counts > 0, sums / np.maximum(1, counts), np.nan), axis=0)
    return np.asarray((sums + PRIOR_PAIRS * middle) / (counts + PRIOR_PAIRS))
