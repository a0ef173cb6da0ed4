"""The document, figures and sentences of a camera's diagnosis, on frames whose camera is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pictured import ROBOT
from readable import assert_readable, drawn_without_a_warning

from proxytune.diagnosis import Blemish, CameraEffect, Estimate, LaidLine, LaidMap
from proxytune.diagnosis.camera import error as weighing
from proxytune.diagnosis.camera.appearance import look_at
from proxytune.diagnosis.camera.diagnose import conclude, diagnose_camera
from proxytune.logs import read_log
from proxytune.report.diagnosis.camera_figures import (
    camera_figures,
    camera_models,
    displacement_figure,
    measured_displacements,
    outline_field,
)
from proxytune.report.diagnosis.camera_notes import camera_headline, camera_notes
from proxytune.report.diagnosis.document import camera_document
from proxytune.report.diagnosis.error_figures import DECLARED_MODEL

AFTER = "with camera roll"


@pytest.fixture(scope="module")
def diagnosis(rolled_frames):
    found = diagnose_camera(read_log(rolled_frames), ROBOT, ("camera_pitch", "blur"))
    assert [effect.effect for effect in found.effects] == ["camera_roll"]
    return found


@pytest.fixture(scope="module")
def clean(diagnosis):
    """The same frames, as if nothing had been added."""
    named = replace(diagnosis.named, declared=diagnosis.named.model, effects=())
    return replace(diagnosis, verdict="nothing missing", effects=(), named=named)


@pytest.fixture(scope="module")
def figures(diagnosis):
    return drawn_without_a_warning(lambda: camera_figures(diagnosis))


def leaves(value):
    if isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from leaves(one)
    else:
        yield value


def test_the_document_has_plain_finite_numbers_and_no_floor_of_brightness_where_none_is_known(diagnosis):
    blemish = Blemish((np.int64(3), 9), (2, 8), np.float32(0.5), 0.01)
    endless = {"camera_roll": Estimate(4.0, (-np.inf, np.float64(np.nan)), "deg")}
    document = camera_document(replace(diagnosis, theta=endless, blemishes=(blemish,)))
    assert document["effects"][0]["parameters"]["camera_roll"]["interval"] == [None, None]
    told = list(leaves(document))
    assert {type(leaf) for leaf in told} <= {float, int, str, bool, type(None)}
    assert all(math.isfinite(leaf) for leaf in told if isinstance(leaf, float))
    assert sum(isinstance(leaf, float) for leaf in told) > 50
    document = camera_document(diagnosis)
    assert document["grey_error"]["noise_floor"] is None
    assert 0.0 < document["error"]["noise_floor"] <= document["error"]["after"]


@pytest.mark.slow
def test_effects_that_do_not_matter_are_told_with_the_values_they_had(diagnosis, monkeypatch):
    monkeypatch.setattr(weighing, "MATERIAL", math.inf)
    weighed = weighing.weigh_effects(diagnosis.named, 1)
    look = look_at(diagnosis.gathered, weighed.named.model)
    dropped = conclude(diagnosis.gathered, weighed, look, DECLARED_MODEL, (), 1)
    document = camera_document(dropped)
    assert "camera_roll" not in document["extended"]
    low, high = document["immaterial"][0]["parameters"]["camera_roll"]["interval"]
    assert low < 4.0 < high < 6.0
    assert any(line.startswith("detectable but immaterial: camera_roll 4.") for line in camera_notes(dropped))


def test_four_figures_for_a_column_say_what_they_show_in_which_unit(figures):
    assert set(figures) == {"camera_markings", "camera_displacement", "camera_ranking", "camera_error"}
    assert_readable(*figures.values())
    for name in ("camera_markings", "camera_displacement"):
        labels = {(axes.get_xlabel(), axes.get_ylabel()) for axes in figures[name].axes}
        assert {"column [px]", "row [px]"} <= {label for pair in labels for label in pair}
    (ranking,) = figures["camera_ranking"].axes
    assert "[nats]" in ranking.get_xlabel()
    place, grey = figures["camera_error"].axes
    assert place.get_ylabel() == "displacement\nof markings [px]"
    assert grey.get_ylabel() == "difference in brightness\n[grey levels]"


def test_the_markings_are_drawn_before_and_after_and_every_frame_kept_aside_has_its_errors(figures, clean, diagnosis):
    titles = [axes.get_title() for axes in figures["camera_markings"].axes]
    assert [title.split(",")[0] for title in titles] == [DECLARED_MODEL, AFTER] * 2
    assert all(axes.images and axes.collections for axes in figures["camera_markings"].axes)
    assert len(camera_figures(clean)["camera_markings"].axes) == 2
    for axes, error in zip(figures["camera_error"].axes, (diagnosis.pixels, diagnosis.grey), strict=True):
        before, after = (line for line in axes.get_lines() if line.get_marker() == ".")
        known = np.isfinite(error.before.frames)
        assert sorted(before.get_ydata()) == list(before.get_ydata())
        assert sorted(before.get_ydata()) == pytest.approx(sorted(error.before.frames[known]))
        assert sorted(after.get_ydata()) == pytest.approx(sorted(error.after.frames[known]))
    (axes, _) = camera_figures(clean)["camera_error"].axes
    assert [line.get_marker() for line in axes.get_lines()].count(".") == 1


def test_outlines_lie_on_the_edges_and_displaced_edges_are_drawn_where_they_went(diagnosis):
    edges, distances = diagnosis.named.full.views.edges, {}
    for name, fit in camera_models(diagnosis).items():
        own = (edges.frame == 4) & ~edges.white
        field = outline_field(fit, 4, white=False)[2]
        at = np.abs(field[edges.row[own].astype(int), edges.column[own].astype(int)])
        distances[name] = np.nanmedian(at)
    assert 4.0 * distances[AFTER] < 2.0 < distances[DECLARED_MODEL]
    fit = diagnosis.named.model
    edges = fit.views.edges
    moved = replace(fit, views=replace(fit.views, edges=edges._replace(row=edges.row + 0.5)))
    there, here = (np.median(measured_displacements(one).lengths, axis=0) for one in (moved, fit))
    assert there - here == pytest.approx((0.0, 0.5), abs=0.2)


def test_arrows_after_are_shorter_on_the_same_scale_and_what_is_fixed_to_the_camera_points_as_they_do(diagnosis):
    before, after, *_ = (axes.collections[0] for axes in displacement_figure(diagnosis).axes)
    assert before.scale == after.scale
    assert np.hypot(after.U, after.V).mean() < 0.3 * np.hypot(before.U, before.V).mean()
    measured, _, fixed, _ = (axes.collections[0] for axes in displacement_figure(diagnosis).axes)
    agreement = (measured.U * fixed.U + measured.V * fixed.V).sum()
    assert agreement > 0.3 * np.hypot(measured.U, measured.V) @ np.hypot(fixed.U, fixed.V)


def test_the_ranking_holds_every_loss_against_that_of_nothing_added(diagnosis, figures):
    (axes,) = figures["camera_ranking"].axes
    dots = [line for line in axes.get_lines() if line.get_marker() == "o"]
    assert [float(dot.get_xdata()[0]) for dot in dots] == [max(one.loss, 0.0) for one in diagnosis.candidates]
    nothing = next(line for line in axes.get_lines() if line.get_label() == "nothing added")
    assert nothing.get_xdata()[0] > 10.0 * diagnosis.candidates[0].loss
    assert axes.get_yticklabels()[0].get_text() == "camera roll"
    assert dots[0].get_label() == "added"


def test_a_headline_says_what_the_verdict_means_and_notes_tell_what_was_found_where_and_how_large(diagnosis, clean):
    lines = (LaidLine("yellow line", 3, -0.006, (-0.008, -0.004)), LaidLine("yellow dashes", 1, 0.004, (0.002, 0.006)))
    none = Estimate(0.0, (-0.001, 0.001), "m")
    turned = Estimate(0.5, (0.4, 0.6), "deg")
    laid = LaidMap(
        {"x_m": none, "heading_deg": turned}, lines, {"white lines": Estimate(-0.003, (-0.004, -0.002), "m")}
    )
    told = camera_notes(replace(diagnosis, laid=laid))
    assert "the yellow line of stretch 3 lies 6 mm (4 to 8) to the left of its place, driving counter-clockwise" in told
    assert "the yellow dashes of stretch 1 lie 4 mm (2 to 6) ahead of their place, driving counter-clockwise" in told
    assert "white lines are 3.0 mm narrower than on the map" in told
    assert "the whole map lies off by 0.50° in heading" in told

    told = camera_notes(replace(diagnosis, blemishes=(Blemish((60, 95), (60, 71), 0.0, 0.05),)))
    assert "something covers the lower right of the picture: columns 60 to 95, rows 60 to 71 of 96 × 72" in told

    gate = replace(diagnosis.residual_fields[0], nats=100.0, share=0.2)
    still_open = replace(diagnosis, residual_fields=(gate, gate))
    (note,) = [line for line in camera_notes(still_open) if line.startswith("left over")]
    assert f"{diagnosis.residual_fields[0].rms_px:.2f} px" in note
    assert "no physics yet" in note

    sizes = {"defocus": 1.25, "vignetting": 1.5, "image_noise": None}
    looks = tuple(CameraEffect(name, (name,), None, size, ()) for name, size in sizes.items())
    told = camera_notes(replace(diagnosis, effects=(*diagnosis.effects, *looks)))
    assert "added defocus: without it the error in brightness grows by 25 %" in told
    assert "added vignetting: without it the error in brightness grows by 50 %" in told
    assert "added image_noise, which no model can predict pixel by pixel" in told

    (roll,) = diagnosis.effects
    told = camera_notes(replace(diagnosis, effects=(replace(roll, rivals=("camera_yaw", "heading_offset")),)))
    assert told[0].endswith("; these frames fit camera_yaw, heading_offset as well")
    (against, *_) = camera_notes(replace(diagnosis, effects=(replace(roll, nats=-9.6, error_without=1.43),)))
    assert against == (
        "added camera_roll: log-likelihood gain −10 nats, so the frames fitted speak against it; it is kept for frames "
        "that were not fitted: without it the displacement of markings grows by 43 %"
    )
    assert camera_headline("mine", clean) == "mine: camera: nothing missing: the declared camera explains the frames"
