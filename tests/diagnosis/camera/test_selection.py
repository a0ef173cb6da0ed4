"""Planted effects of a camera are named and no others, by what leaving out costs; what frames cannot show is said."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of
from pictured import ROBOT, lane_poses, pictures
from viewed import OPTICS, at_truth, driven, everything, pushed, still, stood, tracked, views_of

from proxytune.diagnosis import ResidualField, project, rank_subsets
from proxytune.diagnosis.camera import selection
from proxytune.diagnosis.camera.fitting import fit_camera
from proxytune.diagnosis.camera.selection import fit_everything, fit_set, hidden_effects, select_camera_effects
from proxytune.driving import GroundPlaneCamera, Markings, draw_floor, lane_length, lane_point, shipped_map
from proxytune.errors import LogError

COUNT = 30
ROLLED = {"camera_roll": 4.0}


def shown():
    return pictures(ROLLED, lane_poses(COUNT))


MISTAKES = {
    "the pictures are mirrored": lambda p, s: (s[:, :, ::-1], p),
    "the pictures are upside down": lambda p, s: (s[:, ::-1, ::-1], p),
    "heading is clockwise": lambda p, s: (s, p * (1.0, 1.0, -1.0)),
    "headings are in degrees": lambda p, s: (s, p * (1.0, 1.0, np.degrees(1.0))),
    "x and y are swapped": lambda p, s: (s, p[:, (1, 0, 2)]),
    "each frame belongs to the next row": lambda p, s: (s, np.roll(p, 1, axis=0)),
    "each frame belongs to the row before": lambda p, s: (s, np.roll(p, -1, axis=0)),
}


def fitted(poses, pictures_):
    views = views_of(np.ascontiguousarray(pictures_), still(poses))
    return fit_everything(views, OPTICS.mounting, {}, learn_scatter=False)


def often(names, one):
    """Every run tries one; slow ones the others, which are done in the same way."""
    return [name if name == one else pytest.param(name, marks=pytest.mark.slow) for name in names]


@pytest.mark.parametrize("mistake", often(MISTAKES, "heading is clockwise"))
def test_a_mistake_is_refused_in_one_line_that_names_it(mistake):
    pictures_, poses = MISTAKES[mistake](tracked(lane_poses(COUNT)), shown())
    line = complaint_of(selection.check_match, "log", fitted(poses, pictures_))
    assert line.startswith("log: frames do not fit the poses: ")
    assert f"match if {mistake}; correct that" in line


@pytest.mark.slow
def test_a_mistake_is_named_where_few_frames_match_a_little_by_chance():
    """With 30 frames one row off, a camera with everything free matches 22 %."""
    poses = lane_poses(30)
    full = fitted(np.roll(tracked(poses), 1, axis=0), pictures(ROLLED, poses))
    assert selection.FEWEST_MATCHED < selection.matched_share(full) < selection.USUAL_MATCHED
    with pytest.raises(LogError, match="98 % match if each frame belongs to the next row; correct that"):
        selection.check_match("log", full)


@pytest.mark.slow
def test_frames_of_somewhere_else_are_refused_with_what_to_check_and_poses_centimetres_off_told():
    poses = np.random.default_rng(7).permutation(lane_poses(COUNT))
    with pytest.raises(LogError, match="check that frames and rows are the same instants, the map is the right one"):
        selection.check_match("log", fitted(poses, shown()))
    off = np.random.default_rng(3).normal(0.0, (0.03, 0.03, 0.0), (COUNT, 3))
    full = fitted(lane_poses(COUNT) + off, shown())
    assert selection.check_match("log", full, grey=True) == ()
    (note,) = selection.check_match("log", full)
    assert note.endswith("% of the markings' edges match (60 % or more is usual): poses or map are off by centimetres")


def test_frames_that_belong_to_their_poses_match_by_edges_near_markings():
    full = everything(ROLLED)
    assert selection.check_match("log", full) == ()
    assert selection.matched_share(full) > selection.USUAL_MATCHED
    edges = full.views.edges
    above = edges._replace(row=np.where(edges.frame == 0, 3.0, edges.row))
    less = replace(full, views=replace(full.views, edges=above))
    assert selection.matched_share(less) == pytest.approx(selection.matched_share(full), abs=0.03)
    nothing = replace(full, views=replace(full.views, edges=edges._replace(row=np.full_like(edges.row, 3.0))))
    assert selection.matched_share(nothing) == 0.0
    assert stood(ROLLED).count == len(full.state.poses)


NAMES = ("camera_pitch", "camera_roll", "lens_centre.right", "lens_centre.down", "pixel_aspect")


def linear(seed, rows=40):
    """A linear problem y = A θ + noise that stands in for a fit, A, y, and the sum of squares over 2."""
    random = np.random.default_rng(seed)
    slopes = random.normal(size=(rows, len(NAMES)))
    measured = slopes @ random.normal(size=len(NAMES)) + 0.3 * random.normal(size=rows)
    best = dict(zip(NAMES, np.linalg.lstsq(slopes, measured)[0], strict=True))
    views = SimpleNamespace(optics=SimpleNamespace(neutral=lambda name: 0.0))
    fit = SimpleNamespace(names=NAMES, theta=best, views=views, information=slopes.T @ slopes)

    def cost(effects):
        kept = [number for number, name in enumerate(NAMES) if name.split(".")[0] in effects]
        held = slopes[:, kept]
        left = measured - (held @ np.linalg.lstsq(held, measured)[0] if kept else 0.0)
        return 0.5 * float(left @ left)

    return fit, cost


EFFECTS = ("camera_pitch", "camera_roll", "lens_centre", "pixel_aspect")


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(0, 3), st.sampled_from([(), ("camera_pitch",)]))
def test_sets_come_with_the_best_first_and_lose_what_refitting_costs_where_the_problem_is_linear(seed, size, declared):
    fit, cost = linear(seed)
    sets = rank_subsets(fit, declared, size)
    for one in sets:
        assert one.loss == pytest.approx(cost((*declared, *one.effects)) - cost(EFFECTS), rel=1e-6, abs=1e-6)
    assert [one.loss for one in sets] == sorted(one.loss for one in sets)


@given(st.integers(0, 3))
def test_what_is_declared_is_never_dropped_nor_named(size):
    sets = rank_subsets(linear(0)[0], ["camera_pitch"], size)
    assert all("camera_pitch" not in one.effects for one in sets)
    assert len({one.effects for one in sets}) == len(sets) == (1, 3, 3, 1)[size]


def test_sets_keep_parameters_of_one_effect_together_and_all_effects_lose_nothing():
    assert {effect for one in rank_subsets(linear(0)[0], (), 2) for effect in one.effects} == set(EFFECTS)
    assert rank_subsets(linear(3)[0], (), len(EFFECTS))[0].loss == 0.0
    assert rank_subsets(linear(3)[0], (), len(EFFECTS) + 1) == []


def places(views):
    return 2.0 * views.edges.column / 160.0 - 1.0, 2.0 * views.edges.row / 120.0 - 1.0


def displaced(views, by):
    places = {"column": views.edges.column + by[0], "row": views.edges.row + by[1]}
    return replace(views, edges=views.edges._replace(**places))


@pytest.mark.parametrize("theta", [{}, ROLLED, pytest.param({"lens_distortion": -0.25}, marks=pytest.mark.slow)])
def test_nothing_is_left_over_of_the_right_camera(theta):
    leftover = selection.fit_residual_field(fit_set(everything(theta), ("camera_pitch", *theta)))
    assert not leftover.significant
    assert leftover.share < 0.035


def test_a_missing_effect_is_left_over_and_a_bend_outside_the_catalogue_even_with_everything_free():
    leftover = selection.fit_residual_field(fit_set(everything(ROLLED), ("camera_pitch",)))
    assert leftover.significant
    assert leftover.share > 0.1
    # A wave of 1.5 pixels up and down across the picture, as no lens of the catalogue has it.
    views = stood()
    right, _ = places(views)
    bent = displaced(views, (0.0 * right, 1.5 * np.sin(3.0 * right)))
    leftover = selection.fit_residual_field(fit_everything(bent, OPTICS.mounting, {}, learn_scatter=False))
    assert leftover.significant
    assert leftover.nats > 5.0
    assert leftover.share > 0.1


@pytest.mark.parametrize("axis", [0, 1], ids=["right", "down"])
def test_the_field_says_how_far_markings_lie_from_where_the_model_has_them(axis):
    """Markings are moved to one side on the right and to the other on the left; nothing of the camera is free."""
    views = stood()
    by = 0.8 * places(views)[0]
    moved = displaced(views, np.eye(2)[axis][:, None] * by)
    fit = fit_camera(moved, at_truth(moved), [], selection.NEAR)
    leftover = selection.fit_residual_field(fit)
    assert leftover.significant
    valid = project(moved, fit.state).valid
    assert np.corrcoef(leftover.displacement(*places(moved))[valid, axis], by[valid])[0, 1] > 0.9
    assert leftover.rms_px == pytest.approx(np.sqrt((by[valid] ** 2).mean()), rel=0.7)


@pytest.mark.slow
def test_tape_beside_its_place_is_nothing_of_the_camera_s():
    """Each line of each tile is moved by 5 mm along its edges' normals, in pixels of its place."""
    views = replace(stood(), tape_m=0.005)
    shift = np.random.default_rng(1).normal(0.0, 0.005, (4, 40))
    there = project(views, at_truth(views))
    by = shift[there.marks.line, there.marks.stretch] * there.marks.side / there.metres
    fit = fit_everything(pushed(views, by), OPTICS.mounting, {}, learn_scatter=False)
    assert not selection.fit_residual_field(fit_set(fit, ("camera_pitch",))).significant


