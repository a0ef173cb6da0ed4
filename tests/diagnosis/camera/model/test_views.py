"""The tape's errors each have one place, and no scatter is trusted below its least."""

import sys
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).parents[1]))
from viewed import stood

from proxytune.diagnosis.camera.model.views import LEAST_SCATTER, LEAST_TAPE_M, TILTED, Tape
from proxytune.driving.road.markings import LINES


@given(st.integers(1, 40))
def test_every_error_of_the_tape_has_a_place_of_its_own(stretches):
    tape = Tape(stretches)
    stretch, line = (each.ravel() for each in np.meshgrid(np.arange(stretches), np.arange(len(LINES))))
    shifts = tape.shift(stretch, line)
    tilts = tape.tilt(stretch[line < TILTED], line[line < TILTED])
    white, yellow = np.array([True, False, False]), np.array([0, 2, 3])
    widths = tape.width(white, yellow)
    places = np.concatenate((shifts, tilts, widths))
    assert sorted(places.tolist()) == list(range(tape.size))


def test_both_white_lines_have_one_width():
    tape = Tape(8)
    assert tape.width(np.array([True]), np.array([0])) == tape.width(np.array([True]), np.array([1]))


def test_a_tracker_and_a_map_are_never_trusted_beyond_their_least():
    views = stood(count=1).with_scatter(0.0, 0.0)
    np.testing.assert_allclose(views.pose_scatter, (LEAST_SCATTER[0], *LEAST_SCATTER))
    assert (views.tape_scatter >= LEAST_TAPE_M).all()
    np.testing.assert_allclose(views.with_scatter(0.01, 0.02).pose_scatter, (0.01, 0.01, 0.02))


def test_another_scatter_leaves_all_else_alone():
    views = stood(count=1)
    assert views.with_scatter(0.01, 0.02).edges is views.edges
    assert len(views.tape_scatter) == Tape(views.markings.stretches).size
    assert views.count == 1
