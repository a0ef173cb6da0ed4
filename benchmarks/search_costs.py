"""What searching costs: `python -m pytest benchmarks/search_costs.py -o addopts= -s`. It prints, never fails."""

import resource
import statistics
import time
import tracemalloc

import numpy as np
import pytest
from compared_engines import engine_of
from problems import BOX, Analytic

from proxytune.domain import Outcome, make_episode
from proxytune.scores import Metric
from proxytune.search import Goal, Trial, learn_theta, make_proposer, to_unit
from proxytune.search.engine import design_point
from proxytune.seeds import episode_seed
from proxytune.storage import Store, TrialRecord
from proxytune.usefulness import prpv_of_means

COUNTS = (25, 100, 400)
REPEATS = 4
AGENTS_MODELLED, METRICS_MODELLED = 12, 7
TRIALS, AGENTS, STARTS = 200, 10, 10
METRICS = ("distance", "survival_time", "time_out_of_lane", "deviation")


def trials_of(objective, count):
    """Trials of a quasi-random design over the four parameters of θ, scored by the analytic stand-in."""
    points = [design_point(objective.space, number, 1) for number in range(count)]
    return [Trial(values, objective.score(values, 1)) for values in points]


def agents():
    """Twelve agents with seven metrics each, smooth in θ and a little rough; and the target, one θ of theirs."""
    generator, shape = np.random.default_rng(1), (AGENTS_MODELLED * METRICS_MODELLED, 4)
    slopes = generator.normal(0.0, 2.0, shape)

    def outputs(values, seed):
        return np.sin(slopes @ to_unit(BOX, values)) + np.random.default_rng(seed).normal(0.0, 0.05, shape[0])

    names = tuple((f"agent{row // METRICS_MODELLED}", f"metric{row % METRICS_MODELLED}") for row in range(shape[0]))
    target = outputs((0.03, 20.0, 0.1, 0.05), 0)
    compared = (Metric("distance"), Metric("survival_time"))

    def ranked(found):
        return found.reshape(*found.shape[:-1], AGENTS_MODELLED, METRICS_MODELLED)[..., : len(compared)]

    goal = Goal(names, target, np.full(shape[0], 0.005), lambda o: prpv_of_means(ranked(o), ranked(target), compared))
    return outputs, goal


def trials_with_outputs(count):
    outputs, goal = agents()
    points = [design_point(BOX, number, 1) for number in range(count)]
    told = [outputs(values, row + 1) for row, values in enumerate(points)]
    return [Trial(v, float(goal.compose(o)), tuple(o.tolist())) for v, o in zip(points, told, strict=True)]


@pytest.mark.parametrize("engine", ["outcomes", "composite", "gp", "skopt"])
@pytest.mark.parametrize("count", COUNTS)
def test_a_proposal_at_25_100_and_400_trials(engine, count, capsys):
    """Processor time, on one thread: the mean of four proposals, two of them draws where the engine takes turns."""
    proposer = make_proposer(engine_of(engine), 10, agents()[1])
    trials, seconds = trials_with_outputs(count + 1), []
    for seed in range(REPEATS):
        begun = time.process_time()
        proposer.propose(BOX, trials[: count + seed % 2], seed)
        seconds.append(time.process_time() - begun)
    with capsys.disabled():
        print(f"\n{engine}: processor time of a proposal at {count} trials {1000 * statistics.mean(seconds):.0f} ms")


@pytest.mark.parametrize("count", COUNTS)
def test_what_is_known_of_theta_at_25_100_and_400_trials(count, capsys):
    """Region, misfit, what PRPV cannot tell apart and who tells what: once, when a study is summed up."""
    trials, goal = trials_with_outputs(count), agents()[1]
    begun = time.process_time()
    found = learn_theta(BOX, trials, goal)
    share, fits, as_good = found.posterior.share, found.misfit.fits, found.as_good[0]
    seconds = time.process_time() - begun
    with capsys.disabled():
        print(f"\n{count} trials summed up in {seconds:.1f} s: region {share:.2g}, fits {fits}, as good {as_good:.2g}")


@pytest.mark.parametrize("engine", ["gp", "skopt"])
def test_memory_of_a_proposal_at_400_trials(engine, capsys):
    """The peak of what Python and numpy allocate; and of the whole process so far, its libraries included."""
    objective, proposer = Analytic(), make_proposer(engine_of(engine), 10)
    trials = trials_of(objective, COUNTS[-1])
    tracemalloc.start()
    proposer.propose(objective.space, trials, 1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    process = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    with capsys.disabled():
        print(
            f"\n{engine}: a proposal at 400 trials takes {peak / 2**20:.1f} MiB; the process {process:.0f} MiB at most"
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
            store.save_trial(identity, TrialRecord(number, theta, "finished", 20.0, {"prpv": 20.0, "ppv": 0.75}))
        seconds = time.perf_counter() - begun
        begun = time.perf_counter()
        known = store.outcomes(identity, theta)
        reading = time.perf_counter() - begun
    size = (tmp_path / "study.db").stat().st_size
    episodes = TRIALS * AGENTS * STARTS
    with capsys.disabled():
        print(f"\nstudy.db: {episodes} episodes in {size / 2**20:.2f} MiB, {size / episodes:.0f} bytes each;", end=" ")
        print(f"{1e6 * seconds / episodes:.0f} µs to write one, {1000 * reading:.1f} ms to read a trial's {len(known)}")