def test_the_gate_opens_for_evidence_share_and_size_together():
    field = np.zeros((10, 2))
    assert ResidualField(10.0, 0.1, 0.3, field).significant
    assert not ResidualField(2.0, 0.1, 0.3, field).significant
    assert not ResidualField(10.0, 0.02, 0.3, field).significant
    assert not ResidualField(10.0, 0.1, 0.05, field).significant


DECLARED = ("camera_pitch",)
PLANTED = {
    "camera_roll": {"camera_roll": 4.0},
    "camera_yaw": {"camera_yaw": 5.0},
    "lens_distortion": {"lens_distortion": -0.25},
    "camera_height": {"camera_height": 0.125},
    "camera_forward": {"camera_forward": 0.1},
}


def on(name, theta, count=30, seed=3):
    """Views of a shipped map from both lanes, each driven its own way."""
    road, random = shipped_map(name), np.random.default_rng(seed)
    outer = np.arange(count) % 2 == 0
    along, step = random.random(count) * lane_length(road, outer), 0.005
    places = lane_point(road, outer, along)
    way = lane_point(road, outer, along + step) - lane_point(road, outer, along - step)
    poses = np.column_stack((places, np.arctan2(way[:, 1], way[:, 0])))
    poses = poses + random.normal(0.0, (0.03, 0.03, 0.2), poses.shape)
    figures = OPTICS.figures({**{each: OPTICS.neutral(each) for each in OPTICS.mounting}, **theta})
    shown = GroundPlaneCamera(figures, draw_floor(road)).render(poses)
    return views_of(shown, still(tracked(poses)), markings=Markings(road))


