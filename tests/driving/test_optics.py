"""A pixel of the ground-plane camera shows what lies where geometry says it looks."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from nominal_camera import CAMERA, loop_poses
from one_line import complaint_of

from proxytune.driving import COLOURS, GroundPlaneCamera, cameras as ground_plane, draw_floor, shipped_map
from proxytune.driving.optics import CAMERA_CHANNELS, SKY, ground_points, lens_rays
from proxytune.driving.road_picture import Floor

NOMINAL = replace(CAMERA, columns=64, rows=48)
ONE_PIXEL = replace(NOMINAL, columns=1, rows=1)
FLOOR = draw_floor(shipped_map("small_loop"))


def gradient_floor():
    """A floor whose red grows with x and green with y, so that a colour tells a place, and no two sides look alike."""
    side = 1024
    ramp = np.rint(np.linspace(0.0, 255.0, side))
    pixels = np.zeros((side, side, 3), dtype=np.uint8)
    pixels[..., 0], pixels[..., 1] = ramp[None, :], ramp[:, None]
    return Floor(pixels, 400.0, -0.4)


def on_map(points, pose):
    x, y, heading = pose
    cos, sin = math.cos(heading), math.sin(heading)
    return (x, y) + points @ np.array(((cos, sin), (-sin, cos)))


# figures


def test_channels_survive_the_way_there_and_back():
    assert NOMINAL.with_channels(NOMINAL.channels()) == NOMINAL
    changed = NOMINAL.with_channels([1.0, 2.0, 3.0, 0.2, 60.0, -0.1, 0.05, 0.02, -0.03, 1.1])
    assert (changed.pitch_deg, changed.roll_deg, changed.yaw_deg) == (1.0, 2.0, 3.0)
    assert (changed.height_m, changed.field_of_view_deg, changed.k1, changed.columns) == (0.2, 60.0, -0.1, 64)
    assert (changed.forward_m, changed.centre_right, changed.centre_down, changed.aspect) == (0.05, 0.02, -0.03, 1.1)
    assert len(CAMERA_CHANNELS) == len(NOMINAL.channels())


POSITIVE = ("height_m", "field_of_view_deg", "rows", "columns", "aspect")
WRONG = [("height_m", math.nan), ("field_of_view_deg", 180.0), ("centre_right", math.nan), ("pitch_deg", math.inf)]


@pytest.mark.parametrize(("name", "value"), [*WRONG, *((name, 0) for name in POSITIVE)])
def test_figures_that_no_camera_has_are_refused_in_one_line(name, value):
    assert complaint_of(lambda: replace(NOMINAL, **{name: value})).startswith("camera: ")


# where pixels look


@given(st.floats(3.0, 60.0), st.floats(0.05, 0.2))
@settings(max_examples=20)
def test_the_middle_of_the_picture_looks_down_at_the_pitch(pitch, height):
    x, y = ground_points(replace(ONE_PIXEL, pitch_deg=pitch, height_m=height))[0, 0]
    assert x == pytest.approx(0.066 + height / math.tan(math.radians(pitch)))
    assert y == pytest.approx(0.0, abs=1e-12)


def test_rows_and_columns_reach_over_the_field_of_view_which_yaw_roll_and_place_turn():
    points = ground_points(replace(NOMINAL, columns=1, rows=4801, height_m=1.0, forward_m=0.0))
    assert np.degrees(np.arctan2(1.0, points[-1, 0, 0])) == pytest.approx(19.15 + 37.5, abs=0.02)
    points = ground_points(replace(NOMINAL, pitch_deg=90.0, forward_m=0.0))
    assert np.allclose(np.diff(points[..., 1], axis=1), np.diff(points[..., 0], axis=0)[0, 0])
    assert (points[:, :32, 1] > 0).all()
    assert (points[:24, :, 0] > 0).all()
    points = ground_points(NOMINAL)
    horizon = 24 - 24 * math.tan(math.radians(19.15)) / math.tan(math.radians(37.5))
    assert np.isnan(points[: math.floor(horizon)]).all()
    assert np.isfinite(points[math.ceil(horizon) :]).all()
    straight, turned = ground_points(NOMINAL), ground_points(replace(NOMINAL, yaw_deg=10.0))
    lens = np.array([0.066, 0.0])
    cos, sin = math.cos(math.radians(10)), math.sin(math.radians(10))
    expected = (straight - lens) @ np.array([[cos, sin], [-sin, cos]]) + lens
    np.testing.assert_allclose(turned, expected, atol=1e-9)
    sky = np.isnan(ground_points(replace(NOMINAL, roll_deg=8.0))[..., 0]).sum(axis=0)
    assert sky[0] > sky[-1] + 4  # the right of the picture looks further down
    ahead = ground_points(replace(NOMINAL, forward_m=0.166)) - ground_points(NOMINAL)
    seen = np.isfinite(ahead[..., 0])
    np.testing.assert_allclose(ahead[seen], np.broadcast_to((0.1, 0.0), (seen.sum(), 2)), atol=1e-9)


@pytest.mark.parametrize("k1", [0.02, -0.02])
def test_small_distortion_is_the_plumb_bob_models(k1):
    straight, bent = (ground_points(replace(NOMINAL, pitch_deg=90.0, forward_m=0.0, k1=k)) for k in (0.0, k1))
    pixel, ray = straight / 0.108, bent / 0.108
    np.testing.assert_allclose(ray * (1.0 + k1 * (ray**2).sum(-1, keepdims=True)), pixel, atol=2e-3)
    assert np.abs(ray - pixel).max() > 0.02


@given(st.floats(-0.4, 0.2))
@settings(max_examples=20)
def test_any_distortion_keeps_the_order_of_pixels(k1):
    points = ground_points(replace(NOMINAL, pitch_deg=90.0, k1=k1))
    assert (np.diff(points[..., 1], axis=1) < 0).all()
    assert (np.diff(points[..., 0], axis=0) < 0).all()


@given(st.floats(-0.25, 0.25), st.floats(-0.25, 0.25), st.floats(0.7, 1.4), st.floats(-0.4, 0.2))
@settings(max_examples=25)
def test_the_lens_looks_along_its_axis_through_its_centre_whatever_else_it_does(right, down, aspect, k1):
    """From the picture's middle, its centre is shares of the height to the right and down: 64 × 48 pixels."""
    figures = replace(NOMINAL, centre_right=right, centre_down=down, aspect=aspect, k1=k1)
    centre = lens_rays(figures, np.array([32.0 + 48.0 * right]), np.array([24.0 + 48.0 * down]))[0]
    np.testing.assert_allclose(centre, lens_rays(NOMINAL, np.array([32.0]), np.array([24.0]))[0], atol=1e-9)


