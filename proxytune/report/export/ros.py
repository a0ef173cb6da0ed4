"""For ROS 2: parameters of a controller, a node that bends commands as was found, and one that plays a drive."""

import math
from collections.abc import Sequence
from pprint import pformat

import numpy as np
from scipy.spatial.transform import Rotation

from proxytune.diagnosis import Diagnosis, commands_as
from proxytune.driving import REQUIRED, CameraFigures, Robot
from proxytune.effects import effect_of, is_learnt
from proxytune.files import package_table
from proxytune.logs import CAR_COMMANDS, COMMANDS
from proxytune.report.export.instance import BENT, FILTER, Instance, header
from proxytune.report.writing import fill

TIMEOUT_S = 0.5
"""diff_drive_controller's own default of cmd_vel_timeout; no effect says anything about it."""


def ros_text(instance: Instance) -> str:
    """A parameter file for the robot's own controller: with it the robot goes as it is told.

    The multipliers are those of open-loop driving: a wheel that turns slower than told is treated as a smaller one.
    """
    parts = [_car(instance) if instance.steers else _wheels(instance)]
    if (camera := instance.camera) is not None:
        parts.append(_camera_info(camera))
    # Parameters of tf2_ros' static_transform_publisher; base_link is the middle of the axle, on the floor.
    for child, pose in instance.mounts.items():
        numbers = (*pose[:3, 3].tolist(), *Rotation.from_matrix(pose[:3, :3]).as_quat(canonical=True).tolist())
        names = ("x", "y", "z", "qx", "qy", "qz", "qw")
        parts.append(_filled("ros_transform", child=child, **dict(zip(names, numbers, strict=True))))
    return "".join([*(f"# {line}\n" for line in header(instance, "ros")), *parts])


def _car(instance: Instance) -> str:
    """Parameters of ros2_controllers' ackermann_steering_controller, by the names of Jazzy and later."""
    # A car that drives slower than told has smaller wheels
    radius = instance.gains[0] * instance.figure("wheel_radius")
    return _filled("ros_car", wheelbase=instance.figure("wheelbase"), track=instance.baseline_m, radius=radius)


def _wheels(instance: Instance) -> str:
    """Parameters of ros2_controllers' diff_drive_controller; accelerations only where the slew rate was found."""
    gains, baseline, speed = instance.gains, instance.baseline_m, instance.figure("full_speed")
    built = instance.robot.figures.get("wheel_distance", instance.figure("effective_baseline"))
    fastest = min(speed * gain * limit for gain, limit in zip(gains, instance.limits, strict=True))
    rise = instance.value("slew_rate", "rise_time", 0.0)
    # A duty rises at the same rate whatever it is cut off at.
    fastest_rise = speed * min(gains) / rise if rise else 0.0
    text = _filled(
        "ros_wheels",
        built=built,
        wider=baseline / built,
        radius=instance.figure("wheel_radius"),
        left=gains[0],
        right=gains[1],
        timeout=TIMEOUT_S,
        speed=fastest,
        backwards=-fastest,
        rise=fastest_rise,
        turn=2.0 * fastest / baseline,
        turn_right=-2.0 * fastest / baseline,
        turn_rise=2.0 * fastest_rise / baseline,
    )
    return "".join(line for line in text.splitlines(keepends=True) if fastest_rise or "acceleration" not in line)


def _camera_info(figures: CameraFigures) -> str:
    """The intrinsics of sensor_msgs/CameraInfo, whose pixels have their middles at whole numbers."""
    focal = figures.rows / 2.0 / math.tan(math.radians(figures.field_of_view_deg) / 2.0)
    right = figures.columns / 2.0 + figures.centre_right * figures.rows - 0.5
    down = figures.rows / 2.0 + figures.centre_down * figures.rows - 0.5
    size = {"columns": str(figures.columns), "rows": str(figures.rows)}
    numbers = {"k1": figures.k1, "across": focal * figures.aspect, "right": right, "focal": focal, "down": down}
    return _filled("ros_camera", **size, **numbers)


def _filled(template: str, **values: float | str) -> str:
    """A template with numbers as ROS tells them from whole ones: with a point."""
    said = {}
    for name, value in values.items():
        text = value if isinstance(value, str) else f"{round(value, 9) + 0.0:.9g}"
        said[name] = text if isinstance(value, str) or "." in text or "e" in text else f"{text}.0"
    return fill(f"{template}.yaml.txt", **said)


RATE_HZ = 60.0
"""How often the node tells the driver a velocity; it is also the tick of proxytune's own plants."""


def node_text(instance: Instance, has: Sequence[str]) -> str:
    """The node as a Python file: all values in it, no other file needed."""
    names = REQUIRED[instance.robot.drive]
    known = {
        name: value
        for name, value in sorted(instance.theta.items())
        if is_learnt(name) or instance.robot.catalogue.effect(effect_of(name)).stage in BENT
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
    told = package_table("report/templates/player.toml")["ackermann" if kind in CAR_COMMANDS else "twist"]
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
