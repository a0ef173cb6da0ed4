"""Figures of a diagnosis of motion and their captions."""

import re
from dataclasses import replace
from pathlib import Path

import hidden_cases as hidden
import numpy as np
import pytest
from matplotlib.container import ErrorbarContainer
from planted import ROBOT, TRUTH, planted_drives
from readable import assert_readable, drawn_without_a_warning

import proxytune
from proxytune.diagnosis import (
    MOTION_EFFECTS,
    RANDOM_EFFECTS,
    RULES,
    AdoptedEffect,
    Learning,
    cut,
    disturbed_increments,
    pose_errors,
)
from proxytune.diagnosis.motion.diagnose import diagnose
from proxytune.diagnosis.motion.discrepancy import Discrepancy
from proxytune.diagnosis.motion.innovations import huber
from proxytune.diagnosis.motion.screening import candidates
from proxytune.diagnosis.motion.signals import signal_groups
from proxytune.effects import GROUPS, FittedRange, Learnt, LearntCurve, Means, Panel, learnt_theta, theta_names
from proxytune.effects.catalogue import CATALOGUE
from proxytune.effects.effect import MOTIONS, SIGNALS
from proxytune.report.diagnosis.answer import diagnosis_pictures
from proxytune.report.diagnosis.effect_figure import (
    ANY,
    CUE_PANELS,
    MEASURED,
    NAMES,
    Rates,
    _signal,
    effect_curve,
    refit_beside_curve,
)
from proxytune.report.diagnosis.error_figures import DECLARED_MODEL, residual_map, residual_over_time, strayed
from proxytune.report.diagnosis.figures import JUDGES, SHOWN, learnt_figure, motion_figures, ranking_figure
from proxytune.report.figure_style import VERMILLION
from proxytune.report.writing import CAPTIONS

WIDTH = 0.12
AFTER = "with dead band"


@pytest.fixture(scope="module")
def diagnosis(few_effects):
    case = next(case for case in hidden.IN_FORM if case.effects == (("dead_band", {"width": WIDTH}),))
    found = diagnose(hidden.make_log(case, episodes=6, seconds=20.0), ROBOT, ("trim", "delay"))
    assert [effect.effect for effect in found.effects] == ["dead_band"]
    return found


@pytest.fixture(scope="module")
def clean(diagnosis):
    return without_effects(diagnosis)


@pytest.fixture(scope="module")
def figures(diagnosis):
    return drawn_without_a_warning(lambda: motion_figures(diagnosis))


def without_effects(diagnosis, unnamed_curves=()):
    """The same drives, as if nothing had been added, and these signals were left over."""
    found = replace(diagnosis.found, model=diagnosis.found.declared, adopted=(), unnamed_curves=unnamed_curves)
    return replace(diagnosis, effects=(), found=found)


def with_effect(diagnosis, effect, form, theta):
    """The same drives, as if this effect had been added instead."""
    adopted = (AdoptedEffect(effect, form, tuple(theta), (), 100.0, 0.001, (), None),)
    model = replace(diagnosis.found.declared, theta={**diagnosis.found.declared.theta, **theta})
    return replace(diagnosis, effects=adopted, found=replace(diagnosis.found, model=model, adopted=adopted))


def line(axes, label):
    return next(line for line in axes.get_lines() if line.get_label() == label)


def values(axes, label):
    drawn = line(axes, label)
    return np.asarray(drawn.get_xdata()), np.asarray(drawn.get_ydata())


