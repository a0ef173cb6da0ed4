"""Agents are compared by stated metrics, in a table that keeps values with their names."""

import numpy as np
import pytest
from one_line import complaint_of

from proxytune.errors import ScoresError
from proxytune.scores import Metric, ScoreTable, varies


@pytest.mark.parametrize(
    ("text", "metric"),
    [
        ("distance:max", Metric("distance")),
        ("time:min:0.5", Metric("time", "min", 0.5)),
        ("distance:max:5%", Metric("distance", "max", 5.0, percent=True)),
        (" lap time : max : 1e-3 ", Metric("lap time", "max", 1e-3)),
    ],
)
def test_a_metric_is_read_from_its_text_and_written_back(text, metric):
    assert Metric.parse(text) == metric
    assert Metric.parse(str(metric)) == metric


@pytest.mark.parametrize(
    "text", ["", "distance", "distance:up", "a:max:", "a:max:x", "a:max:5%%", "a:max:-1", "a:max:nan"]
)
def test_a_malformed_metric_is_refused_by_name(text):
    assert "metric '" in complaint_of(Metric.parse, text)


def test_percentages_merits_and_rounding_are_of_each_table():
    merits, tie = Metric.parse("a:max:10%").merits(np.array([[1.0, 4.0], [10.0, 20.0]]))
    np.testing.assert_allclose(merits, [[0.25, 1.0], [0.5, 1.0]])
    np.testing.assert_allclose(tie, [[0.1], [0.1]])
    for text in ("a:min", "a:min:10%"):
        merits, _ = Metric.parse(text).merits(np.array([1.0, 4.0]))
        assert merits[0] > merits[1]
    assert varies(np.array([[0.3, 1.0], [0.1 + 0.2, 2.0]])).tolist() == [False, True]


def test_tables_are_built_and_arranged_with_their_names_and_an_unknown_metric_is_refused():
    table = ScoreTable.from_episodes({("A", 1): {"m": 1.0}, ("B", 1): {"m": 2.0}, ("A", 2): {"m": 3.0}})
    assert table.means[:, 0].tolist() == [2.0, 2.0]
    assert table.driven.tolist() == [[True, True], [True, False]]
    table = ScoreTable.from_episodes({(a, e): {"m": 10.0 * i + e} for i, a in enumerate("AB") for e in (1, 2)})
    assert table.arrange(agents=("B", "A"), episodes=("2", "1")).values[:, :, 0].tolist() == [[12.0, 11.0], [2.0, 1.0]]
    table = ScoreTable.from_episodes({("A", 1): {"m": 1.0}, ("A", 2): {"m": 4.0}, ("B", 1): {"m": 2.0}})
    loose = table.unpaired()
    assert loose.driven.sum(axis=0).tolist() == [1, 1, 1]
    np.testing.assert_array_equal(loose.means, table.means)
    table = ScoreTable.from_episodes({("A", 1): {"distance": 1.0}})
    with pytest.raises(ScoresError, match="no metric 'distanz' in the scores; did you mean 'distance'"):
        table.select(["distanz"])


@pytest.mark.parametrize(
    "scored", [{}, {("A", 1): {"m": float("nan")}}, {("A", 1): {"m": 1.0, "n": 1.0}, ("A", 2): {"m": 1.0}}]
)
def test_episodes_without_a_finite_score_are_refused(scored):
    with pytest.raises(ScoresError):
        ScoreTable.from_episodes(scored)


def test_agents_with_too_many_episodes_of_their_own_are_refused_before_they_fill_the_memory():
    agents = [f"A{number}" for number in range(20_000)]
    alike = ScoreTable.from_rows(agents, ["0"] * len(agents), ["m"], np.ones((len(agents), 1)))
    assert alike.values.shape == (20_000, 1, 1)
    with pytest.raises(ScoresError, match="compare fewer agents") as problem:
        alike.unpaired()
    assert "\n" not in str(problem.value)
    with pytest.raises(ScoresError, match="20000 agents × 20000 episodes"):
        ScoreTable.from_rows(agents, agents, ["m"], np.ones((len(agents), 1)))
