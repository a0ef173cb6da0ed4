"""The floor's picture, measured on the picture: the map's figures, distances to markings, and names of lines."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.driving import COLOURS, LINES, Markings, draw_floor, lane_length, lane_point, shipped_map
from proxytune.driving.road import Arc, Straight
from proxytune.driving.road_picture import MARGIN, painted

ROADS = {name: shipped_map(name) for name in ("small_loop", "horseshoe")}
MARKINGS = {name: Markings(road) for name, road in ROADS.items()}
BOTH = pytest.mark.parametrize("name", ROADS)
SEEDS = st.integers(0, 2**32 - 1)
STEP = 1e-6
MARKINGS_COLOURS = ("white", "yellow")


CENTRES = {
    name: replace(road, lane_offset=1e-7, segments=tuple(part for stretch in painted(road) for part in stretch))
    for name, road in ROADS.items()
}
"""The painted centre lines, as lanes of no width: bends are painted tighter than they are driven."""


class Beside(NamedTuple):
    """Places beside the centre line (n, 2), the unit vectors onwards and to the left there, and how far left (n,)."""

    places: np.ndarray
    onward: np.ndarray
    left: np.ndarray
    aside: np.ndarray


def beside(name, seed, count=200):
    """Places up to half a road's width beside the painted centre line, none nearer to another part of it."""
    road, random = CENTRES[name], np.random.default_rng(seed)
    along, step = random.random(count) * lane_length(road, True), 1e-5
    middle, aside = lane_point(road, True, along), random.uniform(-0.45, 0.45, count) * road.width
    onward = lane_point(road, True, along + step) - lane_point(road, True, along - step)
    onward /= np.linalg.norm(onward, axis=1)[:, None]
    left = np.stack((-onward[:, 1], onward[:, 0]), axis=-1)
    places = middle + aside[:, None] * left
    edge = np.abs(np.abs(aside) - (road.width - road.paint.white_width) / 2.0) - road.paint.white_width / 2.0
    own = np.abs(marks(name, "white", places).distance - edge) < 1e-6
    return Beside(places[own], onward[own], left[own], aside[own])


def marks(name, colour, places):
    return getattr(MARKINGS[name], colour)(places)


def steady(name, colour, places):
    """Where the nearest marking, and which side of it, is the same all about a place."""
    about = [marks(name, colour, places + STEP * np.array(way)) for way in ((3, 0), (-3, 0), (0, 3), (0, -3))]
    here = marks(name, colour, places)
    same = [(one.stretch == here.stretch) & (one.line == here.line) & (one.side == here.side) for one in about]
    return np.all(same, axis=0) & np.all([np.abs(one.slope - here.slope).max(axis=1) < 0.01 for one in about], axis=0)


def tolerance(here):
    """The way to a dash's end is measured along the centre line: in bends longer or shorter than beside it."""
    return np.where(here.line == LINES.index("yellow dashes"), 0.4, 1e-3)


@BOTH
@settings(max_examples=20)
@given(seed=SEEDS)
def test_distances_are_those_that_the_floor_is_painted_with(name, seed):
    places = np.random.default_rng(seed).uniform(-0.1, 1.1, (300, 2)) * ROADS[name].size
    shapes = MARKINGS[name].shapes(places)
    for colour in MARKINGS_COLOURS:
        np.testing.assert_allclose(marks(name, colour, places).distance, shapes[colour], atol=1e-9)


@BOTH
@settings(max_examples=20)
@given(seed=SEEDS)
def test_slopes_are_unit_vectors_that_finite_differences_agree_with(name, seed):
    places = beside(name, seed).places
    for colour in MARKINGS_COLOURS:
        here = marks(name, colour, places)
        slope = here.slope
        np.testing.assert_allclose(np.linalg.norm(slope, axis=1), 1.0, atol=1e-9)
        kept = steady(name, colour, places)
        assert kept.mean() > 0.8
        for axis in (0, 1):
            step = STEP * np.eye(2)[axis]
            change = marks(name, colour, places + step).distance - marks(name, colour, places - step).distance
            assert (np.abs(change / (2 * STEP) - slope[:, axis])[kept] < tolerance(here)[kept]).all()


