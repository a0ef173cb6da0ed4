"""A robot is found in the lane that its heading belongs to, wherever on the map it is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.lane import lane_position, lap_length
from proxytune.driving.maps import SMALL_LOOP as ROAD

T = ROAD.tile
ON_MAP = st.floats(0.01, ROAD.side - 0.01)
ANY_HEADING = st.floats(-10.0, 10.0)


def lap_of(outer, count=4000):
    """Poses along a lane's centre line, evenly spaced, made from arcs and straights by hand."""
    radius = T / 2 + (ROAD.lane_offset if outer else -ROAD.lane_offset)
    centres = [(2 * T, T, -np.pi / 2), (2 * T, 2 * T, 0.0), (T, 2 * T, np.pi / 2), (T, T, np.pi)]
    pieces = []
    for x, y, first in centres:
        angle = first + np.linspace(0.0, np.pi / 2, 400)
        pieces.append(np.stack((x + radius * np.cos(angle), y + radius * np.sin(angle), angle + np.pi / 2), axis=1))
    corners = np.concatenate([*pieces, pieces[0][:1] + (0.0, 0.0, 2 * np.pi)])
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners[:, :2], axis=0).T))))
    at = np.linspace(0.0, along[-1], count)
    poses = np.stack([np.interp(at, along, np.unwrap(column) if i == 2 else column) for i, column in enumerate(corners.T)], 1)
    return poses if outer else (poses + (0.0, 0.0, np.pi))[::-1]


@pytest.mark.parametrize(("outer", "length"), [(True, 4.99), (False, 3.37)])
def test_laps_are_as_long_as_the_reference_says(outer, length):
    assert lap_length(ROAD, outer=outer) == pytest.approx(length, abs=0.005)


@pytest.mark.parametrize("outer", [True, False])
def test_a_lap_on_the_centre_line_is_found_there(outer):
    lane = lane_position(ROAD, lap_of(outer))
    assert (lane.outer == outer).all()
    assert np.abs(lane.deviation).max() < 1e-4
    assert np.abs(lane.heading_error).max() < 0.02
    steps = np.remainder(np.diff(lane.along) + 1.0, lap_length(ROAD, outer=outer)) - 1.0
    assert steps.min() > 0.0
    assert steps.sum() == pytest.approx(lap_length(ROAD, outer=outer), abs=1e-3)


@pytest.mark.parametrize("outer", [True, False])
@pytest.mark.parametrize("left", [0.06, -0.06])
def test_deviation_is_positive_to_the_left_of_travel(outer, left):
    poses = lap_of(outer)
    poses[:, 0] -= left * np.sin(poses[:, 2])
    poses[:, 1] += left * np.cos(poses[:, 2])
    np.testing.assert_allclose(lane_position(ROAD, poses).deviation, left, atol=2e-4)


def test_heading_error_is_positive_when_turned_to_the_left():
    np.testing.assert_allclose(lane_position(ROAD, lap_of(True) + (0, 0, 0.3)).heading_error, 0.3, atol=0.02)
    np.testing.assert_allclose(lane_position(ROAD, lap_of(False) + (0, 0, 0.3)).heading_error, 0.3, atol=0.02)


def test_the_papers_starts_are_eight_outer_and_two_inner_all_in_lane():
    starts = np.array(ROAD.starts) * (1.0, 1.0, np.pi / 180.0)
    lane = lane_position(ROAD, starts)
    assert lane.outer.sum() == 8
    assert (np.abs(lane.deviation) < ROAD.lane_width / 2).all()


@given(x=ON_MAP, y=ON_MAP, heading=ANY_HEADING)
@settings(max_examples=200, derandomize=True, deadline=None)
def test_every_pose_on_the_map_has_finite_answers_within_bounds(x, y, heading):
    lane = lane_position(ROAD, np.array((x, y, heading)))
    assert 0.0 <= lane.along <= lane.lap
    assert abs(lane.heading_error) <= np.pi / 2 + 1e-9
    assert np.isfinite(lane.deviation)


@given(x=ON_MAP, y=ON_MAP, heading=ANY_HEADING)
@settings(max_examples=100, derandomize=True, deadline=None)
def test_turning_the_map_a_quarter_changes_nothing_but_the_arc_length(x, y, heading):
    here = lane_position(ROAD, np.array((x, y, heading)))
    turned = lane_position(ROAD, np.array((ROAD.side - y, x, heading + np.pi / 2)))
    on_a_diagonal = abs(abs(x - ROAD.side / 2) - abs(y - ROAD.side / 2)) < 1e-6
    across_the_lanes = abs(abs(float(here.heading_error)) - np.pi / 2) < 1e-6
    if not (on_a_diagonal or across_the_lanes):
        assert turned.outer == here.outer
        assert turned.deviation == pytest.approx(here.deviation, abs=1e-9)
        assert turned.heading_error == pytest.approx(here.heading_error, abs=1e-9)
        moved = float(np.remainder(turned.along - here.along, here.lap))
        quarter = float(here.lap) / 4 if here.outer else 3 * float(here.lap) / 4
        assert moved == pytest.approx(quarter, abs=1e-6)