@pytest.mark.parametrize("effect", often(PLANTED, "camera_roll"))
def test_a_planted_effect_is_named(effect):
    named = select_camera_effects(everything(PLANTED[effect]), DECLARED)
    assert named.effects == (effect,)
    for name, value in PLANTED[effect].items():
        place = named.model.names.index(name)
        assert abs(named.model.theta[name] - value) < 3.0 * named.model.sd[place] + 0.01 * abs(value)


@pytest.mark.slow
def test_a_pair_an_effect_on_another_map_one_that_needs_motion_and_one_without_a_stated_scatter_are_named():
    named = select_camera_effects(everything({"camera_roll": -4.0, "lens_distortion": -0.25}), DECLARED)
    assert set(named.effects) == {"camera_roll", "lens_distortion"}
    full = fit_everything(on("horseshoe", {"camera_roll": 4.0}), OPTICS.mounting, {}, learn_scatter=False)
    assert select_camera_effects(full, DECLARED).effects == ("camera_roll",)
    named = select_camera_effects(everything({"camera_latency": 0.12}, count=40, moving=True), DECLARED)
    assert named.effects == ("camera_latency",)
    assert named.model.theta["camera_latency"] == pytest.approx(0.12, abs=0.01)
    views = replace(on("small_loop", {"camera_roll": 4.0}), position_m=0.005, heading_rad=np.radians(1.0))
    full = fit_everything(views, OPTICS.mounting, {}, learn_scatter=True)
    assert full.views.position_m < 0.0045
    assert full.views.heading_rad < np.radians(0.8)
    assert select_camera_effects(full, DECLARED).effects == ("camera_roll",)


