"""Style of figures: quick to load, names beside lines."""

import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from proxytune.report.figure_style import LineName, name_lines, spread_places

HEAVY = ("pybullet", "skopt", "sklearn", "optuna", "torch", "proxytune.diagnosis.motion.diagnose")


@pytest.mark.slow
@pytest.mark.parametrize("module", ["proxytune.report.study.figures", "proxytune.report.sweep"])
def test_a_figure_loads_no_simulator_no_library_of_models_and_no_diagnosis(module):
    line = f"import sys, {module}; print([name for name in {HEAVY} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_a_name_stands_right_of_the_panel_at_the_end_of_its_line_in_its_colour():
    axes = Figure().subplots()
    axes.set_ylim(-10.0, 30.0)
    name_lines(axes, [LineName("gp", "#0072B2", 20.0), LineName("beyond", "0.3", 99.0)])
    assert [(text.get_text(), text.get_position()[1], text.get_color()) for text in axes.texts] == [
        ("gp", 0.75, "#0072B2"),
        ("beyond", 1.0, "0.3"),
    ]
    assert all(text.get_position()[0] > 1.0 for text in axes.texts)


def test_places_are_moved_as_little_as_it_takes_in_their_order_within_the_panel_where_they_fit():
    assert spread_places([0.9, 0.1], 0.1) == [0.9, 0.1]
    np.testing.assert_allclose(spread_places([0.5, 0.5, 0.9], 0.1), [0.45, 0.55, 0.9])
    found = spread_places([0.0, 0.01, 0.0], 0.1)
    assert min(found) == 0.0
    assert sorted(found) == [found[0], found[2], found[1]]
    np.testing.assert_allclose(spread_places([1.0, 1.0, 1.0], 0.1), [0.8, 0.9, 1.0])
    np.testing.assert_allclose(spread_places([0.0, 1.0, 1.0], 0.4), [0.0, 0.6, 1.0])
    assert max(spread_places([0.3] * 5, 0.25)) == 1.0
    assert spread_places([0.5] * 3, 1.0) == [0.0, 1.0, 2.0]
