"""A learning curve is scores over a rising grid of target samples, with gaps where nobody was examined."""

import numpy as np
import pytest

from proxytune.errors import InputError
from proxytune.learning.curves import Curve

NAN = np.nan


@pytest.mark.parametrize(
    ("counts", "scores", "says"),
    [
        ((100, 200), np.zeros((2, 2)), "add 0"),
        ((0, 200, 200), np.zeros((2, 3)), "must rise"),
        ((0, 200), np.zeros((2, 3)), "shape"),
        ((), np.zeros((2, 0)), "add 0"),
    ],
)
def test_a_curve_that_is_none_is_refused(counts, scores, says):
    with pytest.raises(InputError, match=says):
        Curve(counts, scores)


def test_examinations_and_the_repetitions_that_have_one_are_counted():
    curve = Curve((0, 100, 200), np.array([[NAN, 1.0, NAN], [NAN, NAN, NAN], [2.0, 3.0, NAN]]))
    assert curve.examined.tolist() == [[0, 1], [2, 0], [2, 1]]
    assert curve.repetitions == 2
