"""Frames that do not belong to their poses are refused in one line that names the mistake."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from pictured import lane_poses, pictures
from viewed import OPTICS, everything, still, stood, tracked, views_of

from proxytune.diagnosis.camera.naming.checks import FEWEST_MATCHED, USUAL_MATCHED, check_match, matched_share
from proxytune.diagnosis.camera.naming.search import fit_everything
from proxytune.errors import LogError

COUNT = 30
ROLLED = {"camera_roll": 3.0}


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


OFTEN = ("heading is clockwise",)
"""What every run tries; the others are undone in the same way."""


@pytest.mark.parametrize(
    "mistake", [name if name in OFTEN else pytest.param(name, marks=pytest.mark.slow) for name in MISTAKES]
)
def test_a_mistake_is_refused_in_one_line_that_names_it(mistake):
    pictures_, poses = MISTAKES[mistake](tracked(lane_poses(COUNT)), shown())
    with pytest.raises(LogError) as refusal:
        check_match("log", fitted(poses, pictures_))
    line = str(refusal.value)
    assert line.startswith("log: frames do not fit the poses: ")
    assert f"match if {mistake}; correct that" in line
    assert "\n" not in line


@pytest.mark.slow
def test_a_mistake_is_named_where_few_frames_match_a_little_by_chance():
    """With 30 frames one row off, a camera with everything free matches 22 %."""
    poses = lane_poses(30)
    full = fitted(np.roll(tracked(poses), 1, axis=0), pictures(ROLLED, poses))
    assert FEWEST_MATCHED < matched_share(full) < USUAL_MATCHED
    with pytest.raises(LogError, match="98 % match if each frame belongs to the next row; correct that"):
        check_match("log", full)


@pytest.mark.slow
def test_frames_of_somewhere_else_are_refused_with_what_to_check():
    poses = np.random.default_rng(7).permutation(lane_poses(COUNT))
    with pytest.raises(LogError, match="check that frames and rows are the same instants, the map is the right one"):
        check_match("log", fitted(poses, shown()))


@pytest.mark.slow
def test_poses_three_centimetres_off_are_told():
    off = np.random.default_rng(3).normal(0.0, (0.03, 0.03, 0.0), (COUNT, 3))
    (note,) = check_match("log", fitted(lane_poses(COUNT) + off, shown()))
    assert note.endswith("% of the markings' edges match (60 % or more is usual): poses or map are off by centimetres")


def test_nothing_is_said_of_frames_that_belong_to_their_poses():
    full = everything(ROLLED)
    assert check_match("log", full) == ()
    assert matched_share(full) > USUAL_MATCHED


def test_the_share_counts_edges_near_markings_only():
    full = everything(ROLLED)
    edges = full.views.edges
    above = edges._replace(row=np.where(edges.frame == 0, 3.0, edges.row))
    assert matched_share(replace(full, views=replace(full.views, edges=above))) == pytest.approx(
        matched_share(full), abs=0.03
    )
    nothing = replace(full, views=replace(full.views, edges=edges._replace(row=np.full_like(edges.row, 3.0))))
    assert matched_share(nothing) == 0.0
    assert stood(ROLLED).count == len(full.state.poses)
