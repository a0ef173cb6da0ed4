"""Running episodes in fleets: cut to keep every process busy, told of where they take long, and named where they end.

A fleet is what a process is given. It is small enough that a kill loses little and that no time limit is near
(`in_fleets`). One that ends its process or overruns is run again episode by episode, each by itself in a process that
it may end. How episodes are put together never changes what they come to.
"""

import functools
import math
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from proxytune.domain import DomainFamily, Episode, Outcome
from proxytune.errors import RunError
from proxytune.running.fleets import RAISED, Fleet, can_run_together, run_fleet
from proxytune.running.workers import Rescue, Result, WorkerExit, places, working

ENDED, ENDLESS = "it ended its process", "it took longer than"
"""How failures begin of episodes that end their process, and of those that do not end themselves."""
LONG_S = 60.0
"""A fleet that has been under way for so long is told of [s]: nothing else shows that an agent hangs."""
MONITOR = "stall monitor"
MOST = 48
"""Episodes of a fleet: with more, an episode hardly gets cheaper, and each may need a world in memory."""
MOST_S = 30.0
"""A kill loses at most so much of a process's work [s], unless a single episode takes longer."""
MARGIN = 3.0
"""A fleet is expected to take at most this part of the time that one episode may take."""
UNKNOWN = 4
"""Episodes of a fleet while it is not known how long they take."""
Seconds = Mapping[tuple[str, int], float]
"""How long episodes of an agent from a start took before, each its share of a fleet [s]."""


@dataclass(frozen=True)
class Watch:
    """How episodes are watched that may end their process or never end, and what is known of them."""

    timeout_s: float | None = None  # how long an episode may take by itself [s] before it has failed
    # whether an episode is run in a process of its own at once, as an earlier process ended during its like
    suspect: Callable[[Episode], bool] = lambda _: False
    # told of the episodes that begin in this very process, which they may end
    begins: Callable[[Fleet], None] = lambda _: None
    # told again and again, where nothing limits it, which fleet has been under way longest, if that is long, and for
    # how long [s]; from another thread
    waits: Callable[[str, float], None] = lambda what, seconds: None
    alone: Collection[str] = ()  # agents that are not run beside others
    known: Seconds = field(default_factory=dict)  # how long episodes took before

    def rescue(self, times: float, lost: Callable[[Fleet, WorkerExit], Result]) -> Rescue[Fleet, Result]:
        """The rescue of fleets that are watched so too, and may take so many times as long as an episode."""
        limit_s = self.timeout_s and times * self.timeout_s
        return Rescue(lost, limit_s, lambda fleet: any(map(self.suspect, fleet)), self.begins)


UNWATCHED = Watch()


@contextmanager
def running(
    family: DomainFamily,
    episodes: Sequence[Episode],
    jobs: int,
    skip: Callable[[Episode], bool] = lambda _: False,
    needed: Collection[str] = (),
    watch: Watch = UNWATCHED,
) -> Iterator[Iterator[list[Outcome]]]:
    """Run episodes and give the outcomes of a fleet as soon as they are there, in no particular order; see `working`.

    An episode that ends two processes, the second one its own, has failed, and so has one that takes too long. Those
    that take longest come first; whether to `skip` one is asked when its fleet is about to begin. Only a
    `domain.FleetFamily` has fleets of more than one episode.

    Raises:
        RunError: If the machine fails rather than an episode: memory, disk or descriptors run out.
    """
    known, alone, ended = dict(watch.known), set(watch.alone), set[str]()

    def suspect(episode: Episode) -> bool:
        return episode.agent in ended or watch.suspect(episode)

    def apart(episode: Episode) -> bool:
        return not together or episode.agent in alone or suspect(episode)

    def noted(fleets: Iterable[list[Outcome]]) -> Iterator[list[Outcome]]:
        for outcomes in fleets:
            ended.update(one.episode.agent for one in outcomes if one.failure.startswith((ENDED, ENDLESS)))
            alone.update(one.episode.agent for one in outcomes if one.failure.startswith(RAISED))
            known.update({(one.episode.agent, one.episode.start): one.seconds for one in outcomes})
            yield outcomes

    together = can_run_together(family)
    most_s = min(MOST_S, watch.timeout_s / MARGIN) if watch.timeout_s else MOST_S
    fleets = in_fleets(episodes, places(jobs), apart, skip, known, most_s)
    work = functools.partial(run_fleet, family, needed=tuple(needed))
    rescue = Rescue[Fleet, list[Outcome]](
        lambda fleet, end: [_lost(watch, fleet[0], end)],
        watch.timeout_s,
        lambda fleet: any(map(suspect, fleet)),
        watch.begins,
        parts=lambda fleet: [(episode,) for episode in fleet],
    )
    waits = watch.waits if watch.timeout_s is None else UNWATCHED.waits
    with (
        StallMonitor(waits) as monitor,
        working(work, monitor.begun(fleets), min(jobs, len(episodes)), rescue) as outcomes,
    ):
        yield noted(monitor.until_there(outcomes))


