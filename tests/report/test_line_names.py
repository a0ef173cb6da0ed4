"""Names stand beside the ends of their lines."""

import numpy as np
from matplotlib.figure import Figure

from proxytune.report.line_names import LineName, name_lines, spread


def test_a_name_stands_right_of_the_panel_at_the_end_of_its_line_in_its_colour():
    axes = Figure().subplots()
    axes.set_ylim(-10.0, 30.0)
    name_lines(axes, [LineName("gp", "#0072B2", 20.0), LineName("beyond", "0.3", 99.0)])
    assert [(text.get_text(), text.get_position()[1], text.get_color()) for text in axes.texts] == [
        ("gp", 0.75, "#0072B2"),
        ("beyond", 1.0, "0.3"),
    ]
    assert all(text.get_position()[0] > 1.0 for text in axes.texts)


def test_places_are_moved_as_little_as_it_takes_and_keep_their_order():
    assert spread([0.9, 0.1], 0.1) == [0.9, 0.1]
    np.testing.assert_allclose(spread([0.5, 0.5, 0.9], 0.1), [0.45, 0.55, 0.9])
    found = spread([0.0, 0.01, 0.0], 0.1)
    assert min(found) == 0.0
    assert sorted(found) == [found[0], found[2], found[1]]
