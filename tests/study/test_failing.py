import pytest

from proxytune.domain import Outcome, make_episode
from proxytune.errors import RunError
from proxytune.study.stages.failing import check_some_work


def outcome(agent, failure=""):
    return Outcome(make_episode({}, agent=agent, start=0, seed=0), None if failure else {"distance": 1.0}, failure, 0.1)


ALIKE = [outcome(f"agent{n}", f"agent 'agent{n}' raised KeyError at 1.{n} s: 'mass' (sim.py, line 7)") for n in (0, 1)]


def test_where_all_fail_alike_the_line_begins_with_the_failure_and_its_place():
    expected = r"^agent 'agent0' raised KeyError at 1.0 s: 'mass' \(sim.py, line 7\); every agent fails so, in all 2"
    with pytest.raises(RunError, match=expected) as told:
        check_some_work(ALIKE, "trial 1 of 20")
    assert str(told.value).endswith("of trial 1 of 20: correct it and run the same command again")


@pytest.mark.parametrize(
    "outcomes",
    [[], [*ALIKE, outcome("agent2")], [ALIKE[0], outcome("agent1", "agent 'agent1' raised ValueError: no mass")]],
    ids=["none was driven", "one worked", "they fail of different things"],
)
def test_anything_else_goes_on(outcomes):
    check_some_work(outcomes, "the pre-flight")
