import itertools
import os
import threading

import pytest
from threadpoolctl import threadpool_info, threadpool_limits
from wobbly import Wobbly

from proxytune.domain import make_episode
from proxytune.errors import EpisodeError, RunError
from proxytune.running import run_episode, running

EPISODES = [make_episode({"trim": 0.1}, agent=f"agent{a}", start=s, seed=s) for a in range(3) for s in range(3)]


def run_all(family, jobs, episodes=EPISODES):
    with running(family, episodes, jobs) as outcomes:
        return {one.episode: (one.metrics, one.failure) for one in itertools.chain.from_iterable(outcomes)}


def test_two_processes_find_what_one_finds_and_none_is_fine():
    faulty = Wobbly(faults=("agent1:2:raises",))
    assert run_all(faulty, 2) == run_all(faulty, 1)
    assert set(run_all(faulty, 1)) == set(EPISODES)
    assert run_all(Wobbly(), 2, []) == {}


def test_one_job_stays_in_this_process_two_do_not_and_leaving_early_drops_what_has_not_begun(tmp_path):
    journals = {jobs: tmp_path / f"journal{jobs}" for jobs in (1, 2)}
    for jobs, journal in journals.items():
        run_all(Wobbly(journal=str(journal), sleep=0.02), jobs)
    pids = {jobs: {int(line.split()[-1]) for line in path.read_text().splitlines()} for jobs, path in journals.items()}
    assert pids[1] == {os.getpid()}
    assert os.getpid() not in pids[2]
    assert len(pids[2]) == 2
    journal = tmp_path / "journal"
    for jobs in (1, 2):
        journal.unlink(missing_ok=True)
        episodes = [make_episode({}, agent="agent0", start=0, seed=seed) for seed in range(400)]
        with running(Wobbly(journal=str(journal), sleep=0.05), episodes, jobs) as outcomes:
            next(outcomes)
        assert len(journal.read_text().splitlines()) < 200


def test_each_episode_runs_on_one_thread():
    class Counting(Wobbly):
        def run(self, episode):
            counts.extend(pool["num_threads"] for pool in threadpool_info())
            return super().run(episode)

    counts = []
    with threadpool_limits(limits=2):
        run_episode(Counting(), EPISODES[0])
    assert set(counts) == {1}


FAULTS = {
    "raises": "agent 'agent0' raised ValueError at 1.20 s: it lost its way",
    "crashes": "the domain family raised ZeroDivisionError: division by zero (wobbly.py, line 87)",
    "nan": "agent 'agent0': the domain family gave no finite 'distance'",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_an_agent_or_the_domain_does_wrong_is_the_episode_s_outcome(fault):
    outcome = run_episode(Wobbly(faults=(f"agent0:0:{fault}",)), EPISODES[0])
    assert outcome.metrics is None
    assert outcome.failure == FAULTS[fault]


class Strange(Wobbly):
    def run(self, episode):
        return {"distance": 1.0} if episode.start else None


@pytest.mark.parametrize(("start", "expected"), [(1, "gave no finite 'survival_time'"), (0, "by name, got NoneType")])
def test_a_family_that_answers_something_else_fails_the_episode(start, expected):
    assert expected in run_episode(Strange(), EPISODES[start]).failure


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_full_disk_is_no_episode_s_doing(jobs):
    with pytest.raises(RunError, match=r"agent 'agent1' from start 1: the machine failed \(OSError: .*No space left"):
        run_all(Wobbly(faults=("agent1:1:full",)), jobs)


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_whether_an_episode_is_left_out_is_asked_when_it_is_about_to_begin(jobs, tmp_path):
    journal = tmp_path / "journal"
    journal.touch()

    def left_out(episode):
        return episode.agent == "agent1" or len(journal.read_text().splitlines()) >= 3

    with running(Wobbly(journal=str(journal)), EPISODES * 5, jobs, left_out) as outcomes:
        given = [outcome.episode for (outcome,) in outcomes]
    assert "agent1" not in {episode.agent for episode in given}
    assert 3 <= len(given) <= 3 + 2 * jobs


@pytest.mark.parametrize("value", [float("nan"), None, "far", float("inf")])
def test_a_metric_that_is_not_needed_may_be_missing_or_no_number(value):
    class Partly(Wobbly):
        def run(self, episode):
            return {**super().run(episode), "distance": value}

    outcome = run_episode(Partly(), EPISODES[0], needed=["survival_time"])
    assert outcome.metrics is not None
    assert list(outcome.metrics) == ["survival_time"]
    for needed in (["distance"], []):
        assert "gave no finite 'distance'" in run_episode(Partly(), EPISODES[0], needed).failure


class Unloadable(Wobbly):
    def __setstate__(self, state):
        raise ModuleNotFoundError("No module named 'my_simulator'")


def test_a_family_that_no_module_has_goes_to_other_processes_and_one_that_cannot_is_one_line():
    class Held(Wobbly):
        held = threading.Lock()

    with pytest.raises(RunError, match=r"cannot be sent to other processes \(.*lock.*or set jobs = 1"):
        run_all(Held(), 2)
    assert len(run_all(Held(), 1)) == len(EPISODES)
    with pytest.raises(RunError, match=r"another process cannot load .*No module named 'my_simulator' \(test_ep"):
        run_all(Unloadable(), 2)

    class Local(Wobbly):
        pass

    assert run_all(Local(), 2) == run_all(Wobbly(), 1)


def test_where_an_agent_s_exception_arose_is_told_with_the_failure():
    class Wrapped(Wobbly):
        def run(self, episode):
            try:
                return {}["mass"]
            except KeyError as problem:
                raise EpisodeError("agent 'agent0' raised KeyError at 1.20 s: 'mass'") from problem

    assert run_episode(Wrapped(), EPISODES[0]).failure.startswith(
        "agent 'agent0' raised KeyError at 1.20 s: 'mass' (test_episodes.py, line "
    )