def test_every_figure_is_drawn_without_a_warning_for_a_column_and_says_what_it_shows_in_which_unit(figures):
    assert set(figures) == {"residual_over_time", "residual_map", "ranking", "effect_curve", "error"}
    assert_readable(*figures.values())
    labels = {name: [(a.get_xlabel(), a.get_ylabel()) for a in figure.axes] for name, figure in figures.items()}
    assert labels["residual_over_time"] == [("time in the episode [s]", "distance to prediction\nin 2-s windows [mm]")]
    assert labels["residual_map"][-1][0] == "distance to prediction in 2-s windows [mm]"
    assert "[nats]" in labels["ranking"][-1][0]
    assert [y for _, y in labels["error"]] == ["position error, RMS [mm]", "heading error, RMS [deg]"]
    assert all(x == "prediction length [s]" for x, _ in labels["error"])
    assert [y for _, y in labels["effect_curve"]][::2] == ["steady speed [m/s]", "speed − declared\n[mm/s]"]
    assert [x for x, _ in labels["effect_curve"]][2:] == ["command [duty]"] * 2


def test_the_error_figure_holds_errors_and_their_ends_on_logarithmic_axes_with_the_floor_off_theirs(diagnosis, figures):
    place, heading = figures["error"].axes
    for axes, factor, kinds in (
        (place, 1e3, ("before", "after")),
        (heading, 180.0 / np.pi, ("heading_before", "heading_after")),
    ):
        drawn = [one for one in axes.containers if isinstance(one, ErrorbarContainer)]
        for container, kind in zip(drawn, kinds, strict=True):
            told = [getattr(error, kind) for error in diagnosis.errors]
            points, _, (bars,) = container
            assert points.get_ydata() == pytest.approx([factor * one.value for one in told])
            ends = [sorted(segment[:, 1]) for segment in bars.get_segments()]
            assert np.ravel(ends) == pytest.approx(factor * np.ravel([one.interval for one in told]))
    floors = [segment[0, 1] for segment in place.collections[-1].get_segments()]
    assert floors == pytest.approx([1e3 * error.floor.lower for error in diagnosis.errors])
    bars = [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in place.patches]
    assert np.ravel(bars) == pytest.approx(
        np.ravel([(1e3 * error.floor.lower, 1e3 * error.floor.upper) for error in diagnosis.errors])
    )

    for axes, floors in zip(
        figures["error"].axes,
        ([1e3 * e.floor.lower for e in diagnosis.errors], [np.degrees(e.heading_floor) for e in diagnosis.errors]),
        strict=True,
    ):
        assert axes.get_yscale() == "log"
        assert axes.get_ylim()[0] < 0.95 * min(floors)
    endless = [replace(e, before=e.before._replace(interval=(0.0, np.inf))) for e in diagnosis.errors]
    figure = motion_figures(replace(diagnosis, errors=tuple(endless)))["error"]
    _, _, (bars,) = next(one for one in figure.axes[0].containers if isinstance(one, ErrorbarContainer))
    assert all(np.ptp(segment[:, 1]) == 0.0 for segment in bars.get_segments())


