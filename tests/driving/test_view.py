"""The newest picture is what the image effects make of all that the camera saw, to the bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nominal_camera import CAMERA

from proxytune.driving.ground_plane import GroundPlaneCamera
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.road.texture import draw_floor
from proxytune.driving.view import View
from proxytune.effects import Chain, Setting
from proxytune.effects.sight.shutter import Blur, CameraLatency, RollingShutter

FIGURES = {"camera_rate": 15.0, "camera_rows": float(CAMERA.rows), "camera_columns": float(CAMERA.columns)}
EVERY = 4
POSES = np.array([(0.9 + 0.004 * tick, 0.2, 0.02 * tick) for tick in range(25)])
GROUND_PLANE = GroundPlaneCamera(CAMERA, draw_floor(shipped_map("small_loop")))


class Plain:
    """A camera that can do no more than render, and counts its pictures."""

    def __init__(self):
        self.rendered = 0

    def render(self, poses):
        self.rendered += len(poses)
        return GROUND_PLANE.render(poses)


def setting(rest):
    return Setting(60.0, rest, FIGURES, seed=4)


def pictures_of(camera, effects, lengths=(3,) * 8):
    """Every new picture on the way along POSES, of which so many are passed by at a time, the start first."""
    view, passed = View(camera, Chain(effects), setting(POSES[0])), 1
    shown = [view.picture]
    for length in lengths:
        view.pass_by(POSES[passed : passed + length])
        passed += length
        shown += [view.picture] if view.picture is not shown[-1] else []
    return np.array(shown)


def expected(effects):
    """The same from all pictures at once, every one developed."""
    rendered = GROUND_PLANE.render(POSES).reshape(len(POSES), -1).astype(np.float32)
    chain = Chain(effects)
    developed, _ = chain.apply(rendered, chain.begin(setting(rendered[0])))
    return np.rint(developed[::EVERY]).clip(0, 255).astype(np.uint8).reshape(-1, CAMERA.rows, CAMERA.columns, 3)


@pytest.mark.parametrize("camera", [GROUND_PLANE, Plain()])
@given(st.floats(0.0, 0.2))
@settings(max_examples=25, derandomize=True, deadline=None)
def test_a_blurred_picture_is_that_of_all_pictures_to_the_last_bit(camera, blur):
    np.testing.assert_array_equal(pictures_of(camera, (Blur(blur),)), expected((Blur(blur),)))


@pytest.mark.parametrize("effects", [(), (CameraLatency(0.02),), (RollingShutter(0.03), Blur(0.05))])
def test_so_is_that_of_any_effects(effects):
    np.testing.assert_array_equal(pictures_of(GROUND_PLANE, effects), expected(effects))


@pytest.mark.parametrize("lengths", [(4,) * 6, (1,) * 24, (2, 1, 3, 1, 1, 4, 4, 4, 4)])
def test_it_does_not_matter_how_many_ticks_pass_at_a_time(lengths):
    np.testing.assert_array_equal(pictures_of(GROUND_PLANE, (Blur(0.08),), lengths), expected((Blur(0.08),)))


@pytest.mark.parametrize(("effects", "rendered"), [((), 1), ((Blur(0.02),), 3), ((Blur(0.1),), 4)])
def test_no_more_is_rendered_than_is_averaged(effects, rendered):
    camera = Plain()
    view = View(camera, Chain(effects), setting(POSES[0]))
    before = camera.rendered
    view.pass_by(POSES[1:5])
    assert camera.rendered - before == rendered