@given(st.floats(0.7, 1.4))
@settings(max_examples=20)
def test_things_look_wider_by_the_aspect_and_as_high_as_before(aspect):
    plain, wide = (ground_points(replace(NOMINAL, pitch_deg=90.0, aspect=one)) for one in (1.0, aspect))
    np.testing.assert_allclose(wide[..., 1] * aspect, plain[..., 1], atol=1e-9)
    np.testing.assert_allclose(wide[..., 0], plain[..., 0], atol=1e-9)


# what pixels show


@pytest.mark.slow
@given(st.tuples(st.floats(0.2, 1.5), st.floats(0.2, 1.5), st.floats(-7.0, 7.0)))
@settings(max_examples=25)
def test_a_pixel_shows_the_place_that_it_looks_at(pose):
    picture = GroundPlaneCamera(NOMINAL, gradient_floor()).render(np.array([pose]))[0]
    places = on_map(ground_points(NOMINAL), pose)
    inside = ((places > -0.3) & (places < 2.06)).all(axis=-1) & (np.arange(48)[:, None] > 20)
    expected = (places + 0.4) / 2.56 * 255.0
    np.testing.assert_allclose(picture[inside][:, :2], expected[inside], atol=3.0)


def test_sky_is_above_the_horizon_nothing_far_from_the_map_and_a_batch_is_as_one_after_another():
    pictures = GroundPlaneCamera(replace(NOMINAL, roll_deg=5.0), FLOOR).render(loop_poses(4))
    assert ((pictures == SKY).all(axis=-1) == np.isnan(ground_points(replace(NOMINAL, roll_deg=5.0))[..., 0])).all()
    pictures = GroundPlaneCamera(NOMINAL, FLOOR).render(np.array([[30.0, -20.0, 0.3], [-2.0, 0.5, 3.1]]))
    assert np.abs(pictures[:, 14:] - np.array(COLOURS["off_map"], dtype=float)).max() <= 3.0
    camera, poses = GroundPlaneCamera(NOMINAL, FLOOR), loop_poses(7)
    singly = np.concatenate([camera.render(poses[i : i + 1]) for i in range(7)])
    pictures = camera.render(poses)
    assert pictures.shape == (7, 48, 64, 3)
    assert pictures.dtype == np.uint8
    assert pictures.flags.c_contiguous
    np.testing.assert_array_equal(pictures, singly)


def test_blurred_copies_halve_the_aliasing_of_small_pictures(monkeypatch):
    """RMS error on the floor against 8 × 8 look-ups per pixel: 12.6 grey levels sharp, 5.4 with blurred copies."""
    poses, fine = loop_poses(12), replace(NOMINAL, columns=64 * 8, rows=48 * 8)
    blurred = GroundPlaneCamera(NOMINAL, FLOOR).render(poses).astype(float)
    monkeypatch.setattr(ground_plane, "OCTAVES", 0)
    sharp = GroundPlaneCamera(NOMINAL, FLOOR).render(poses).astype(float)
    truth = GroundPlaneCamera(fine, FLOOR).render(poses).reshape(12, 48, 8, 64, 8, 3).mean(axis=(2, 4))
    error = [np.sqrt(np.square(pictures - truth)[:, 14:].mean()) for pictures in (blurred, sharp)]
    assert error[0] < 7.0
    assert error[0] < 0.55 * error[1]
