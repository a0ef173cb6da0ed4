"""Before a study: does an agent do the same again?

What a trial comes to must not depend on which process drove which episode before. So one episode of each agent is
driven twice more, by one process, one after the other: an agent that draws from what no episode seeds, or remembers
earlier episodes, comes to other scores.
"""

import functools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from proxytune.domain import DomainFamily, Episode
from proxytune.running.apart import Lost
from proxytune.running.episodes import run_episode
from proxytune.running.workers import Rescue, working
from proxytune.storage.store import Store
from proxytune.study.evaluation import needed_metrics
from proxytune.study.study_run import StudyRun

FACT = "not_repeatable"
"""What study.db keeps of it: a line for each such agent, in their order."""
REMEDY = "draw from random or numpy.random, which each episode seeds, and keep nothing from one episode to the next"
Scores = Mapping[str, float] | None


class Twice(NamedTuple):
    """What an episode came to when it was driven twice more; None where it failed."""

    episode: Episode
    scores: tuple[Scores, ...]


def check_repeatable(run: StudyRun, episodes: Sequence[Episode]) -> None:
    """Drive episodes twice more, and keep which agents come to other scores; once for each study.

    Args:
        run: The study.
        episodes: One of each agent, driven once; those that failed can tell nothing.

    Raises:
        RunError: If the machine fails.
    """
    if FACT in run.store.facts():
        return
    known = {one: outcome.metrics for one, outcome in run.known(episodes).items() if outcome.metrics is not None}
    run.watcher.begin("pre-flight: each agent twice", 0)
    drive = functools.partial(_drive_twice, run.study.family, tuple(needed_metrics(run.settings, run.study.family)))
    with run.watched() as watch:
        timeout_s = watch.timeout_s and 2.0 * watch.timeout_s
        rescue = Rescue(_lost, timeout_s, watch.suspect, watch.begins)
        with working(drive, list(known), run.settings.jobs, rescue=rescue) as driven:
            others = {one.episode.agent for one in driven if any(scores != known[one.episode] for scores in one.scores)}
    told = [agent for agent in run.settings.agents if agent in others]
    run.store.save_fact(
        FACT, [f"pre-flight: agent '{agent}' scores otherwise in the same episode; {REMEDY}" for agent in told]
    )


def not_repeatable(store: Store) -> tuple[str, ...]:
    """One line for each agent that came to other scores; none where that was not looked at."""
    return tuple(store.facts().get(FACT, ()))


def _drive_twice(family: DomainFamily, needed: Sequence[str], episode: Episode) -> Twice:
    return Twice(episode, tuple(run_episode(family, episode, needed).metrics for _ in range(2)))


def _lost(episode: Episode, lost: Lost) -> Twice:
    return Twice(episode, (None,))
