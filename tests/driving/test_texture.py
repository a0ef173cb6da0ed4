"""The floor's picture has the map's figures: measured on the picture, not on the code that draws it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.road.reading import shipped_map
from proxytune.driving.road.segments import Arc, Straight
from proxytune.driving.road.texture import COLOURS, MARGIN, draw_floor

ROAD = shipped_map("small_loop")
TILE = ROAD.width
BEND_RADIUS, STRAIGHT_DASHES, BEND_DASHES = 0.17, 9, 6
FLOOR = draw_floor(ROAD)


def square(tiles=3, tile=TILE, **paint):
    """A square loop of so many tiles along a side."""
    edge = (Straight((tiles - 2) * tile), Arc(tile / 2, 90.0))
    begin = ((tiles - 0.5) * tile, tile, 90.0)
    return replace(
        ROAD, size=(tiles * tile,) * 2, begin=begin, segments=edge * 4, width=tile, paint=replace(ROAD.paint, **paint)
    )


SMALL = square(tile=0.3, bend_radius=0.1)


def texel(floor, x):
    return int((x - floor.origin) * floor.pixels_per_metre)


def colour_at(floor, x, y):
    return tuple(int(value) for value in floor.pixels[texel(floor, y), texel(floor, x)])


def cover(floor, colour):
    """How much of each texel is painted in a colour that lies on asphalt."""
    asphalt, paint = (np.array(COLOURS[name], dtype=float) for name in ("asphalt", colour))
    axis = paint - asphalt
    rest = floor.pixels - asphalt
    part = rest @ axis / (axis @ axis)
    beside = np.abs(rest - part[..., None] * axis).max(axis=-1)
    return np.where(beside < 3.0, np.clip(part, 0.0, 1.0), 0.0)


def metres(profile):
    return profile.sum() / FLOOR.pixels_per_metre


def test_drawing_twice_gives_the_same_bytes():
    assert draw_floor.__wrapped__(SMALL).pixels.tobytes() == draw_floor.__wrapped__(SMALL).pixels.tobytes()


@pytest.mark.parametrize(
    ("x", "y", "colour"),
    [
        (1.5 * TILE, 1.5 * TILE, "asphalt"),  # the middle of the map
        (2.5 * TILE + 0.13, 1.5 * TILE, "asphalt"),  # the outer lane
        (3 * TILE - 0.024, 1.5 * TILE, "white"),
        (2 * TILE + 0.024, 1.5 * TILE, "white"),
        (2.5 * TILE, 1.5 * TILE, "yellow"),
        (0.02, 0.02, "asphalt"),  # beyond the bend, but still on the corner tile
        (-0.01, 1.0, "off_map"),
        (1.0, 3 * TILE + 0.01, "off_map"),
    ],
)
def test_a_place_has_its_colour(x, y, colour):
    assert colour_at(FLOOR, x, y) == COLOURS[colour]


def test_the_loop_looks_the_same_from_all_four_sides():
    np.testing.assert_array_equal(FLOOR.pixels, np.rot90(FLOOR.pixels))
    np.testing.assert_array_equal(FLOOR.pixels, FLOOR.pixels[::-1])


def test_white_lines_are_as_wide_as_stated_and_end_with_their_tile():
    row = cover(FLOOR, "white")[texel(FLOOR, 1.5 * TILE)]
    inner = row[texel(FLOOR, 1.9 * TILE) : texel(FLOOR, 2.5 * TILE)]
    first = texel(FLOOR, 1.9 * TILE) + np.flatnonzero(inner > 0.5)[0]
    assert metres(inner) == pytest.approx(ROAD.paint.white_width, abs=0.001)
    assert FLOOR.origin + first / FLOOR.pixels_per_metre == pytest.approx(2 * TILE, abs=0.0026)
    assert metres(row) == pytest.approx(4 * ROAD.paint.white_width, abs=0.003)


def test_the_yellow_line_is_as_wide_as_stated_and_in_the_middle_of_the_road():
    across = cover(FLOOR, "yellow")[texel(FLOOR, 1.5 * TILE)]
    right = np.arange(across.size) > across.size // 2
    places = FLOOR.origin + (np.arange(across.size) + 0.5) / FLOOR.pixels_per_metre
    assert metres(across[right]) == pytest.approx(ROAD.paint.yellow_width, abs=0.001)
    assert np.average(places[right], weights=across[right]) == pytest.approx(2.5 * TILE, abs=0.0005)


def test_a_straight_tile_has_its_dashes_evenly_and_a_gap_at_either_end():
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
    return np.array([colour_at(floor, *point) for point in points])


@pytest.mark.parametrize("radius", [BEND_RADIUS, TILE / 2])
def test_lines_go_round_a_corner_on_arcs_about_one_centre(radius):
    road = square(bend_radius=radius)
    middle_of_white = TILE / 2 - ROAD.paint.white_width / 2
    assert (along_bend(road, radius, middle_of_white) == COLOURS["white"]).all()
    assert (along_bend(road, radius, ROAD.lane_offset) == COLOURS["asphalt"]).all()
    yellow = (along_bend(road, radius, 0.0) == COLOURS["yellow"]).all(axis=1)
    assert 0.5 < yellow.mean() < 0.75


def test_half_a_tile_of_corner_radius_gives_arcs_about_the_inner_corner():
    road = square(bend_radius=TILE / 2)
    angles = np.radians(np.linspace(1.0, 89.0, 200))
    for distance in (ROAD.paint.white_width / 2, TILE - ROAD.paint.white_width / 2):
        for angle in angles:
            x, y = 2 * TILE + distance * np.cos(angle), 2 * TILE + distance * np.sin(angle)
            assert colour_at(draw_floor(road), x, y) == COLOURS["white"]


def test_a_corner_tile_has_its_dashes():
    yellow = cover(FLOOR, "yellow") > 0.5
    whole = yellow.sum() / FLOOR.pixels_per_metre**2 / ROAD.paint.yellow_width
    straight_gap = TILE / (9 * 3 + 1)
    length = 2 * (TILE / 2 - BEND_RADIUS) + BEND_RADIUS * np.pi / 2
    corner_gap = length / (BEND_DASHES * 3 + 1)
    expected = 4 * (STRAIGHT_DASHES * 2 * straight_gap + BEND_DASHES * 2 * corner_gap)
    assert whole == pytest.approx(expected, rel=0.03)


@settings(max_examples=8, derandomize=True, deadline=None)
@given(st.integers(3, 5), st.floats(0.1, 0.3), st.floats(0.2, 1.0))
def test_any_loop_has_a_margin_of_nothing_around_it(tiles, tile, bend):
    road = square(tiles, tile, bend_radius=bend * tile / 2, white_width=0.02, yellow_width=0.01)
    pixels = draw_floor.__wrapped__(road).pixels
    assert len(pixels) % MARGIN == 0
    for side in (pixels[:MARGIN], pixels[-MARGIN:], pixels[:, :MARGIN], pixels[:, -MARGIN:]):
        assert (side == COLOURS["off_map"]).all()
    assert (pixels != COLOURS["off_map"]).any()