def in_fleets(
    episodes: Sequence[Episode],
    jobs: int,
    apart: Callable[[Episode], bool],
    skip: Callable[[Episode], bool],
    known: Seconds,
    most_s: float = MOST_S,
) -> Iterator[Fleet]:
    """Cut episodes, the longest first, into fleets, each when a process asks for it, by what is known then.

    All processes have as much to do: episodes are dealt out to as many fleets as it takes, or to a multiple of `jobs`.
    As long as nothing is known of how long they take, fleets are small. One that is `apart` is a fleet of its own;
    whether to `skip` one is asked when its fleet is about to begin.
    """
    single = [one for one in episodes if apart(one)]
    left = [one for one in episodes if not apart(one)]
    while left:
        count = _count(left, jobs, known, most_s)
        now, left = (left, []) if count else (left[:UNKNOWN], left[UNKNOWN:])
        for number in range(count or 1):
            fleet = [one for one in now[number :: count or 1] if not skip(one)]
            single += [one for one in fleet if apart(one)]
            if beside := tuple(one for one in fleet if not apart(one)):
                yield beside
    yield from ((one,) for one in single if not skip(one))


def _count(episodes: Sequence[Episode], jobs: int, known: Seconds, most_s: float) -> int:
    """The number of fleets that episodes make; none while nothing is known of how long any takes."""
    if not known:
        return 0
    mean = sum(known.values()) / len(known)
    seconds = sum(known.get((one.agent, one.start), mean) for one in episodes)
    rounds = math.ceil(max(len(episodes) / MOST, seconds / most_s) / jobs)
    return min(len(episodes), jobs * rounds)


def _lost(watch: Watch, episode: Episode, end: WorkerExit) -> Outcome:
    """The outcome of an episode that has ended its process, or was ended."""
    where = f"agent '{episode.agent}' from start {episode.start}"
    if end.killed:
        remedy = "run again to continue, with more memory or without that agent"
        raise RunError(f"{where}: its process was killed twice ({end.how}; out of memory?); {remedy}")
    failure = f"{ENDED} twice ({end.how})" if end.how else f"{ENDLESS} {watch.timeout_s:g} s"
    return Outcome(episode, None, failure, end.seconds)


class StallMonitor:
    """Says again and again, from its own thread, which fleet has been under way longest, if for long; a context."""

    def __init__(self, tell: Callable[[str, float], None]) -> None:
        self._tell, self._begun, self._ended = tell, dict[Episode, float](), threading.Event()
        self._thread = threading.Thread(target=self._watch, name=MONITOR, daemon=True)

    def __enter__(self) -> "StallMonitor":
        self._thread.start()
        return self

    def __exit__(self, *problem: object) -> None:
        self._ended.set()
        self._thread.join()

    def begun(self, fleets: Iterable[Fleet]) -> Iterator[Fleet]:
        """The fleets, each under way from when it is asked for."""
        for fleet in fleets:
            self._begun |= dict.fromkeys(fleet, time.monotonic())
            yield fleet

    def until_there(self, fleets: Iterable[list[Outcome]]) -> Iterator[list[Outcome]]:
        """The outcomes, whose episodes are under way no more."""
        for outcomes in fleets:
            for outcome in outcomes:
                self._begun.pop(outcome.episode, None)
            yield outcomes

    def _watch(self) -> None:
        while not self._ended.wait(LONG_S / 10.0):
            # Those of one fleet have begun at one moment.
            begun = sorted(self._begun.copy().items(), key=lambda episode: episode[1])
            seconds = time.monotonic() - begun[0][1] if begun else 0.0
            if seconds >= LONG_S:
                fleet = [episode for episode, since in begun if since == begun[0][1]]
                agents = ", ".join(f"'{agent}'" for agent in dict.fromkeys(episode.agent for episode in fleet))
                alone = f"agent {agents} from start {fleet[0].start}"
                self._tell(alone if len(fleet) == 1 else f"a fleet of {len(fleet)} episodes (of {agents})", seconds)
