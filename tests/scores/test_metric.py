"""Agents are compared by stated metrics."""

import numpy as np
import pytest

from proxytune.errors import InputError
from proxytune.scores import Metric, varies


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
    with pytest.raises(InputError, match=r"metric '"):
        Metric.parse(text)


def test_a_percentage_is_of_the_largest_value_of_each_table():
    merits, tie = Metric.parse("a:max:10%").merits(np.array([[1.0, 4.0], [10.0, 20.0]]))
    np.testing.assert_allclose(merits, [[0.25, 1.0], [0.5, 1.0]])
    np.testing.assert_allclose(tie, [[0.1], [0.1]])


def test_where_less_is_better_merits_are_reversed():
    for text in ("a:min", "a:min:10%"):
        merits, _ = Metric.parse(text).merits(np.array([1.0, 4.0]))
        assert merits[0] > merits[1]


def test_rounding_is_no_variation():
    assert varies(np.array([[0.3, 1.0], [0.1 + 0.2, 2.0]])).tolist() == [False, True]
