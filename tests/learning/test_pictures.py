"""What learners see of a picture is the mean grey of its cells."""

import numpy as np
import pytest

from proxytune.errors import LearnerError
from proxytune.learning.pictures import grey_cells


def test_a_cell_is_the_mean_grey_of_its_pixels_and_the_top_is_not_looked_at():
    picture = np.zeros((1, 12, 16, 3), dtype=np.uint8)
    picture[0, :3] = 255
    picture[0, 3:6, :4] = (255, 0, 0)
    cells = grey_cells(picture, top=0.25, rows=3, columns=4)[0].reshape(3, 4)
    assert cells[0, 0] == pytest.approx(1 / 3 - 0.5)
    assert (np.delete(cells.ravel(), 0) == -0.5).all()


def test_cells_may_be_of_unequal_size():
    picture = np.zeros((1, 5, 3, 3), dtype=np.uint8)
    picture[0, :2, :2] = 255
    assert grey_cells(picture, top=0.0, rows=2, columns=2)[0] == pytest.approx([0.5, -0.5, -0.5, -0.5])


@pytest.mark.parametrize("shape", [(2, 2, 3), (48, 64), (3, 16, 3)])
def test_pictures_of_the_wrong_size_are_one_line(shape):
    with pytest.raises(LearnerError, match="pictures have shape .*do not fit in; give"):
        grey_cells(np.zeros((1, *shape), dtype=np.uint8), top=0.25, rows=3, columns=4)
