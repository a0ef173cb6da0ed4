import sqlite3
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import count

import pytest

from proxytune.domain import Outcome, make_episode
from proxytune.errors import StoreError
from proxytune.extensions import Interrupted
from proxytune.storage import Store, SweepRecord, TrialRecord
from proxytune.storage.store import theta_json

THETA = {"trim": 0.1, "delay": 1 / 3}
EPISODE = make_episode(THETA, agent="agent1", start=2, seed=11)
OTHER_EPISODE = make_episode(THETA, agent="agent1", start=3, seed=12)
WORKED = Outcome(EPISODE, {"distance": 0.1 + 0.2}, "", 1.5)


def test_theta_is_stored_in_one_form_with_every_digit():
    assert theta_json({"trim": 0.1, "delay": 1 / 3}) == theta_json({"delay": 1 / 3, "trim": 0.1})
    assert theta_json(THETA) == '{"delay": 0.3333333333333333, "trim": 0.1}'


def test_an_outcome_comes_back_to_the_last_bit_and_is_there_for_others_at_once(tmp_path):
    with Store.open(tmp_path) as store:
        store.save_outcome("identity", WORKED)
    with Store.read(tmp_path) as store:
        assert store.outcomes("identity", THETA) == {EPISODE: WORKED}
        assert store.outcomes("another identity", THETA) == {}
        assert store.outcomes("identity", {"trim": 0.1}) == {}
    with Store.open(tmp_path) as store:
        store.save_outcome("identity", WORKED)
        with sqlite3.connect(tmp_path / "study.db") as plain:
            assert plain.execute("SELECT agent, start, seed FROM episodes").fetchall() == [("agent1", 2, 11)]


def test_failures_are_kept_until_episodes_work_and_agents_known_by_them(tmp_path):
    failed = Outcome(EPISODE, None, "it lost its way", 0.5)
    with Store.open(tmp_path) as store:
        store.save_outcome("identity", failed)
        assert store.outcomes("identity", THETA) == {EPISODE: failed}
        store.save_outcome("identity", WORKED)
        assert store.outcomes("identity", THETA) == {EPISODE: WORKED}
    with Store.open(tmp_path) as store:
        for agent, failure in (("a", "it ended its process"), ("b", "raised it ended"), ("c", "it took long")):
            store.save_outcome("one", Outcome(replace(EPISODE, agent=agent), None, failure, 1.0))
        assert store.agents_that_failed("it ended", "it took") == {"a", "c"}


def test_failures_are_those_of_other_code_once_the_code_has_changed_or_all_are_to_be_tried_again(tmp_path):
    failed = Outcome(EPISODE, None, "it lost its way", 0.5)
    with Store.open(tmp_path) as store:
        store.save_outcome("identity", failed, code="code 1")
        store.save_outcome("identity", replace(WORKED, episode=OTHER_EPISODE), code="code 1")
        assert store.failed_in_other_code("identity", code="code 1") == set()
        assert store.failed_in_other_code("identity", "code 2") == {EPISODE}
        assert store.failed_in_other_code("another identity", "code 2") == set()
        store.forget_failures()
        assert store.failed_in_other_code("identity", code="code 1") == {EPISODE}
        store.save_outcome("identity", replace(failed, episode=OTHER_EPISODE))
        assert store.failed_in_other_code("identity", code="code 1") == {EPISODE}, "of some the code is not known"


def test_trials_come_back_in_order_and_searches_are_kept_apart(tmp_path):
    finished = TrialRecord(1, THETA, "finished", 4.0, {"prpv": 4.0, "ppv": 1 / 3}, 1, "")
    with Store.open(tmp_path) as store:
        store.save_trial("identity", TrialRecord(2, {"trim": 0.2, "delay": 0.0}))
        store.save_trial("identity", TrialRecord(1, THETA))
        store.save_trial("identity", finished)
        assert store.trials() == [finished, TrialRecord(2, {"trim": 0.2, "delay": 0.0})]

    of_plv = TrialRecord(1, {"trim": 0.2}, "finished", -400.0, {"plv": 400.0, "zero_shot": None}, seconds=2.5)
    with Store.open(tmp_path) as store:
        store.save_trial("identity", TrialRecord(1, THETA))
        store.save_trial("identity", of_plv, objective="plv")
        store.begin({"seed": 2}, "prpv")
    with Store.read(tmp_path) as store:
        assert (store.trials(), store.trials("plv"), store.searches()) == ([], [of_plv], ["plv"])


