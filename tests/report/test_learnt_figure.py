"""The learnt curves are drawn over their signals, with units."""

import warnings

import numpy as np

from proxytune.diagnosis import Learning
from proxytune.diagnosis.motion.discrepancy import Discrepancy
from proxytune.effects import GROUPS, Curve, Learnt, Seen, learnt_theta
from proxytune.report.diagnosis.learnt_figure import learnt_figure

KNOTS = {"speed_and_turn": ((-0.2, -1.0), (0.2, 1.0)), "direction": (-1.0,), "heading": (1.0, 2.0)}


def learning(*groups):
    curves = [
        Curve(group, channel, knots, tuple(0.01 * (number + 1) for number in range(len(knots))))
        for group in groups
        for channel in GROUPS[group].channels
        for knots in [KNOTS.get(group, (0.5, 1.0, 2.0))]
    ]
    theta = learnt_theta(Learnt(Seen((-0.3, 0.4), (-3.0, 3.0)), tuple(curves)))
    return Learning(
        Discrepancy(theta, {GROUPS[group].title: 1.0 / len(groups) for group in groups}, {}, True), (), False
    )


def test_every_group_is_drawn_without_a_warning_and_every_panel_has_units():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = learnt_figure(learning(*GROUPS))
        figure.draw_without_rendering()
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert all("[" in axes.get_ylabel() for axes in shown)
    assert all("[" in axes.get_xlabel() for axes in shown if axes.get_xlabel())
    assert len({axes.get_xlabel() for axes in shown if axes.get_xlabel()}) == len(GROUPS) - 1  # the level is no curve


def test_a_curve_is_drawn_through_its_weights_and_through_nothing_at_rest():
    figure = learnt_figure(learning("turn_rate"))
    line = figure.axes[2].get_lines()[0]
    np.testing.assert_allclose(line.get_xdata(), (0.0, 0.5, 1.0, 2.0))
    np.testing.assert_allclose(line.get_ydata(), np.degrees((0.0, 0.01, 0.02, 0.03)))


def test_harmonics_of_the_heading_are_drawn_as_what_they_add_up_to():
    figure = learnt_figure(learning("heading"))
    forward = figure.axes[0].get_lines()[0]
    around = np.radians(forward.get_xdata())
    expected = sum(10.0 * k * (np.cos(k * around) + np.sin(k * around)) for k in (1, 2))
    np.testing.assert_allclose(forward.get_ydata(), expected, atol=1e-9)


def test_nothing_is_drawn_where_nothing_is_used():
    assert learnt_figure(Learning(Discrepancy({"learnt.turn_rate.yaw@1.0": 0.1}), (), False)) is None
