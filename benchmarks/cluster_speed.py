"""What a cluster brings, measured with workers of this machine, and planned for more of them.

    python benchmarks/cluster_speed.py [--study STUDY] [--workers 1,2,4] [--episodes 48]

prints episodes a second at each number of workers, what the scheduler and this process cost per episode (pieces that do
nothing), and a plan: a study's time with up to 100 workers at several values of `batch`. The plan shares out episodes
of the times that were measured here, one after the other, to whichever worker is free, and adds the time of a proposal.
"""

import argparse
import heapq
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from distributed import LocalCluster

from proxytune.domain import DomainFamily, Episode, make_episode
from proxytune.running import on_cluster, run_episode, working
from proxytune.seeds import episode_seed
from proxytune.study import StudySettings, load_family, read_study_settings

STUDIES = Path(__file__).resolve().parents[1] / "studies"
NOTHING = 400
"""Pieces that do nothing, for the scheduler's cost."""
PLANNED = (1, 2, 4, 8, 16, 32, 64, 100)
BATCHES = (1, 2, 4, 8, 16)
TRIALS = 64
PROPOSAL_S = 0.1
"""A Gaussian process's proposal at some hundred trials."""


def nothing(piece: int) -> int:
    """Do nothing."""
    return piece


def episodes_of(settings: StudySettings, count: int) -> list[Episode]:
    """As many different episodes of a study's agents and starts, at no θ."""
    rounds = -(-count // (len(settings.agents) * settings.starts))
    every = [
        make_episode({}, agent=agent, start=start, seed=episode_seed(settings.seed + again, start))
        for again in range(rounds)
        for start in range(settings.starts)
        for agent in settings.agents
    ]
    return every[:count]


def measured(family: DomainFamily, episodes: Sequence[Episode], workers: int) -> tuple[float, float]:
    """Seconds that episodes take together, and that a piece costs which does nothing."""
    drive = partial(run_episode, family)
    cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
    with cluster, on_cluster(cluster.scheduler_address):
        seconds_of(drive, episodes[: 2 * workers], workers)
        seconds_of(nothing, range(2 * workers), workers)
        return seconds_of(drive, episodes, workers), seconds_of(nothing, range(NOTHING), workers) / NOTHING


def seconds_of(work: Callable[[Any], Any], pieces: Sequence[Any], workers: int) -> float:
    """How long pieces take, start to end."""
    began = time.perf_counter()
    with working(work, pieces, workers) as done:
        for _ in done:
            pass
    return time.perf_counter() - began


def makespan(times: Sequence[float], workers: int, each_s: float) -> float:
    """When the last of several pieces is done, handed out one by one to whoever is free [s].

    Args:
        times: What each takes [s].
        workers: How many do them.
        each_s: What handing one out costs, during which no other is handed out [s].
    """
    free = [0.0] * workers
    handed = 0.0
    for seconds in times:
        handed = max(handed + each_s, heapq.heappop(free))
        heapq.heappush(free, handed + seconds)
    return max(free)


def planned(times: Sequence[float], per_trial: int, workers: int, batch: int, each_s: float) -> float:
    """How long a study takes whose trials are proposed by the batch [s]."""
    random = np.random.default_rng(0)
    trials = [min(batch, TRIALS - first) for first in range(0, TRIALS, batch)]
    return sum(
        PROPOSAL_S * count + makespan(random.choice(times, per_trial * count), workers, each_s) for count in trials
    )


def print_plan(times: Sequence[float], per_trial: int, each_s: float) -> None:
    """The table of speed-ups, by workers and batch."""
    alone = planned(times, per_trial, 1, 1, 0.0)
    print(f"plan for {TRIALS} trials of {per_trial} episodes: {alone:.0f} s alone; times faster than that:")
    print("workers  " + "".join(f"batch {batch:<4}" for batch in BATCHES))
    for workers in PLANNED:
        faster = [alone / planned(times, per_trial, workers, batch, each_s) for batch in BATCHES]
        print(f"{workers:>7}  " + "".join(f"{factor:<10.1f}" for factor in faster))


def main() -> None:
    """Measure and plan."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--study", type=Path, default=STUDIES / "closing_the_loop")
    parser.add_argument("--workers", default="1,2,4")
    parser.add_argument("--episodes", type=int, default=48)
    arguments = parser.parse_args()
    settings = read_study_settings(arguments.study)
    family = load_family(settings, settings.proxy)
    episodes = episodes_of(settings, arguments.episodes)
    times = [run_episode(family, episode).seconds for episode in episodes]
    print(f"{len(episodes)} episodes in this process: {sum(times):.1f} s, {len(times) / sum(times):.2f} a second")
    pair = seconds_of(partial(run_episode, family), episodes, 2)
    print(f"2 processes of this machine, without a cluster: {len(episodes) / pair:.2f} a second, their start included")
    each_s = 0.0
    for workers in map(int, arguments.workers.split(",")):
        busy, each_s = measured(family, episodes, workers)
        print(f"{workers} workers: {len(episodes) / busy:.2f} episodes a second, {1e3 * each_s:.1f} ms for nothing")
    print_plan(times, len(settings.agents) * settings.starts, each_s)


if __name__ == "__main__":
    main()
