"""Fleets: episodes side by side come to what each comes to by itself, whatever one of them does."""

import itertools
from contextlib import nullcontext
from types import SimpleNamespace

import pytest
from convoy import Convoy

from proxytune.domain import make_episode
from proxytune.errors import RunError
from proxytune.running import Watch, run_episode, run_fleet, run_together, running
from proxytune.running.episodes import MARGIN, MOST, MOST_S, UNKNOWN, in_fleets

EPISODES = [make_episode({"trim": 0.1}, agent=f"agent{a}", start=s, seed=s) for a in range(4) for s in range(3)]
LAST = EPISODES[-1]
KNOWN = {(one.agent, one.start): 0.1 for one in EPISODES}


def told(outcomes):
    return {one.episode: one.metrics if one.metrics else one.failure for one in outcomes}


def by_itself(faults=()):
    return told(run_episode(Convoy(faults=faults), one) for one in EPISODES)


def run_all(faults=(), jobs=1, family=Convoy, **watch):
    with running(family(faults=faults), EPISODES, jobs, watch=Watch(**{"known": KNOWN, **watch})) as fleets:
        given = list(fleets)
    return told(itertools.chain.from_iterable(given)), sorted(map(len, given))


def but_last(found):
    return {episode: what for episode, what in found.items() if episode != LAST}


def test_a_fleet_comes_to_what_its_episodes_come_to_one_by_one_also_where_one_raises(tmp_path):
    whole = by_itself()
    assert told(run_fleet(Convoy(), EPISODES)) == whole
    assert told(run_fleet(Convoy(), EPISODES[5:7])).items() <= whole.items()
    journal = tmp_path / "journal"
    found = told(run_fleet(Convoy(faults=("agent3:2:raises",), journal=str(journal)), EPISODES))
    assert but_last(found) == but_last(by_itself())
    assert found[LAST].startswith("agent 'agent3' raised ValueError at 7 s: no way (deadly.py, line ")
    assert len(journal.read_text().splitlines()) == 1, "the others were run once"


@pytest.mark.parametrize(("jobs", "sizes"), [(1, [12]), (2, [6, 6]), (3, [4, 4, 4])])
def test_fleets_keep_every_process_busy_and_change_nothing(jobs, sizes):
    assert run_all(jobs=jobs) == (by_itself(), sizes)


@pytest.mark.parametrize(("fault", "raised"), [("exits", "SystemExit: 0"), ("own error", "OwnError: of its own")])
def test_one_that_exits_has_the_fleet_run_one_by_one_and_is_named(fault, raised):
    found, _ = run_all((f"agent3:2:{fault}",))
    assert but_last(found) == but_last(by_itself())
    assert found[LAST].startswith(f"the agent or the domain family raised {raised}")


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_one_that_hangs_under_a_limit_is_named_and_the_others_go_on(jobs, monkeypatch):
    monkeypatch.setattr("proxytune.running.workers.START_S", 3.0)
    found, _ = run_all(("agent3:2:hangs",), jobs, timeout_s=1.5)
    assert but_last(found) == but_last(by_itself())
    assert found[LAST] == "it took longer than 1.5 s"


@pytest.mark.parametrize(
    ("fault", "limit"), [("exits", {}), pytest.param("leaves", {"timeout_s": 9.0}, marks=pytest.mark.slow)]
)
def test_an_agent_that_has_ended_a_fleet_is_not_put_beside_others_again(tmp_path, fault, limit):
    journal = tmp_path / "journal"
    family = Convoy(faults=(f"agent0:*:{fault}",), journal=str(journal))
    known = dict.fromkeys(KNOWN, limit.get("timeout_s", MOST_S * MARGIN) / MARGIN / 3.0)
    with running(family, EPISODES, 1, watch=Watch(known=known, **limit)) as fleets:
        found = told(itertools.chain.from_iterable(fleets))
    assert all((one.agent == "agent0") == isinstance(what, str) for one, what in found.items())
    driven = [line.split()[2].split("+") for line in journal.read_text().splitlines()]
    assert max(map(len, driven)) == 3
    assert sum("agent0" in agents and len(agents) > 1 for agents in driven) == 1


