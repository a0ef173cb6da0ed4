"""What a cluster brings, measured with workers of this machine, and planned for more of them.

    python benchmarks/cluster_speed.py [--study STUDY] [--workers 1,2,4] [--episodes 48]

prints what fleets of several sizes take, episodes a second at each number of workers, what the scheduler and this
process take for each fleet (pieces that do nothing), and a plan: a study's time with up to 100 workers at several
values of `batch`. The plan cuts episodes into fleets as a study does, of the times that were measured here, shares
these out one after the other to whichever worker is free, and adds the time of a proposal. All is held against one
worker that drives fleets of 48. Times are those of the processor, so that a busy machine changes little.
"""

import argparse
import heapq
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from distributed import LocalCluster

from proxytune.domain import DomainFamily, Episode, make_episode
from proxytune.running import Fleet, on_cluster, run_fleet, working
from proxytune.running.episodes import MOST, in_fleets
from proxytune.seeds import episode_seed
from proxytune.study import StudySettings, load_family, read_study_settings

STUDIES = Path(__file__).resolve().parents[1] / "studies"
NOTHING = 400
"""Pieces that do nothing, for the scheduler's cost."""
SIZES = (1, 2, 4, 8, 16, 32, 48)
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


def fleets_of(episodes: Sequence[Episode], workers: int, seconds: float) -> list[Fleet]:
    """Episodes as a study hands them out, where each takes so long [s]."""
    known = {(one.agent, one.start): seconds for one in episodes}
    return list(in_fleets(episodes, workers, lambda _: False, lambda _: False, known))


def fleet_times(family: DomainFamily, episodes: Sequence[Episode]) -> dict[int, float]:
    """Seconds of the processor that a fleet takes, by its size."""
    found = {}
    for size in SIZES:
        chosen = [episodes[number % len(episodes)] for number in np.linspace(0, len(episodes), size, False).astype(int)]
        began = time.process_time()
        run_fleet(family, chosen)
        found[size] = time.process_time() - began
    return found


def measured(family: DomainFamily, fleets: Sequence[Fleet], workers: int) -> tuple[float, float]:
    """Seconds that fleets take together, and that this process and its scheduler take for a piece that does nothing."""
    drive: Callable[[Fleet], Any] = partial(run_fleet, family)
    cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
    with cluster, on_cluster(cluster.scheduler_address):
        seconds_of(drive, [fleet[:1] for fleet in fleets], workers)
        seconds_of(nothing, range(2 * workers), workers)
        taken, began = seconds_of(drive, fleets, workers), time.process_time()
        seconds_of(nothing, range(NOTHING), workers)
        return taken, (time.process_time() - began) / NOTHING


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


def planned(times: Mapping[int, float], per_trial: int, workers: int, batch: int, each_s: float) -> float:
    """How long a study takes whose trials are proposed by the batch [s].

    Args:
        times: What a fleet takes, by its size [s].
        per_trial: Episodes of a trial.
        workers: How many drive them.
        batch: Trials that are proposed at once.
        each_s: As of makespan.
    """
    total = 0.0
    for first in range(0, TRIALS, batch):
        count = min(batch, TRIALS - first)
        episodes = [make_episode({}, agent="any", start=0, seed=number) for number in range(per_trial * count)]
        sizes = [len(fleet) for fleet in fleets_of(episodes, workers, times[MOST] / MOST)]
        taken = np.interp(sizes, list(times), list(times.values()))
        total += PROPOSAL_S * count + makespan(taken.tolist(), workers, each_s)
    return total


def print_plan(times: Mapping[int, float], per_trial: int, each_s: float) -> None:
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
    run_fleet(family, episodes[:1])
    times = fleet_times(family, episodes)
    print("seconds of a fleet: " + ", ".join(f"{size}: {seconds:.2f}" for size, seconds in times.items()))
    share, each_s = times[MOST] / MOST, 0.0
    alone = seconds_of(partial(run_fleet, family), fleets_of(episodes, 1, share), 1)
    print(f"{len(episodes)} episodes in this process: {alone:.1f} s, {len(episodes) / alone:.2f} a second")
    pair = seconds_of(partial(run_fleet, family), fleets_of(episodes, 2, share), 2)
    print(f"2 processes of this machine, without a cluster: {len(episodes) / pair:.2f} a second, their start included")
    for workers in map(int, arguments.workers.split(",")):
        busy, each_s = measured(family, fleets_of(episodes, workers, share), workers)
        print(f"{workers} workers: {len(episodes) / busy:.2f} episodes a second, {1e3 * each_s:.1f} ms for nothing")
    print_plan(times, len(settings.agents) * settings.starts, each_s)


if __name__ == "__main__":
    main()
