import numpy as np
from hypothesis import given, settings, strategies as st

from proxytune.search import from_unit, to_unit, unit_points
from proxytune.search.engine import design_point
from proxytune.space import Interval, Space

SPACE = Space((Interval("delay", 0.0, 0.3), Interval("trim", -0.3, 0.3)))


@settings(max_examples=25)
@given(index=st.integers(0, 70), seed=st.integers(0, 2**53))
def test_a_design_point_lies_in_the_box_and_is_given_by_index_and_seed(index, seed):
    values = design_point(SPACE, index, seed)
    assert values == design_point(SPACE, index, seed)
    assert all(interval.low <= value <= interval.high for interval, value in zip(SPACE.intervals, values, strict=True))


@settings(max_examples=25)
@given(count=st.integers(1, 40), more=st.integers(0, 40), dimensions=st.integers(1, 8))
def test_a_longer_design_begins_with_every_shorter_one(count, more, dimensions):
    assert np.array_equal(unit_points(dimensions, count + more, 3)[:count], unit_points(dimensions, count, 3))


def test_every_eighth_of_the_box_gets_one_of_eight_points():
    points = unit_points(2, 8, 1)
    assert sorted(np.floor(points[:, 0] * 8)) == list(range(8))
    assert sorted(np.floor(points[:, 1] * 8)) == list(range(8))


@settings(max_examples=25)
@given(unit=st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_the_unit_cube_and_the_box_are_one_another_s_inverse(unit):
    values = from_unit(SPACE, np.array(unit))
    assert np.allclose(to_unit(SPACE, values), unit, atol=1e-12)
    assert all(interval.low <= value <= interval.high for interval, value in zip(SPACE.intervals, values, strict=True))
