"""For ROS 2: parameters of a controller, a node that bends commands as was found, and one that plays a drive."""

import math
import tomllib
from collections.abc import Sequence
from pprint import pformat

import numpy as np

from proxytune.arrays import Floats
from proxytune.diagnosis import Diagnosis, commands_as
from proxytune.driving import REQUIRED, CameraFigures, Robot
from proxytune.effects import effect_of, is_learnt
from proxytune.logs import CAR_COMMANDS, COMMANDS
from proxytune.report.export.instance import BENT, FILTER, Instance, header
from proxytune.report.writing import fill

TIMEOUT_S = 0.5
"""diff_drive_controller's own default of cmd_vel_timeout; no effect says anything about it."""
Rows = list[str]


def ros_text(instance: Instance) -> str:
    """A parameter file for the robot's own controller: with it the robot goes as it is told.

    The multipliers are those of open-loop driving: a wheel that turns slower than told is treated as a smaller one.
    """
    lines = [f"# {line}" for line in header(instance, "ros")] + _controller(instance)
    if (camera := instance.camera) is not None:
        lines += _camera_info(camera)
    for child, pose in instance.mounts.items():
        lines += _transform(child, pose)
    return "\n".join(lines) + "\n"


def _controller(instance: Instance) -> Rows:
    """Parameters of ros2_controllers' diff_drive_controller, or of its ackermann_steering_controller."""
    if instance.steers:  # Names of Jazzy and later; a car that drives slower than told has smaller wheels
        return [
            "ackermann_steering_controller:",
            "  ros__parameters:",
            '    traction_joints_names: ["axle_right", "axle_left"]',
            '    steering_joints_names: ["steer_right", "steer_left"]',
            f"    wheelbase: {_number(instance.figure('wheelbase'))}",
            f"    traction_track_width: {_number(instance.baseline_m)}",
            f"    traction_wheels_radius: {_number(instance.gains[0] * instance.figure('wheel_radius'))}",
        ]
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
    place = pose[:3, 3].tolist()
    rows += [f"    translation.{axis}: {_number(value)}" for axis, value in zip("xyz", place, strict=True)]
    return rows + [f"    rotation.{axis}: {_number(value)}" for axis, value in zip("xyzw", quaternion, strict=True)]


def _number(value: float) -> str:
    """With a point: ROS tells whole numbers from others."""
    text = f"{round(value, 9) + 0.0:.9g}"
    return text if "." in text or "e" in text else f"{text}.0"


def _list(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(map(_number, values)) + "]"


RATE_HZ = 60.0
"""How often the node tells the driver a velocity; it is also the tick of proxytune's own plants."""


def node_text(instance: Instance, has: Sequence[str] = ()) -> str:
    """The node as a Python file: all values in it, no other file needed."""
    names = REQUIRED[instance.robot.drive]
    kinds = instance.robot.catalogue
    known = {
        name: value
        for name, value in sorted(instance.theta.items())
        if is_learnt(name) or kinds.effect(effect_of(name)).stage in BENT
    }
    return fill(
        "ackermann_filter.py.txt" if instance.steers else "cmd_vel_filter.py.txt",
        head="\n".join(header(instance, FILTER, has)).replace("\\", "/").replace('"""', "'''"),
        theta=pformat(known, sort_dicts=False),
        figures=pformat({name: float(instance.figure(name)) for name in names}, sort_dicts=False),
        has=repr(tuple(has)),
        rate=RATE_HZ,
        reverse=instance.robot.reverse,
    )


def player_text(diagnosis: Diagnosis) -> str:
    """The node for the next drive of a diagnosis that has one, as a Python file."""
    drive, kind = diagnosis.next_drive, diagnosis.command
    assert drive is not None
    told = tomllib.loads(fill("player.toml"))["ackermann" if kind in CAR_COMMANDS else "twist"]
    return fill(
        "player.py.txt",
        **told,
        times=drive.times,
        room=" × ".join(f"{side:.1f}" for side in drive.room),
        columns=" and ".join(COMMANDS[kind]),
        names=repr(COMMANDS[kind]),
        matrix=pformat(_to_velocity(kind, diagnosis.robot)),
        rate=round(drive.rate_hz, 6),
    )


def _to_velocity(kind: str, robot: Robot) -> tuple[tuple[float, ...], ...]:
    """How the columns of a kind of commands add up to a velocity: rows of the shares of both columns."""
    if kind == "twist":
        return ((1.0, 0.0), (0.0, 1.0))
    unit = np.eye(2)
    own = commands_as(kind, robot, unit)
    velocities = commands_as("speed_steering" if kind in CAR_COMMANDS else "twist", robot, unit)
    return tuple(tuple(float(f"{share:.9g}") for share in row) for row in (np.linalg.inv(own) @ velocities).T.tolist())


def commands_text(diagnosis: Diagnosis) -> str:
    """The next drive of a diagnosis that has one as a log's commands.csv, in the log's kind of commands."""
    drive = diagnosis.next_drive
    assert drive is not None
    rows = commands_as(diagnosis.command, diagnosis.robot, drive.commands).tolist()
    lines = [f"next,{tick / drive.rate_hz:.4f},{first:.7g},{second:.7g}" for tick, (first, second) in enumerate(rows)]
    return "\n".join([",".join(("episode", "time", *COMMANDS[diagnosis.command])), *lines]) + "\n"
