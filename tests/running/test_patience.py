"""An episode that has been under way for long is told of, with its agent and start."""

import threading

import pytest
from deadly import Deadly

from proxytune.domain import make_episode
from proxytune.running import Watch, patience, running

EPISODES = [make_episode({"trim": 0.1}, agent=f"agent{a}", start=s, seed=s) for a in range(2) for s in range(2)]
LONG_S = 0.1


def told_of(fault, jobs=1, **more):
    """What is said while these episodes run, of which all but one take no time."""
    said = []
    watch = Watch(waits=lambda *told: said.append(told), **more)
    with running(Deadly(faults=(fault,)), EPISODES, jobs, watch=watch) as outcomes:
        assert len(list(outcomes)) == len(EPISODES)
    return said


@pytest.fixture
def soon(monkeypatch):
    monkeypatch.setattr(patience, "LONG_S", LONG_S)


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_it_is_told_which_episode_has_been_under_way_for_long(soon, jobs):
    said = told_of("agent1:0:lingers", jobs)
    assert "agent 'agent1' from start 0" in [what for what, _ in said]
    assert all(seconds >= LONG_S for _, seconds in said)


@pytest.mark.slow
def test_where_every_episode_is_short_nothing_is_told():
    assert told_of("agent1:0:lingers") == []


@pytest.mark.slow
def test_where_a_limit_ends_them_nothing_is_told(soon):
    assert told_of("agent1:0:lingers", timeout_s=60.0) == []


def test_nobody_waits_any_longer_once_the_episodes_are_left(soon):
    said = []
    with pytest.raises(KeyboardInterrupt), running(Deadly(), EPISODES, 1, watch=Watch(waits=said.append)):
        raise KeyboardInterrupt
    assert patience.NAME not in [thread.name for thread in threading.enumerate()]
    assert said == []