@pytest.mark.slow
def test_a_fleet_is_expected_to_take_a_good_deal_less_than_an_episode_may():
    assert run_all(timeout_s=3.0, known=dict.fromkeys(KNOWN, 0.5)) == (by_itself(), [2] * 6)


def test_what_draws_is_run_by_itself_and_where_the_machine_fails_nobody_has():
    faults = ("agent1:*:draws",)
    assert run_together(Convoy(faults=faults), EPISODES) is None
    assert run_together(Convoy(), EPISODES) is not None
    assert told(run_fleet(Convoy(faults=faults), EPISODES)) == by_itself(faults)
    _, sizes = run_all(alone=["agent1"])
    assert sizes == [1, 1, 1, 9]
    with pytest.raises(RunError, match=r"agent 'agent3' from start 2: the machine failed \(MemoryError"):
        run_all(("agent3:2:memory",))


class Short(Convoy):
    def run_many(self, episodes):
        return super().run_many(episodes)[1:]


class Unlike(Convoy):
    def run_many(self, episodes):
        return [{"distance": 1.0} for _ in episodes]


class TooMany(Convoy):
    def run_many(self, episodes):
        if len(episodes) > 3:
            raise MemoryError("no room for so many")
        return super().run_many(episodes)


@pytest.mark.parametrize("family", [Short, TooMany])
def test_where_a_fleet_as_a_whole_fails_its_episodes_are_run_one_by_one(family):
    assert run_all(family=family)[0] == by_itself()


def test_an_episode_without_a_metric_fails_in_a_fleet_as_by_itself_and_they_share_their_time(monkeypatch):
    found, _ = run_all(family=Unlike)
    lacks = "the domain family gave no finite 'survival_time'"
    assert set(found.values()) == {f"agent '{one.agent}': {lacks}" for one in EPISODES}
    clock = SimpleNamespace(seconds=lambda: 0.6)
    monkeypatch.setattr("proxytune.running.fleets.awake", lambda: nullcontext(clock))
    assert [one.seconds for one in run_fleet(Convoy(), EPISODES[:6])] == [pytest.approx(0.1)] * 6
    begun = []
    run_all(begins=begun.append)
    assert [len(fleet) for fleet in begun] == [12]


def sizes(count, jobs, seconds=None, most_s=MOST_S):
    many = [make_episode({}, agent="agent0", start=0, seed=seed) for seed in range(count)]
    known = {} if seconds is None else {("agent0", 0): seconds}
    cut = list(in_fleets(many, jobs, lambda _: False, lambda _: False, known, most_s))
    assert len(set(itertools.chain.from_iterable(cut))) == sum(map(len, cut))
    return [len(fleet) for fleet in cut]


def test_fleets_are_as_large_as_seconds_and_processes_allow_and_what_is_not_needed_is_cut():
    assert sizes(48, 1, 0.1) == [MOST]
    assert sizes(48, 2, 0.1) == [24, 24]
    assert sizes(200, 2, 0.1) == [34, 34, 33, 33, 33, 33]
    assert sizes(48, 1, 1.0) == [24, 24], "no fleet takes longer than half a minute"
    assert sizes(48, 1, 1.0, most_s=10.0) == [10, 10, 10, 9, 9], "nor a good part of the time limit"
    assert sizes(5, 1, 100.0) == [1] * 5
    assert sizes(6, 100, 0.1) == [1] * 6
    assert sizes(0, 2, 0.1) == []
    assert sizes(10, 2) == [UNKNOWN, UNKNOWN, 2]
    cut = set()
    many = [make_episode({}, agent="agent0", start=0, seed=seed) for seed in range(8)]
    fleets = in_fleets(many, 2, lambda _: False, lambda one: one.seed in cut, {("agent0", 0): 0.1})
    assert [one.seed for one in next(fleets)] == [0, 2, 4, 6]
    cut.update((1, 3, 5))
    assert [[one.seed for one in fleet] for fleet in fleets] == [[7]]
