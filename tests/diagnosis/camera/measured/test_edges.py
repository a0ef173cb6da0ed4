"""Edges of markings are found to a tenth of a pixel, with the marking's side, and nowhere else."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).parents[1]))
from pictured import lane_poses, pictures

from proxytune.diagnosis.camera.measured.edges import BORDER, SKY_MARGIN, find_edges
from proxytune.driving.cameras import SKY
from proxytune.driving.road.texture import COLOURS

ROWS, COLUMNS, FINE = 60, 80, 6
FLOOR, WHITE, YELLOW = (np.array(COLOURS[name], dtype=float) for name in ("asphalt", "white", "yellow"))


def striped(angle, offset, paint=WHITE, half_width=6.0):
    """Floor with a stripe of paint across: its normal's direction [rad], its middle beside the picture's [pixel]."""
    normal = np.array((np.cos(angle), np.sin(angle)))
    down, right = np.mgrid[: ROWS * FINE, : COLUMNS * FINE] / FINE + 0.5 / FINE
    away = (right - COLUMNS / 2.0) * normal[0] + (down - ROWS / 2.0) * normal[1] - offset
    fine = np.clip(0.5 + (half_width - np.abs(away)) * FINE, 0.0, 1.0)
    cover = fine.reshape(ROWS, FINE, COLUMNS, FINE).mean(axis=(1, 3))
    return np.rint(FLOOR + cover[..., None] * (paint - FLOOR)).astype(np.uint8)[None]


def yellow_striped(angle, offset):
    """A yellow stripe, and something white in a corner: whiteness is what yellow is measured by."""
    shown = striped(angle, offset, YELLOW)
    shown[:, :9, :9] = WHITE
    return shown


def along_normal(edges, angle, offset):
    """How far each edge point lies from the stripe's middle, and how much its normal points away from there."""
    normal = np.array((np.cos(angle), np.sin(angle)))
    place = np.stack((edges.column - COLUMNS / 2.0, edges.row - ROWS / 2.0), axis=-1)
    return place @ normal - offset, edges.normal @ normal


ANGLES, OFFSETS = st.floats(0.0, 2.0 * np.pi), st.floats(-4.0, 4.0)


@settings(deadline=None, max_examples=15)
@given(ANGLES, OFFSETS)
def test_a_straight_edge_is_found_within_a_tenth_of_a_pixel_at_any_angle(angle, offset):
    """Standard deviation, largest at 45°; the whole edge lies within a twentieth, single points within a fifth."""
    edges = find_edges(striped(angle, offset))
    away, _ = along_normal(edges, angle, offset)
    off = np.abs(away) - 6.0
    assert edges.white.all()
    assert len(away) > 80
    assert abs(off.mean()) < 0.06
    assert off.std() < 0.125
    assert np.abs(off).max() < 0.2


@settings(deadline=None, max_examples=15)
@given(ANGLES, OFFSETS, st.booleans())
def test_normals_are_unit_vectors_from_the_floor_into_the_marking(angle, offset, white):
    edges = find_edges(striped(angle, offset) if white else yellow_striped(angle, offset))
    edges = edges.only((edges.white == white) & (np.maximum(edges.column, edges.row) > 12.0))
    away, outward = along_normal(edges, angle, offset)
    assert len(away) > 80
    np.testing.assert_allclose(np.linalg.norm(edges.normal, axis=1), 1.0, atol=1e-6)
    assert (-np.sign(away) * outward > np.cos(np.radians(8.0))).all()


def test_a_yellow_stripe_has_yellow_edges_as_far_out_on_either_side():
    """Strong yellow is not clipped, which would move its edges outwards by 0.2 pixels and make the tape look wider."""
    edges = find_edges(yellow_striped(0.3, 1.0))
    yellow = edges.only(~edges.white)
    away, _ = along_normal(yellow, 0.3, 1.0)
    assert len(away) > 80
    sides = [np.abs(away[way * away > 0.0]).mean() - 6.0 for way in (-1.0, 1.0)]
    assert sides == pytest.approx([0.0, 0.0], abs=0.03)
    assert sides[0] == pytest.approx(sides[1], abs=0.03)


@pytest.mark.parametrize("level", [0, 20, 128, 255])
def test_nothing_is_found_in_a_flat_picture(level):
    edges = find_edges(np.full((2, ROWS, COLUMNS, 3), level, dtype=np.uint8))
    assert [len(field) for field in edges] == [0] * 5


def test_faint_noise_is_no_edge():
    noise = np.random.default_rng(1).normal(0.0, 2.0, (1, ROWS, COLUMNS, 3))
    shown = np.clip(striped(0.3, 0.0) + noise, 0, 255).astype(np.uint8)
    away, _ = along_normal(find_edges(shown), 0.3, 0.0)
    assert np.abs(np.abs(away) - 6.0).max() < 0.4


def test_edges_of_the_sky_are_left_out():
    shown = striped(0.0, 0.0)
    shown[:, :20] = SKY
    edges = find_edges(shown)
    assert len(edges.row) > 60
    assert edges.row.min() > 20 + SKY_MARGIN
    away, outward = along_normal(edges, 0.0, 0.0)
    assert np.abs(np.abs(away) - 6.0).max() < 0.1
    assert (np.abs(outward) > 0.99).all()


def test_a_picture_of_nothing_but_sky_has_no_edges():
    assert len(find_edges(np.full((1, ROWS, COLUMNS, 3), SKY, dtype=np.uint8)).row) == 0


def test_edges_at_the_picture_s_border_are_left_out():
    edges = find_edges(striped(np.pi / 2.0, -27.0, half_width=2.5))
    assert edges.row.min() >= BORDER
    assert len(find_edges(striped(0.0, -COLUMNS / 2.0, half_width=1.0)).row) == 0


def test_points_are_sorted_by_picture_and_each_picture_counts_for_itself():
    shown = pictures({}, lane_poses(4), columns=96)
    edges = find_edges(shown)
    assert (np.diff(edges.frame) >= 0).all()
    assert set(edges.frame) == {0, 1, 2, 3}
    alone, own = find_edges(shown[2:3]), edges.only(edges.frame == 2)
    np.testing.assert_array_equal(alone.column, own.column)
    np.testing.assert_array_equal(alone.white, own.white)


def test_pictures_with_red_and_blue_swapped_keep_the_white_edges_and_lose_the_yellow_ones():
    shown = pictures({}, lane_poses(6))
    right, swapped = find_edges(shown), find_edges(np.ascontiguousarray(shown[..., ::-1]))
    floor_only = swapped.only(swapped.row > 50)
    assert (~right.only(right.row > 50).white).sum() > 100
    assert (~floor_only.white).sum() == 0
    white = right.only(right.white & (right.row > 50))
    known = {(int(f), round(float(c), 1), round(float(r), 1)) for f, _, c, r, _ in zip(*white, strict=True)}
    again = {(int(f), round(float(c), 1), round(float(r), 1)) for f, _, c, r, _ in zip(*floor_only, strict=True)}
    assert len(known & again) > 0.6 * len(known)


def test_brightness_does_not_move_edges():
    shown = striped(0.4, 1.0)
    dark = (shown * 0.4).astype(np.uint8)
    away, _ = along_normal(find_edges(dark), 0.4, 1.0)
    assert len(away) > 80
    assert np.abs(np.abs(away) - 6.0).max() < 0.2
