"""The gate is closed for the right camera, and for tape beside its place, and open for a lens that nobody has."""

import functools
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from viewed import OPTICS, at_truth, everything, stood

from proxytune.diagnosis.camera.model.fitting import fit_camera
from proxytune.diagnosis.camera.model.projection import project
from proxytune.diagnosis.camera.naming.gate import Leftover, find_leftover
from proxytune.diagnosis.camera.naming.search import NEAR, fit_everything, fit_set

COUNT = 60


def places(views):
    return 2.0 * views.edges.column / 160.0 - 1.0, 2.0 * views.edges.row / 120.0 - 1.0


def bend(views):
    """A wave of 1.5 pixels up and down across the picture, as no lens of the catalogue has it."""
    right, _ = places(views)
    return 0.0 * right, 1.5 * np.sin(3.0 * right)


def displaced(views, by):
    right, down = by
    edges = views.edges
    return replace(views, edges=edges._replace(column=edges.column + right, row=edges.row + down))


@functools.cache
def bent():
    views = stood(count=COUNT)
    return fit_everything(displaced(views, bend(views)), OPTICS.mounting, {}, learn_scatter=False)


@pytest.mark.parametrize("theta", [{}, {"camera_roll": 4.0}, {"lens_distortion": -0.25}], ids=str)
def test_nothing_is_left_over_of_the_right_camera(theta):
    full = everything(theta, count=COUNT)
    leftover = find_leftover(fit_set(full, ("camera_pitch", *theta)))
    assert not leftover.open
    assert leftover.share < 0.035


def test_a_missing_effect_is_left_over():
    leftover = find_leftover(fit_set(everything({"camera_roll": 4.0}, count=COUNT), ("camera_pitch",)))
    assert leftover.open
    assert leftover.share > 0.1


def test_a_bend_that_the_catalogue_does_not_have_is_left_over_with_everything_free():
    leftover = find_leftover(bent())
    assert leftover.open
    assert leftover.nats > 5.0
    assert leftover.share > 0.1


@pytest.mark.parametrize("axis", [0, 1], ids=["right", "down"])
def test_the_field_says_how_far_markings_lie_from_where_the_model_has_them(axis):
    """Markings are moved to one side on the right and to the other on the left; nothing of the camera is free."""
    views = stood(count=COUNT)
    by = 0.8 * places(views)[0]
    moved = displaced(views, np.eye(2)[axis][:, None] * by)
    fit = fit_camera(moved, at_truth(moved), [], NEAR)
    leftover = find_leftover(fit)
    assert leftover.open
    valid = project(moved, fit.state).valid
    found = leftover.displacement(*places(moved))[valid, axis]
    assert np.corrcoef(found, by[valid])[0, 1] > 0.9
    assert leftover.rms_px == pytest.approx(np.sqrt((by[valid] ** 2).mean()), rel=0.7)


def test_tape_beside_its_place_is_nothing_of_the_camera_s():
    """Each line of each tile is moved by 5 mm along its edges' normals, in pixels of its place."""
    views = replace(stood(count=COUNT), tape_m=0.005)
    shift = np.random.default_rng(1).normal(0.0, 0.005, (4, 40))
    there = project(views, at_truth(views))
    by = shift[there.marks.line, there.marks.stretch] * there.marks.side / there.metres
    moved = displaced(views, (views.edges.normal * by[:, None]).T)
    fit = fit_everything(moved, OPTICS.mounting, {}, learn_scatter=False)
    assert not find_leftover(fit_set(fit, ("camera_pitch",))).open


def test_the_gate_opens_for_evidence_share_and_size_together():
    field = np.zeros((10, 2))
    assert Leftover(10.0, 0.1, 0.3, field).open
    assert not Leftover(2.0, 0.1, 0.3, field).open
    assert not Leftover(10.0, 0.02, 0.3, field).open
    assert not Leftover(10.0, 0.1, 0.05, field).open


def test_a_field_of_nought_displaces_nothing():
    leftover = Leftover(0.0, 0.0, 0.0, np.zeros((10, 2)))
    np.testing.assert_array_equal(leftover.displacement(np.array([0.3]), np.array([-0.2])), np.zeros((1, 2)))
