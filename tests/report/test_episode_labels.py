"""Words on a map keep clear of each other, of marks and of paths."""

import numpy as np
from hypothesis import given, strategies as st

from proxytune.report.drive.labels import CORNERS, GAP, SIZE, corners_of

LOW, HIGH = np.array((0.0, 0.0)), np.array((2.0, 2.0))
NOTHING = np.empty((0, 2))


def centres(marks, corners):
    return np.array(marks) + np.array(corners) * (SIZE / 2.0 + GAP) * 2.0


def test_a_label_alone_stands_to_the_right_and_above():
    assert corners_of(np.array([(1.0, 1.0)]), NOTHING, LOW, HIGH) == [(1, 1)]


@given(st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_a_label_stays_on_the_map(x, y):
    (corner,) = corners_of(np.array([(x, y)]), NOTHING, LOW, HIGH)
    centre = centres([(x, y)], [corner])[0]
    assert (centre - SIZE >= LOW - 1e-9).all()
    assert (centre + SIZE <= HIGH + 1e-9).all()


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_two_marks_close_by_have_labels_apart(x, y):
    marks = np.array([(1.0, 1.0), (1.0 + x, 1.0 + y)])
    one, two = centres(marks, corners_of(marks, NOTHING, LOW, HIGH))
    assert (np.abs(one - two) >= 2.0 * SIZE - 1e-9).any()


def test_a_path_is_not_hidden_where_there_is_room_beside_it():
    path = np.column_stack((np.linspace(1.0, 2.0, 50), np.linspace(1.0, 1.3, 50)))
    (corner,) = corners_of(np.array([(1.0, 1.0)]), path, LOW, HIGH)
    assert corner == tuple(CORNERS[1])