@BOTH
@settings(max_examples=20)
@given(seed=SEEDS)
def test_side_is_the_derivative_by_a_shift_of_the_line_to_the_right(name, seed):
    """A line that moves right by a step is the same as a place that moves left by it; the ends of dashes move on."""
    road = beside(name, seed)
    for colour in MARKINGS_COLOURS:
        here = marks(name, colour, road.places)
        ends = (here.line == LINES.index("yellow dashes"))[:, None]
        shifted = marks(name, colour, road.places - STEP * np.where(ends, road.onward, -road.left)).distance
        kept = steady(name, colour, road.places)
        assert kept.mean() > 0.8
        assert (np.abs((shifted - here.distance) / STEP - here.side)[kept] < tolerance(here)[kept]).all()


@BOTH
@settings(max_examples=20)
@given(seed=SEEDS)
def test_the_left_line_lies_to_the_left_of_a_driver_who_goes_counter_clockwise(name, seed):
    road = beside(name, seed)
    line = marks(name, "white", road.places).line
    np.testing.assert_array_equal(line, np.where(road.aside > 0.0, 0, 1))
    assert [LINES[number] for number in (0, 1)] == ["left white line", "right white line"]
    assert 0 < line.mean() < 1


@BOTH
@settings(max_examples=20)
@given(seed=SEEDS)
def test_yellow_is_nearest_to_its_side_or_to_the_end_of_a_dash(name, seed):
    road = beside(name, seed)
    yellow, width = marks(name, "yellow", road.places), ROADS[name].paint.yellow_width
    side = yellow.line == LINES.index("yellow line")
    np.testing.assert_allclose(yellow.distance[side], (np.abs(road.aside) - width / 2.0)[side], atol=1e-6)
    assert (yellow.distance[~side] >= (np.abs(road.aside) - width / 2.0)[~side] - 1e-6).all()
    assert set(yellow.line) <= {2, 3}


@BOTH
def test_stretches_and_shares_follow_a_lap(name):
    road = ROADS[name]
    along = np.linspace(0.0, float(lane_length(CENTRES[name], True)), 2000, endpoint=False)
    white = marks(name, "white", lane_point(CENTRES[name], True, along))
    assert MARKINGS[name].stretches == len(road.segments)
    assert set(white.stretch) == set(range(len(road.segments)))
    change = np.diff(white.stretch)
    assert set(change) <= {0, 1, 1 - len(road.segments)}
    assert (np.diff(white.share)[change == 0] > -1e-9).all()
    assert white.share.min() >= 0.0
    assert white.share.max() <= 1.0


ROAD = shipped_map("small_loop")
TILE = ROAD.width
BEND_RADIUS, STRAIGHT_DASHES = 0.17, 9
FLOOR = draw_floor(ROAD)


def square(tiles=3, tile=TILE, **paint):
    """A square loop of so many tiles along a side."""
    edge = (Straight((tiles - 2) * tile), Arc(tile / 2, 90.0))
    begin = ((tiles - 0.5) * tile, tile, 90.0)
    size, paint = (tiles * tile,) * 2, replace(ROAD.paint, **paint)
    return replace(ROAD, size=size, begin=begin, segments=edge * 4, width=tile, paint=paint)


def texel(floor, x):
    return int((x - floor.origin) * floor.pixels_per_metre)


def cover(floor, colour):
    """How much of each texel is painted in a colour that lies on asphalt."""
    asphalt, paint = (np.array(COLOURS[name], dtype=float) for name in ("asphalt", colour))
    axis = paint - asphalt
    rest = floor.pixels - asphalt
    part = rest @ axis / (axis @ axis)
    return np.where(np.abs(rest - part[..., None] * axis).max(axis=-1) < 3.0, np.clip(part, 0.0, 1.0), 0.0)


