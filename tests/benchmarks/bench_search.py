"""What searching costs: `python -m pytest tests/benchmarks/bench_search.py -o addopts= -s`. It prints, never fails."""

import resource
import statistics
import time
import tracemalloc

import numpy as np
import pytest

from proxytune.domain import make_episode
from proxytune.search.analytic import Analytic
from proxytune.search.design import design_point
from proxytune.search.engines import make_proposer
from proxytune.search.proposer import Trial
from proxytune.study.evaluate import episode_seed
from proxytune.study.store import Outcome, Store, TrialRecord

COUNTS = (25, 100, 200)
REPEATS = 5
TRIALS, AGENTS, STARTS = 200, 10, 10
METRICS = ("distance", "survival_time", "time_out_of_lane", "deviation")


def trials_of(objective, count):
    """Trials of a quasi-random design over the four parameters of θ, scored by the analytic stand-in."""
    points = [design_point(objective.space, number, 1) for number in range(count)]
    return [Trial(values, objective.score(values, 1)) for values in points]


@pytest.mark.parametrize("engine", ["gp", "skopt"])
def test_a_proposal_at_25_100_and_200_trials(engine, capsys):
    """Processor time, on one thread; the middle one of five proposals with different seeds."""
    objective, proposer, line = Analytic(), make_proposer(engine, 10), []
    for count in COUNTS:
        trials, seconds = trials_of(objective, count), []
        for seed in range(REPEATS):
            begun = time.process_time()
            proposer.propose(objective.space, trials, seed)
            seconds.append(time.process_time() - begun)
        line.append(f"{count} trials {1000 * statistics.median(seconds):.0f} ms")
    with capsys.disabled():
        print(f"\n{engine}: processor time of a proposal at {', '.join(line)}")


@pytest.mark.parametrize("engine", ["gp", "skopt"])
def test_memory_of_a_proposal_at_200_trials(engine, capsys):
    """The peak of what Python and numpy allocate; and of the whole process so far, its libraries included."""
    objective, proposer = Analytic(), make_proposer(engine, 10)
    trials = trials_of(objective, COUNTS[-1])
    tracemalloc.start()
    proposer.propose(objective.space, trials, 1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    process = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    with capsys.disabled():
        print(
            f"\n{engine}: a proposal at 200 trials takes {peak / 2**20:.1f} MiB; the process {process:.0f} MiB at most"
        )


def test_study_db_of_200_trials_of_100_episodes(tmp_path, capsys):
    """Ten agents from ten starts, four metrics, θ of four parameters, every digit kept; no wait for a disk."""
    objective, random = Analytic(), np.random.default_rng(1)
    identity = "0123456789abcdef" * 4
    begun = time.perf_counter()
    with Store.open(tmp_path) as store:
        for number in range(1, TRIALS + 1):
            theta = objective.space.theta(design_point(objective.space, number, 1))
            for row in range(AGENTS * STARTS):
                agent, start = f"some_agent_{row // STARTS}", row % STARTS
                episode = make_episode(theta, agent=agent, start=start, seed=episode_seed(1, start))
                scores = dict(zip(METRICS, random.uniform(0.0, 60.0, len(METRICS)).tolist(), strict=True))
                store.save_outcome(identity, Outcome(episode, scores, "", float(random.uniform(1.0, 2.0))))
            store.save_trial(identity, TrialRecord(number, theta, "finished", 20.0, 0.75))
        seconds = time.perf_counter() - begun
        begun = time.perf_counter()
        known = store.outcomes(identity, theta)
        reading = time.perf_counter() - begun
    size = (tmp_path / "study.db").stat().st_size
    episodes = TRIALS * AGENTS * STARTS
    with capsys.disabled():
        print(f"\nstudy.db: {episodes} episodes in {size / 2**20:.2f} MiB, {size / episodes:.0f} bytes each;", end=" ")
        print(f"{1e6 * seconds / episodes:.0f} µs to write one, {1000 * reading:.1f} ms to read a trial's {len(known)}")