def test_what_has_been_read_is_kept_up_with_what_is_written(tmp_path):
    again = Outcome(EPISODE, {"distance": 2.0}, "", 0.5)
    with Store.open(tmp_path) as store:
        assert (store.outcomes("identity", THETA), store.seconds(), store.trials()) == ({}, {}, [])
        for outcome in (WORKED, again):
            store.save_outcome("identity", outcome)
        store.save_trial("identity", TrialRecord(1, THETA))
        assert store.outcomes("identity", THETA) == {EPISODE: again}
        assert store.trials() == [TrialRecord(1, THETA)]
        assert store.seconds() == {("agent1", 2): 0.5}
    with Store.read(tmp_path) as store:
        assert store.seconds() == {("agent1", 2): 0.5}


def test_facts_are_added_and_beginning_afresh_drops_trials_alone(tmp_path):
    with Store.open(tmp_path) as store:
        store.save_trial("identity", TrialRecord(1, THETA))
        store.save_outcome("identity", WORKED)
        store.begin({"seed": 2, "parameters.trim": [-0.3, 0.3]})
        assert store.trials() == []
        assert store.facts() == {"seed": 2, "parameters.trim": [-0.3, 0.3]}
        assert store.outcomes("identity", THETA) == {EPISODE: WORKED}

    with Store.open(tmp_path) as store:
        store.begin({"seed": 2})
        store.save_trial("identity", TrialRecord(1, THETA))
        store.save_fact("versions", {"numpy": "2.0"})
        store.save_fact("versions", {"numpy": "2.1"})
        assert store.facts() == {"seed": 2, "versions": {"numpy": "2.1"}}
        assert store.trials() == [TrialRecord(1, THETA)]


def test_seconds_are_averaged_over_instances_and_trials_have_those_of_their_own(tmp_path):
    elsewhere = make_episode({"trim": 0.2}, agent="agent1", start=2, seed=11)
    with Store.open(tmp_path) as store:
        store.save_outcome("identity", WORKED)
        store.save_outcome("identity", Outcome(elsewhere, {"distance": 1.0}, "", 0.5))
        assert store.seconds() == {("agent1", 2): 1.0}

    with Store.open(tmp_path) as store:
        assert store.seconds_of_trials("prpv", 9, {11}) == 0.0
        store.save_outcome("identity", WORKED)
        store.save_outcome("another identity", WORKED)
        store.save_outcome("identity", Outcome(elsewhere, {"distance": 1.0}, "", 0.25))
        store.save_outcome("identity", Outcome(replace(EPISODE, seed=12), {"distance": 1.0}, "", 8.0))
        store.save_trial("identity", TrialRecord(1, THETA, "finished"))
        store.save_trial("identity", TrialRecord(2, {"trim": 0.2}, "finished"))
        assert [store.seconds_of_trials("prpv", last, {11, 13}) for last in (0, 1, 2)] == [0.0, 1.5, 1.75]


SWEEP = SweepRecord("trim", {"delay": 0.1}, (-0.3, 0.0, 0.3))


def test_a_sweep_is_remembered_once_with_the_identity_of_its_domain_family(tmp_path):
    with Store.open(tmp_path) as store:
        store.save_sweep("identity", SWEEP)
        store.save_sweep("identity", SWEEP)
        store.save_sweep("another identity", SWEEP)
        assert store.sweeps() == [("identity", SWEEP), ("another identity", SWEEP)]