def test_what_is_declared_is_tuned_what_is_known_held_and_nothing_named_of_a_nominal_camera():
    named = select_camera_effects(everything(ROLLED), ("camera_pitch", "camera_roll"))
    assert named.effects == ()
    assert named.declared.theta["camera_roll"] == pytest.approx(4.0, abs=0.3)
    views = on("small_loop", {}, count=20)
    names = [name for name in OPTICS.mounting if name != "lens_distortion"]
    full = fit_everything(views, names, {"rolling_shutter": 0.03, "lens_distortion": -0.01}, learn_scatter=False)
    assert (full.theta["rolling_shutter"], full.theta["lens_distortion"]) == (0.03, -0.01)
    held = fit_set(full, DECLARED)
    assert (held.theta["rolling_shutter"], held.theta["lens_distortion"]) == (0.03, -0.01)
    full = fit_everything(on("small_loop", {}), OPTICS.mounting, {}, learn_scatter=False)
    named = select_camera_effects(full, DECLARED)
    assert named.effects == ()
    assert named.model.theta["camera_pitch"] == pytest.approx(19.15, abs=0.3)
    assert named.model.names == DECLARED


def test_costs_are_least_with_everything_free_and_others_stay_neutral():
    fit = fit_set(everything(ROLLED), ("camera_pitch", "lens_centre"))
    assert fit.names == ("camera_pitch", "lens_centre.right", "lens_centre.down")
    assert fit.theta["camera_roll"] == 0.0
    assert fit.theta["camera_height"] == ROBOT.camera_figures().height_m
    full = everything(ROLLED)
    none, right = (fit_set(full, (*DECLARED, *named)) for named in ((), ROLLED))
    assert selection.cost_of(full) < selection.cost_of(none)
    assert selection.cost_of(full) == pytest.approx(selection.cost_of(right), rel=0.05)


MOTION = ("camera_latency", "rolling_shutter")


def only(views, chosen):
    return replace(views, edges=views.edges.only(chosen))


def test_frames_standing_still_or_without_edges_hide_effects_that_the_model_has_not():
    hidden = hidden_effects(everything(), ("camera_pitch",))
    assert set(MOTION) <= set(hidden)
    assert not {"camera_pitch", "camera_roll", "camera_yaw", "lens_distortion"} & set(hidden)
    views = stood(count=3)
    full = fit_everything(only(views, np.zeros(len(views.edges.row), bool)), OPTICS.mounting, {}, learn_scatter=False)
    effects = {name.split(".")[0] for name in (*OPTICS.mounting, *MOTION)}
    assert set(hidden_effects(full, ())) == effects
    full = everything()
    model = ("camera_pitch", "field_of_view", "camera_height")
    assert not set(model) & set(hidden_effects(full, model))
    assert selection.next_views((), repeated=False) == ()
    assert selection.next_views(("image_noise",), repeated=True) == ()


@pytest.mark.slow
def test_a_drive_shows_latency_a_stated_readout_is_not_hidden_and_far_markings_hide_where_the_lens_is():
    assert "camera_latency" not in hidden_effects(everything(count=40, moving=True), ("camera_pitch",))
    names, stated = (*OPTICS.mounting, "camera_latency"), {"rolling_shutter": 0.02}
    full = fit_everything(driven(), names, stated, learn_scatter=False)
    assert "rolling_shutter" not in hidden_effects(full, ("camera_pitch",))
    full = everything()
    far = only(full.views, np.linalg.norm(project(full.views, full.state).lever, axis=1) > 0.7)
    assert len(far.edges.row) > 300
    few = fit_everything(far, OPTICS.mounting, {}, learn_scatter=False)
    hidden, shown = hidden_effects(few, ("camera_pitch",)), hidden_effects(full, ("camera_pitch",))
    assert {"camera_height", "camera_forward"} <= set(hidden)
    assert not {"camera_height", "camera_forward"} & set(shown)


@pytest.mark.parametrize(
    ("hidden", "words"),
    [
        ("camera_latency", "driving bends"),
        ("blur", "driving bends"),
        ("camera_forward", "nearer than 0.4 m"),
        ("camera_yaw", "both lanes"),
        ("image_noise", "ten frames standing still"),
    ],
)
def test_the_next_views_are_those_that_show_what_was_hidden(hidden, words):
    (view,) = selection.next_views((hidden,), repeated=False)
    assert words in view
