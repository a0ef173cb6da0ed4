"""A mounted camera is the robot's nominal one but for the figures that camera effects set."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proxytune.driving.mounting import mounted_camera
from proxytune.driving.robot import read_robot, robot_from_geometry
from proxytune.effects import effects_from
from proxytune.errors import SettingsError

ROBOT = read_robot("duckiebot")
NOMINAL = ROBOT.camera_figures()


def mounted(theta):
    return mounted_camera(ROBOT, effects_from(theta, ROBOT.figures))


def test_without_effects_the_camera_is_nominal():
    assert mounted({}) == NOMINAL


@given(st.floats(0.0, 45.0), st.floats(-10.0, 10.0), st.floats(-0.4, 0.2))
def test_each_camera_effect_sets_its_figure_alone(pitch, roll, k1):
    camera = mounted({"camera_pitch": pitch, "camera_roll": roll, "lens_distortion": k1})
    changed = {name for name in vars(camera) if getattr(camera, name) != getattr(NOMINAL, name)}
    assert (camera.pitch_deg, camera.roll_deg, camera.k1) == (pitch, roll, k1)
    assert changed <= {"pitch_deg", "roll_deg", "k1"}


def test_effects_on_motion_and_on_pictures_leave_it_alone():
    assert mounted({"trim": 0.1, "blur": 0.05, "camera_latency": 0.1}) == NOMINAL


def test_a_robot_without_a_camera_is_refused():
    geometry = {"wheel_radius": 0.03, "effective_baseline": 0.16, "full_speed": 0.6}
    with pytest.raises(SettingsError, match="camera"):
        mounted_camera(robot_from_geometry("cart", geometry, 20.0), ())


def test_figures_that_no_camera_can_have_are_refused():
    with pytest.raises(SettingsError, match="height_m must be above 0 m"):
        mounted_camera(ROBOT, [_Sunk()])


class _Sunk:
    """A user's own effect that puts the lens beneath the floor."""

    name, stage = "sunk", next(iter(effects_from({"camera_pitch": 1.0}, ROBOT.figures))).stage

    def begin(self, setting):
        """Nothing to remember."""

    def apply(self, signal, memory):
        return signal * 0.0 - 1.0, None
