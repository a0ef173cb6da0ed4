"""ROS 2 parameters of a domain instance: its wheels' controller, the camera, and static transforms."""

import math

import numpy as np

from proxytune.arrays import Floats
from proxytune.driving import CameraFigures
from proxytune.report.export.instance import Instance, header

TIMEOUT_S = 0.5
"""diff_drive_controller's own default of cmd_vel_timeout; no effect says anything about it."""
Rows = list[str]


def ros_text(instance: Instance) -> str:
    """A parameter file for the robot's own controller: with it the robot goes as it is told.

    The multipliers are those of open-loop driving: a wheel that turns slower than told is treated as a smaller one.

    Raises:
        InputError: If the robot lacks a figure.
    """
    lines = [f"# {line}" for line in header(instance, "ros")] + _controller(instance)
    if (camera := instance.camera) is not None:
        lines += _camera_info(camera)
    for child, pose in instance.mounts.items():
        lines += _transform(child, pose)
    return "\n".join(lines) + "\n"


def _controller(instance: Instance) -> Rows:
    """Parameters of ros2_controllers' diff_drive_controller, or of its ackermann_steering_controller."""
    if instance.steers:
        return _ackermann(instance)
    gains, baseline = instance.gains, instance.baseline_m
    built = instance.robot.figures.get("wheel_distance", instance.figure("effective_baseline"))
    speed = instance.figure("full_speed")
    fastest = min(speed * gain * limit for gain, limit in zip(gains, instance.limits, strict=True))
    rise = instance.value("slew_rate", "rise_time", 0.0)
    # A duty rises at the same rate whatever it is cut off at.
    fastest_rise = speed * min(gains) / rise if rise else 0.0
    return [
        "diff_drive_controller:",
        "  ros__parameters:",
        '    left_wheel_names: ["axle_left"]',
        '    right_wheel_names: ["axle_right"]',
        f"    wheel_separation: {_number(built)}",
        f"    wheel_separation_multiplier: {_number(baseline / built)}",
        f"    wheel_radius: {_number(instance.figure('wheel_radius'))}",
        f"    left_wheel_radius_multiplier: {_number(gains[0])}",
        f"    right_wheel_radius_multiplier: {_number(gains[1])}",
        f"    cmd_vel_timeout: {_number(TIMEOUT_S)}  # the controller's default: nothing was found of it",
        *_limits("linear.x", fastest, fastest_rise),
        *_limits("angular.z", 2.0 * fastest / baseline, 2.0 * fastest_rise / baseline),
    ]


def _ackermann(instance: Instance) -> Rows:
    """Names of Jazzy and later; a car that drives slower than told has smaller wheels."""
    return [
        "ackermann_steering_controller:",
        "  ros__parameters:",
        '    traction_joints_names: ["axle_right", "axle_left"]',
        '    steering_joints_names: ["steer_right", "steer_left"]',
        f"    wheelbase: {_number(instance.figure('wheelbase'))}",
        f"    traction_track_width: {_number(instance.baseline_m)}",
        f"    traction_wheels_radius: {_number(instance.gains[0] * instance.figure('wheel_radius'))}",
    ]


def _limits(axis: str, velocity: float, acceleration: float) -> Rows:
    rows = [f"    {axis}.max_velocity: {_number(velocity)}", f"    {axis}.min_velocity: {_number(-velocity)}"]
    return rows + ([f"    {axis}.max_acceleration: {_number(acceleration)}"] if acceleration else [])


def _camera_info(figures: CameraFigures) -> Rows:
    """The intrinsics of sensor_msgs/CameraInfo, whose pixels have their middles at whole numbers."""
    focal = figures.rows / 2.0 / math.tan(math.radians(figures.field_of_view_deg) / 2.0)
    across, right = focal * figures.aspect, figures.columns / 2.0 + figures.centre_right * figures.rows - 0.5
    down = figures.rows / 2.0 + figures.centre_down * figures.rows - 0.5
    k = (across, 0.0, right, 0.0, focal, down, 0.0, 0.0, 1.0)
    p = (across, 0.0, right, 0.0, 0.0, focal, down, 0.0, 0.0, 0.0, 1.0, 0.0)
    return [
        f"camera:  # at {figures.columns} x {figures.rows} pixels; scale k and p to yours, for its camera_info_url",
        "  ros__parameters:",
        f"    camera_info.width: {figures.columns}",
        f"    camera_info.height: {figures.rows}",
        "    camera_info.distortion_model: plumb_bob",
        f"    camera_info.d: {_list((figures.k1, 0.0, 0.0, 0.0, 0.0))}",
        f"    camera_info.k: {_list(k)}",
        f"    camera_info.p: {_list(p)}",
    ]


def _transform(child: str, pose: Floats) -> Rows:
    """Parameters of tf2_ros' static_transform_publisher; base_link is the middle of the axle, on the floor."""
    # The quaternion of a rotation by less than half a turn
    turned = pose[:3, :3]
    w = math.sqrt(max(1e-12, 1.0 + float(np.trace(turned)))) / 2.0
    skew = turned - turned.T
    quaternion = (*(float(skew[at]) / 4.0 / w for at in ((2, 1), (0, 2), (1, 0))), w)
    rows = [f"{child}_transform:  # x forward, y left, z up, as base_link", "  ros__parameters:"]
    rows += ["    frame_id: base_link", f"    child_frame_id: {child}"]
    rows += [
        f"    translation.{axis}: {_number(value)}" for axis, value in zip("xyz", pose[:3, 3].tolist(), strict=True)
    ]
    return rows + [f"    rotation.{axis}: {_number(value)}" for axis, value in zip("xyzw", quaternion, strict=True)]


def _number(value: float) -> str:
    """With a point: ROS tells whole numbers from others."""
    text = f"{round(value, 9) + 0.0:.9g}"
    return text if "." in text or "e" in text else f"{text}.0"


def _list(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(map(_number, values)) + "]"