def metres(profile):
    return profile.sum() / FLOOR.pixels_per_metre


def test_lines_are_as_wide_as_stated_and_dashes_even():
    row = cover(FLOOR, "white")[texel(FLOOR, 1.5 * TILE)]
    inner = row[texel(FLOOR, 1.9 * TILE) : texel(FLOOR, 2.5 * TILE)]
    first = texel(FLOOR, 1.9 * TILE) + np.flatnonzero(inner > 0.5)[0]
    assert metres(inner) == pytest.approx(ROAD.paint.white_width, abs=0.001)
    assert FLOOR.origin + first / FLOOR.pixels_per_metre == pytest.approx(2 * TILE, abs=0.0026)
    assert metres(row) == pytest.approx(4 * ROAD.paint.white_width, abs=0.003)

    across = cover(FLOOR, "yellow")[texel(FLOOR, 1.5 * TILE)]
    right = np.arange(across.size) > across.size // 2
    places = FLOOR.origin + (np.arange(across.size) + 0.5) / FLOOR.pixels_per_metre
    assert metres(across[right]) == pytest.approx(ROAD.paint.yellow_width, abs=0.001)
    assert np.average(places[right], weights=across[right]) == pytest.approx(2.5 * TILE, abs=0.0005)

    column = cover(FLOOR, "yellow")[texel(FLOOR, TILE) : texel(FLOOR, 2 * TILE), texel(FLOOR, 2.5 * TILE)]
    painted = column > 0.5
    starts = np.flatnonzero(~painted[:-1] & painted[1:])
    gap = TILE / (9 * 3 + 1)
    assert not painted[0]
    assert not painted[-1]
    assert len(starts) == STRAIGHT_DASHES
    assert metres(column) == pytest.approx(9 * 2 * gap, abs=0.003)
    np.testing.assert_allclose(np.diff(starts) / FLOOR.pixels_per_metre, 3 * gap, atol=0.0026)


def along_bend(road, radius, off_centre):
    """Whether each of many points on a corner tile's arc, `off_centre` [m] outside the yellow line, is painted."""
    floor = draw_floor(road)
    middle = 2.5 * TILE - radius
    angles = np.radians(np.linspace(2.0, 88.0, 400))
    points = middle + (radius + off_centre) * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return np.array([floor.pixels[texel(floor, y), texel(floor, x)] for x, y in points])


@pytest.mark.parametrize("radius", [BEND_RADIUS, TILE / 2])
def test_lines_go_round_a_corner_on_arcs_about_one_centre(radius):
    road = square(bend_radius=radius)
    middle_of_white = TILE / 2 - ROAD.paint.white_width / 2
    assert (along_bend(road, radius, middle_of_white) == COLOURS["white"]).all()
    assert (along_bend(road, radius, ROAD.lane_offset) == COLOURS["asphalt"]).all()
    assert 0.5 < (along_bend(road, radius, 0.0) == COLOURS["yellow"]).all(axis=1).mean() < 0.75


@settings(max_examples=4)
@given(st.integers(3, 5), st.floats(0.1, 0.3), st.floats(0.2, 1.0))
def test_any_loop_has_a_margin_of_nothing_around_it(tiles, tile, bend):
    road = square(tiles, tile, bend_radius=bend * tile / 2, white_width=0.02, yellow_width=0.01)
    pixels = draw_floor.__wrapped__(road).pixels
    assert len(pixels) % MARGIN == 0
    for side in (pixels[:MARGIN], pixels[-MARGIN:], pixels[:, :MARGIN], pixels[:, -MARGIN:]):
        assert (side == COLOURS["off_map"]).all()
    assert (pixels != COLOURS["off_map"]).any()
