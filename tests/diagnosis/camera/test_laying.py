"""How a map was laid is told: a line beside its place, wider lines, and a whole map that is off."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))
from pictured import ROAD
from viewed import at_truth, everything, stood

from proxytune.diagnosis.camera.laying import describe_map
from proxytune.diagnosis.camera.model.fitting import fit_camera
from proxytune.diagnosis.camera.model.projection import project
from proxytune.diagnosis.camera.naming.search import NEAR
from proxytune.driving.road.markings import LINES

STRETCH = 2


def fitted(views):
    return fit_camera(views, at_truth(views), ["camera_pitch"], NEAR)


def moved(line, by_m):
    """Views in which one line of one stretch lies so far to the right, seen driving counter-clockwise."""
    views = replace(stood(noisy=False), tape_m=0.01)
    there = project(views, at_truth(views))
    own = (there.marks.line == LINES.index(line)) & (there.marks.stretch == STRETCH)
    # The edge moves by side · by against the distance's slope; normals point into the marking, so with it
    size = np.where(own & there.near, there.marks.side * by_m / there.metres, 0.0)
    edges = views.edges
    return replace(
        views,
        edges=edges._replace(
            column=edges.column + size * edges.normal[:, 0], row=edges.row + size * edges.normal[:, 1]
        ),
    )


@pytest.mark.parametrize("line", ["left white line", "right white line", "yellow line"])
@pytest.mark.parametrize("by_m", [0.01, -0.01])
def test_a_line_ten_millimetres_beside_its_place_is_told_first(line, by_m):
    laid = describe_map(fitted(moved(line, by_m)))
    first = laid.lines[0]
    assert (first.line, first.stretch) == (line, STRETCH)
    assert first.right_m == pytest.approx(by_m, abs=0.0035)
    low, high = first.interval
    assert low < first.right_m < high
    assert low > 0.0 or high < 0.0


def test_little_is_told_of_a_map_that_lies_where_it_should():
    laid = describe_map(everything())
    assert all(abs(line.right_m) < 0.004 for line in laid.lines)
    for name, within in (("x_m", 0.004), ("y_m", 0.004), ("heading_deg", 0.5)):
        assert laid.offset[name].value == pytest.approx(0.0, abs=within)


def test_a_whole_map_fifteen_millimetres_and_a_degree_off_is_told():
    """Poses are those of a tracker whose frame has the map 15 mm to the right, 10 mm down and 1° turned."""
    views = stood()
    middle, by, turn = np.array(ROAD.size) / 2.0, np.array((0.015, -0.01)), np.radians(1.0)
    poses = views.tracks.poses
    rotation = np.array(((np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))))
    places = (poses[:, :2] - middle) @ rotation.T + middle + by
    off = replace(views, tracks=replace(views.tracks, poses=np.column_stack((places, poses[:, 2] + turn))))
    laid = describe_map(fitted(off))
    assert [laid.offset[name].value for name in ("x_m", "y_m")] == pytest.approx([0.015, -0.01], abs=0.002)
    assert laid.offset["heading_deg"].value == pytest.approx(1.0, abs=0.2)
    for name, truth in (("x_m", 0.015), ("y_m", -0.01), ("heading_deg", 1.0)):
        low, high = laid.offset[name].interval
        assert low < truth < high
    assert [laid.offset[name].unit for name in ("x_m", "y_m", "heading_deg")] == ["m", "m", "deg"]


def test_wider_white_lines_are_told_as_such():
    views = replace(stood(noisy=False), tape_m=0.005)
    there = project(views, at_truth(views))
    out = np.where(views.edges.white & there.near, -0.002 / there.metres, 0.0)
    wider = replace(
        views,
        edges=views.edges._replace(
            column=views.edges.column + out * views.edges.normal[:, 0],
            row=views.edges.row + out * views.edges.normal[:, 1],
        ),
    )
    before, after = (describe_map(fitted(each)).widths["white lines"].value for each in (views, wider))
    assert after - before == pytest.approx(0.004, abs=0.001)


def test_the_farthest_line_comes_first():
    fit = everything()
    tape = np.zeros_like(fit.state.tape)
    tape[[0, 1, 2]] = 0.03, -0.06, 0.04
    laid = describe_map(replace(fit, state=replace(fit.state, tape=tape)))
    assert [(line.line, line.right_m) for line in laid.lines] == [
        ("right white line", -0.06),
        ("yellow line", 0.04),
        ("left white line", 0.03),
    ]
