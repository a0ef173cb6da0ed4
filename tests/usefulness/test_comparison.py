"""Both sides of a comparison must hold the same agents and metrics."""

import pytest

from proxytune.errors import ScoresError
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import compare, in_common

M = [Metric("m")]


def table(agents, episodes=(1,)):
    return ScoreTable.from_episodes({(a, e): {"m": ord(a) + e / 10, "n": 0.0} for a in agents for e in episodes})


def test_the_proxy_is_put_in_the_targets_order():
    inputs = compare(proxy=table("CAB", (2, 1)), target=table("ABC", (1, 2)), metrics=M)
    assert inputs.agents == inputs.proxy.agents == ("A", "B", "C")
    assert inputs.paired
    assert (inputs.proxy.values == inputs.target.values).all()


def test_different_episodes_are_not_paired():
    assert not compare(proxy=table("AB", (1, 2)), target=table("AB", (1, 3)), metrics=M).paired
    inputs = compare(proxy=table("AB", (1, 2, 3)), target=table("AB"), metrics=M)
    assert (inputs.proxy_episodes, inputs.target_episodes) == ((3, 3), (1, 1))


@pytest.mark.parametrize(
    ("proxy", "target", "complaint"),
    [
        ("AB", "ABCD", "the proxy lacks scores of C, D, which the target has"),
        ("ABC", "AB", "the target lacks scores of C, which the proxy has"),
        ("A", "A", r"only one agent \('A'\) is scored"),
    ],
)
def test_agents_that_do_not_match_are_named(proxy, target, complaint):
    with pytest.raises(ScoresError, match=complaint):
        compare(proxy=table(proxy), target=table(target), metrics=M)


@pytest.mark.parametrize("metrics", [[], [Metric("m"), Metric("m", "min")], [Metric("k")]])
def test_no_metric_a_metric_twice_or_an_unknown_one_is_refused(metrics):
    with pytest.raises(ScoresError):
        compare(proxy=table("AB"), target=table("AB"), metrics=metrics)


def test_agents_that_all_sides_have_are_kept_and_the_others_named():
    human = ScoreTable.from_episodes({(a, "day" if a == "H" else 1): {"m": 1.0} for a in "BHA"})
    kept, lines = in_common({"the target": human, "the proxy sim": table("ABC")})
    assert (kept["the target"].agents, kept["the proxy sim"].agents) == (("B", "A"), ("A", "B"))
    assert kept["the target"].episodes == ("1",), "an episode that nobody is left of is none"
    assert lines == (
        "left out, since not all sides have them: H of the target",
        "left out, since not all sides have them: C of the proxy sim",
    )
    with pytest.raises(ScoresError, match="at least two agents in common; one has A, B; other has C, D"):
        in_common({"one": table("AB"), "other": table("CD")})