def test_the_sweep_asked_for_last_comes_last_also_if_it_is_an_old_one(tmp_path):
    other = replace(SWEEP, parameter="blur")
    with Store.open(tmp_path) as store:
        for sweep in (SWEEP, other, SWEEP):
            store.save_sweep("identity", sweep)
        assert store.sweeps() == [("identity", other), ("identity", SWEEP)]


def test_a_sweep_keeps_the_target_model_of_its_pod_beside_the_same_without(tmp_path):
    against = replace(SWEEP, target_model='robot = "duckiebot"\n', replays="both")
    with Store.open(tmp_path) as store:
        store.save_sweep("identity", against)
        store.save_sweep("identity", SWEEP)
    with Store.read(tmp_path) as store:
        assert store.sweeps() == [("identity", against), ("identity", SWEEP)]


def test_what_cannot_be_written_leaves_everything_and_reading_cannot_write(tmp_path):
    with Store.open(tmp_path) as store:
        store.save_outcome("identity", WORKED)
        with pytest.raises(ValueError, match="not JSON compliant"):
            store.begin({"seed": 1, "bound": float("nan")})
        with pytest.raises(ValueError, match="not JSON compliant"):
            store.save_outcome("identity", Outcome(EPISODE, {"distance": float("nan")}, "", 1.0))
        assert store.outcomes("identity", THETA) == {EPISODE: WORKED}
        store.save_trial("identity", TrialRecord(1, THETA))
    with Store.read(tmp_path) as store, pytest.raises(StoreError, match="cannot be written"):
        store.save_outcome("identity", WORKED)


RUNNING = [replace(EPISODE, start=start) for start in (0, 1)]


def test_the_last_episode_that_began_is_known_to_the_next_process_of_the_same_family_alone(tmp_path):
    with Store.open(tmp_path) as store:
        for episode in RUNNING:
            store.begin_episode("one", episode)
    with Store.open(tmp_path) as store:
        assert store.under_way("one") == RUNNING[1:]
        assert store.under_way("another") == []
        store.begin_episode("one", *RUNNING)
        assert store.under_way("one") == RUNNING, "all that run at once"
        store.begin_episode("one")
        assert store.under_way("one") == []


def interrupt_at(line):
    """A tracer that raises Interrupted as this line, counted from the first it sees, is about to run."""
    lines = count(1)

    def trace(frame, event, argument):
        if event == "line" and next(lines) == line:
            sys.settrace(None)
            raise Interrupted
        return trace

    return trace


def write_until_done(folder):
    """Write an episode, interrupted at its first line, its second and so on; how many were kept, and the last line."""
    kept, before = 0, sys.gettrace()
    with Store.open(folder) as store:
        # What is worked out once is worked out: else the last line is never come to
        store.save_outcome("identity", Outcome(replace(EPISODE, seed=0), {"distance": 0.5}, "", 1.5))
        store.save_fact("line", 0)
        for line in count(1):
            episode = replace(EPISODE, seed=line)
            try:
                sys.settrace(interrupt_at(line))
                store.save_outcome("identity", Outcome(episode, {"distance": 0.5}, "", 1.5))
            except Interrupted:
                # As a command does that ends, while the interruption is on its way up.
                store.begin_episode("identity")
                store.save_fact("line", line)
            else:
                return kept, line
            finally:
                sys.settrace(before)
            with sqlite3.connect(folder / "study.db") as plain:
                kept += plain.execute("SELECT count(*) FROM episodes WHERE seed = ?", (line,)).fetchone()[0]
                assert plain.execute("SELECT value FROM facts").fetchall() == [(str(line),)]


def test_an_interruption_at_any_line_of_a_write_leaves_a_store_that_writes_on(tmp_path):
    """What was being written is there as a whole or not at all."""
    # In a thread of its own: what is raised by a tracer within `except` is for ever handled, as Python has it.
    with ThreadPoolExecutor(1) as thread:
        kept, line = thread.submit(write_until_done, tmp_path).result()
    assert 0 < kept < line - 1
    with Store.read(tmp_path) as store:
        assert len(store.outcomes("identity", THETA)) == kept + 2
