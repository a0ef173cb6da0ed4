"""The catalogue is in the order in which the signal meets the effects, and that order changes what comes out."""

import numpy as np
import pytest

from proxytune.driving.robot import read_robot
from proxytune.effects import CATALOGUE, Setting, Stage, effects_from, stage_chain

ROBOT = read_robot("duckiebot")

ORDER = (
    # command: what happens on the way to the robot, before the command arrives
    "delay_jitter", "dropped_commands", "command_quantisation", "delay",
    # actuation: controller, driver, friction, limits, wheels, motors, gears
    "slew_rate", "driver_map", "dead_band", "stiction", "saturation", "trim", "wheel_gain", "battery_sag",
    "thermal_fade", "motor_lag", "backlash", "wheel_ripple",
    # motion: from wheels to the body, then the floor
    "yaw_scrub", "understeer", "yaw_lag", "turn_slip", "lateral_slip", "cross_coupling", "floor_slope",
    "slippery_patch",
    # measurement, camera, image
    "marker_offset", "heading_offset",
    "camera_pitch", "camera_roll", "camera_yaw", "camera_height", "camera_forward",
    "field_of_view", "lens_distortion", "lens_centre", "pixel_aspect",
    # first what mixes pictures, then what the lens and last what the sensor does to each
    "blur", "rolling_shutter", "camera_latency", "defocus", "vignetting", "exposure", "image_noise",
)  # fmt: skip


def wheels(theta, duty):
    """Both wheels' speeds, as shares of full speed, at a steady duty."""
    chain = stage_chain(effects_from(theta, ROBOT.figures), Stage.ACTUATION)
    memory = chain.begin(Setting(60.0, np.zeros(2), ROBOT.figures))
    return chain.apply(np.full((600, 2), duty), memory)[0][-1]


def test_the_signal_meets_the_effects_in_this_order():
    assert tuple(CATALOGUE) == ORDER


def test_effects_come_in_the_order_of_the_catalogue_however_they_are_named():
    theta = {"motor_lag.time_constant": 0.1, "trim": 0.1, "dead_band.width": 0.1, "driver_map": 0.2, "delay": 0.1}
    names = [effect.name for effect in effects_from(theta, ROBOT.figures)]
    assert names == ["delay", "driver_map", "dead_band", "trim", "motor_lag"]


def test_the_driver_raises_a_small_duty_over_the_dead_band_of_the_motor():
    np.testing.assert_allclose(wheels({"driver_map": 0.3, "dead_band.width": 0.1}, 0.02), 0.314 - 0.1)


def test_the_driver_limits_the_duty_before_the_trim_scales_the_wheels():
    np.testing.assert_allclose(wheels({"saturation.limit": 0.5, "trim": 0.2}, 1.0), [0.4, 0.6])


def test_friction_takes_its_part_before_the_gain_of_the_wheels():
    theta = {"dead_band.width": 0.2, "wheel_gain.left": 0.5, "wheel_gain.right": 1.5}
    assert wheels(theta, 0.6) == pytest.approx([0.2, 0.6])