def test_residuals_over_time_are_those_of_the_windows_on_an_axis_that_says_why_it_begins_late(diagnosis, figures):
    drives = diagnosis.parts.tested
    windows = cut(drives, 2.0)
    squares = pose_errors(drives, diagnosis.found.model.theta, windows)[:, 0] ** 2
    expected = 1e3 * np.sqrt([squares[windows.window == w].mean() for w in range(len(windows.begin))])
    (axes,) = figures["residual_over_time"].axes
    drawn = [one.get_ydata() for one in axes.get_lines() if one.get_color() == line(axes, AFTER).get_color()]
    assert np.concatenate(drawn) == pytest.approx(expected)
    late = drives.only(drives.first >= int(drives.last.max() // 2))
    both = strayed(replace(diagnosis, parts=diagnosis.parts._replace(tested=late)))
    assert "the first was fitted" in residual_over_time(late, both).axes[0].get_xlabel()


def test_many_episodes_become_a_median_with_a_band_and_many_paths_means_by_place(diagnosis, monkeypatch):
    drives = diagnosis.parts.fitted
    both = strayed(replace(diagnosis, parts=diagnosis.parts._replace(tested=drives)))
    (axes,) = residual_over_time(drives, both).axes
    _, middle = values(axes, DECLARED_MODEL)
    first = np.unique(both[DECLARED_MODEL].window, return_index=True)[1]
    start = drives.first[both[DECLARED_MODEL].increment[first]] / drives.tick_hz
    assert middle[0] == pytest.approx(np.median(both[DECLARED_MODEL].rms[start < 1.0]))
    assert len([band for band in axes.collections if band.get_paths()]) == 2
    monkeypatch.setattr("proxytune.report.diagnosis.error_figures.MANY_WINDOWS", 3)
    both = {DECLARED_MODEL: strayed(diagnosis)[DECLARED_MODEL]}
    shown = residual_map(diagnosis.parts.tested, both).axes[0].collections[0].get_array().compressed()
    assert 0 < len(shown) <= len(both[DECLARED_MODEL].increment)
    rms, rounding = both[DECLARED_MODEL].rms, 1e-12
    assert rms.min() * (1.0 - rounding) <= shown.min() <= shown.max() <= rms.max() * (1.0 + rounding)


def test_paths_on_the_maps_are_where_windows_were_measured_in_one_scale_and_equal_axes(diagnosis, figures):
    before, after, _ = figures["residual_map"].axes
    one, other = before.collections[0], after.collections[0]
    assert one.norm is other.norm
    assert before.get_aspect() == after.get_aspect() == 1.0
    assert (before.get_title(), after.get_title()) == (DECLARED_MODEL, AFTER)
    both = strayed(diagnosis)
    assert list(one.get_array()) == pytest.approx(both[DECLARED_MODEL].rms)
    assert list(other.get_array()) == pytest.approx(both[AFTER].rms)

    drives = diagnosis.parts.tested
    windows = cut(drives, 2.0)
    path = figures["residual_map"].axes[0].collections[0].get_segments()[3]
    rows = windows.increment[windows.window == 3]
    assert path[0] == pytest.approx(drives.poses[windows.begin[3], 0, :2])
    assert path[1:] == pytest.approx(drives.poses[rows, 1, :2])


def dots(axes):
    return [one for one in axes.get_lines() if one.get_marker() == "o"]


def test_the_ranking_holds_those_added_then_every_other_gain_best_first(diagnosis, figures):
    found, panels = diagnosis.found, figures["ranking"].axes
    others = [tried.gain for tried in found.tried if tried.effect != "dead_band" or tried.form]
    expected = ([found.adopted[0].gain], others[:SHOWN], [curve.gain for curve in found.curves[:JUDGES]])
    for axes, gains in zip(panels, expected, strict=True):
        assert [float(one.get_xdata()[0]) for one in dots(axes)] == gains
        assert [float(one.get_ydata()[0]) for one in dots(axes)] == list(range(len(gains)))
        low, high = axes.get_xlim()
        assert low <= min(gains) <= max(gains) <= high
    assert [axes.get_title(loc="left") for axes in panels] == ["added, in this order", "tried alone", "any curve over"]
    assert "dead band" not in [tick.get_text() for tick in panels[1].get_yticklabels()]
    threshold = [one for one in panels[0].get_lines() if one.get_linestyle() == ":"]
    assert list(threshold[0].get_xdata()) == [RULES.least_gain_nats, RULES.least_gain_nats]


def test_every_effect_that_was_added_is_on_top_in_the_order_of_adding_and_rivals_are_marked(diagnosis):
    (first,) = diagnosis.found.adopted
    added = (first, replace(first, effect="wheel_gain", form="left wheel", gain=40.0), replace(first, effect="new"))
    top = ranking_figure(replace(diagnosis.found, adopted=added), diagnosis.rules).axes[0]
    assert [tick.get_text() for tick in top.get_yticklabels()] == ["dead band", "wheel gain (left wheel)", "new"]
    assert {dot.get_label() for dot in dots(top)} == {"added"}
    rival = next(c for c in candidates(diagnosis.robot, diagnosis.found.declared.theta, ()) if c.effect == "stiction")
    adopted = (replace(diagnosis.found.adopted[0], rivals=(rival,)),)
    upper = motion_figures(replace(diagnosis, found=replace(diagnosis.found, adopted=adopted)))["ranking"].axes[1]
    pairs = zip([tick.get_text() for tick in upper.get_yticklabels()], dots(upper), strict=True)
    marked = {name.split(" (")[0] for name, dot in pairs if dot.get_label() == "fits as well as one added"}
    assert marked == {"stiction"}


def test_the_ranking_says_what_was_added_and_the_threshold_and_is_not_drawn_without_a_candidate(diagnosis, clean):
    axes = ranking_figure(diagnosis.found, replace(diagnosis.rules, least_gain_nats=40.0)).axes[0]
    assert "least to be added: 40 nats" in axes.get_legend_handles_labels()[1]
    figure = ranking_figure(clean.found, clean.rules)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["tried alone", "any curve over"]
    assert "ranking" not in motion_figures(replace(diagnosis, found=replace(diagnosis.found, tried=())))


def test_the_effect_curve_shows_the_dead_band_that_was_fitted_and_measured_means_agree_with_it(diagnosis, figures):
    upper = figures["effect_curve"].axes[0]
    commands, speeds = values(upper, AFTER)
    width = diagnosis.theta["dead_band.width"].value
    assert width == pytest.approx(WIDTH, rel=0.1)
    assert np.abs(commands[np.abs(speeds) < 1e-9]).max() == pytest.approx(width, abs=0.015)
    trim = diagnosis.declared["trim"].value
    commands, speeds = values(upper, DECLARED_MODEL)
    assert speeds == pytest.approx(commands * 0.6 * (1.0 - trim), abs=1e-6)
    lower = figures["effect_curve"].axes[2]
    _, effect = values(lower, AFTER)
    for label in (MEASURED, ANY):
        _, other = values(lower, label)
        assert np.abs(other - effect).max() < 0.35 * np.ptp(effect), label


def test_what_moves_one_wheel_named_or_over_a_signal_bends_the_curves_of_that_wheel_alone(diagnosis):
    weak = with_effect(diagnosis, "wheel_gain", "left wheel", {"wheel_gain.left": 0.8})
    upper_left, upper_right, left, right = effect_curve(weak).axes
    label = "with wheel gain"
    assert np.abs(values(left, label)[1]).max() > 50.0
    assert np.abs(values(right, label)[1]).max() < 5.0
    assert values(upper_left, label)[1] == pytest.approx(0.8 * values(upper_left, DECLARED_MODEL)[1], abs=1e-6)
    assert values(upper_right, label)[1] == pytest.approx(values(upper_right, DECLARED_MODEL)[1], abs=1e-6)
    curve = next(curve for curve in diagnosis.found.curves if curve.group.name == "wheel command")
    turns_right = curve.group.twists[:, :, 2].min(axis=(0, 1)) < 0.0
    pushed = curve._replace(weights=np.where(turns_right, 0.1, 0.0), gain=50.0)
    left, right, *_ = effect_curve(replace(diagnosis, found=replace(diagnosis.found, curves=(pushed,)))).axes
    assert np.interp(0.0, *values(left, ANY)) == pytest.approx(0.1 * 0.6)
    assert np.interp(0.0, *values(right, ANY)) == pytest.approx(0.0, abs=1e-6)


def test_declared_parameters_give_way_to_the_curve_that_was_fitted_with_them(diagnosis):
    declared, curve = diagnosis.found.declared, diagnosis.found.curves[0]

    def loss(theta):
        said = disturbed_increments(declared.drives, theta, curve.group.twists @ curve.weights)
        return huber(declared.whiten.whiten(declared.drives.measured - said)).sum()

    assert loss(refit_beside_curve(declared, curve)) < loss(declared.theta) - 5.0
    idle = curve._replace(weights=np.zeros_like(curve.weights))
    assert refit_beside_curve(declared, idle) == pytest.approx(dict(declared.theta), abs=0.02)


def test_panels_have_a_signal_of_their_own_and_every_motion_a_name():
    forms = [(CATALOGUE[name].trace, form.form) for name in MOTION_EFFECTS for form in EVERY if form.effect == name]
    means = [one for one in [trace.shown_in(form) for trace, form in forms] if isinstance(one, Means)]
    assert len(means) >= 6
    assert all(one.cue in CUE_PANELS and one.panels for one in means)
    assert set(MOTIONS) == set(NAMES)


EVERY = candidates(ROBOT, {}, ("trim", "delay"))
FORMS = [one for one in EVERY if one.form not in ("left wheel", "right wheel") or one.label == "dead_band (left wheel)"]


@pytest.mark.parametrize("candidate", FORMS, ids=lambda candidate: candidate.label)
def test_each_form_of_an_effect_bends_its_curve(diagnosis, candidate):
    theta = dict(candidate.fixed)
    for coordinate, probe in zip(candidate.free, candidate.probes[-2], strict=True):
        theta |= dict.fromkeys(coordinate, probe)
    figure = effect_curve(with_effect(diagnosis, candidate.effect, candidate.form, theta))
    label = f"with {candidate.effect.replace('_', ' ')}"
    bent = 0.0
    for axes in figure.axes:
        flat = (
            np.zeros_like(values(axes, label)[1])
            if len(line(axes, DECLARED_MODEL).get_ydata()) == 2
            else values(axes, DECLARED_MODEL)[1]
        )
        bent = max(bent, float(np.abs(values(axes, label)[1] - flat).max()))
    assert bent > 1e-3


@pytest.mark.parametrize("effect", RANDOM_EFFECTS)
def test_a_random_effect_shows_single_draws_that_differ(diagnosis, effect):
    (name,) = theta_names(CATALOGUE[effect])
    figure = effect_curve(with_effect(diagnosis, effect, "", {name: 0.3}))
    thin = [one.get_ydata() for one in figure.axes[0].get_lines() if one.get_linewidth() < 0.5]
    assert len(thin) > 10
    assert max(np.abs(one - thin[0]).max() for one in thin) > 0.01


def test_with_nothing_added_there_is_one_model_and_no_effect_and_idle_curves_are_not_drawn(clean, diagnosis):
    figures = motion_figures(clean)
    assert "effect_curve" not in figures
    assert len([one for one in figures["error"].axes[0].containers if isinstance(one, ErrorbarContainer)]) == 1
    assert len(figures["residual_map"].axes) == 2
    assert {one.get_color() for one in figures["residual_over_time"].axes[0].get_lines()} == {VERMILLION}
    idle = tuple(curve._replace(gain=-1.0) for curve in diagnosis.found.curves)
    slope = with_effect(
        replace(diagnosis, found=replace(diagnosis.found, curves=idle)),
        "floor_slope",
        "",
        {"floor_slope.x": 0.05, "floor_slope.y": 0.0},
    )
    for one in (slope, replace(diagnosis, found=replace(diagnosis.found, curves=idle))):
        assert all(line.get_label() != ANY for axes in effect_curve(one).axes for line in axes.get_lines())


@pytest.mark.slow
def test_an_unexplained_residual_is_drawn_over_each_signal_that_there_is(diagnosis):
    assert {group.name for group, _ in signal_groups(diagnosis.found.declared)} <= set(CUE_PANELS)
    for curve in diagnosis.found.curves:
        figure = effect_curve(without_effects(diagnosis, (curve._replace(gain=50.0),)))
        figure.draw_without_rendering()
        for axes, panel in zip(figure.axes, CUE_PANELS[curve.group.name], strict=True):
            assert axes.get_xlabel() == panel.label
            assert np.isfinite(values(axes, ANY)[1]).all()
            assert {one.get_label() for one in axes.get_lines()} == {DECLARED_MODEL, MEASURED, ANY}


KNOTS = {"speed_and_turn": ((-0.2, -1.0), (0.2, 1.0)), "direction": (-1.0,), "heading": (1.0, 2.0)}
KNOTS["place"] = ((-0.25, 0.25), (0.25, -0.25), (0.25, 0.25))
KNOTS["ramped"] = ((0.0, 0.5), (0.5, 0.0), (0.5, 0.5))
KNOTS |= dict.fromkeys(("x", "y", "tracker_x", "tracker_y"), (-0.25, 0.25))


def learning(*groups):
    curves = [
        LearntCurve(group, channel, knots, tuple(0.01 * (number + 1) for number in range(len(knots))))
        for group in groups
        for channel in GROUPS[group].channels
        for knots in [KNOTS.get(group, (0.5, 1.0, 2.0))]
    ]
    theta = learnt_theta(Learnt(FittedRange((-0.3, 0.4), (-3.0, 3.0)), tuple(curves)))
    return Learning(
        Discrepancy(theta, {GROUPS[group].title: 1.0 / len(groups) for group in groups}, {}, True), (), False
    )


@pytest.mark.slow
def test_every_group_is_drawn_without_a_warning_and_every_panel_has_units():
    figure = drawn_without_a_warning(lambda: {"learnt": learnt_figure(learning(*GROUPS))})["learnt"]
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert all("[" in axes.get_ylabel() for axes in shown)
    assert all("[" in axes.get_xlabel() for axes in shown if axes.get_xlabel())
    assert len({axes.get_xlabel() for axes in shown if axes.get_xlabel()}) == len(GROUPS) - 1  # the level is no curve


def test_what_is_learnt_is_drawn_through_its_weights_harmonics_added_up_and_nothing_where_nothing_is_used():
    figure = learnt_figure(learning("turn_rate"))
    line = figure.axes[2].get_lines()[0]
    np.testing.assert_allclose(line.get_xdata(), (0.0, 0.5, 1.0, 2.0))
    np.testing.assert_allclose(line.get_ydata(), np.degrees((0.0, 0.01, 0.02, 0.03)))
    assert learnt_figure(Learning(Discrepancy({"learnt.turn_rate.yaw@1.0": 0.1}), (), False)) is None
    figure = learnt_figure(learning("heading"))
    forward = figure.axes[0].get_lines()[0]
    around = np.radians(forward.get_xdata())
    expected = sum(10.0 * k * (np.cos(k * around) + np.sin(k * around)) for k in (1, 2))
    np.testing.assert_allclose(forward.get_ydata(), expected, atol=1e-9)


DRIVES = planted_drives(TRUTH, episodes=1, seconds=10.0)


@pytest.mark.parametrize("signal", SIGNALS[1:])
def test_every_signal_of_a_panel_is_known_at_each_increment(signal):
    rates = Rates(dict.fromkeys(MOTIONS, np.ones(len(DRIVES.measured))), {})
    assert np.isfinite(_signal(DRIVES, rates, None, Panel(signal, "", "forward"))).sum() == len(DRIVES.measured)


FIGURES = Path(proxytune.__file__).parent / "report" / "diagnosis"


def test_every_figure_that_is_drawn_has_a_title_and_a_caption_and_they_come_in_one_order_an_unknown_one_last():
    texts = [(FIGURES / name).read_text(encoding="utf-8") for name in ("figures.py", "camera_figures.py")]
    drawn = {name for text in texts for name in re.findall(r'^        "(\w+)": \w+\(', text, flags=re.M)}
    assert len(drawn) >= 10
    captions = CAPTIONS["diagnosis"]
    assert drawn == captions.keys()
    assert all(one["title"] and len(one["caption"]) > 60 for one in captions.values())
    names = [one.title for one in diagnosis_pictures({"ranking": b"", "error": b""})]
    assert names == [CAPTIONS["diagnosis"][name]["title"] for name in ("error", "ranking")]
