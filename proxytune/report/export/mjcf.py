"""A complete MuJoCo model of a domain instance: a robot on a floor, controlled by its two commands."""

import math
import tomllib
from collections.abc import Iterator
from xml.sax.saxutils import escape

import numpy as np

from proxytune.driving import orientation
from proxytune.report.export.instance import Instance, xml_comment
from proxytune.report.export.urdf import numbers_text
from proxytune.report.writing import fill

TIMESTEP_S = 0.0005
"""Short, and integrated explicitly: MuJoCo's implicit integrators push a robot with stiffly driven light wheels."""
SERVO_S = 0.01
"""Time constant of the wheels' servos, with which the robot's mass follows [s]; part of the motors' lag."""
STEERS_HZ = 400.0
"""Natural frequency of the servo that holds the front wheel [rad/s]; it is damped so that it does not swing."""


def mjcf_text(instance: Instance) -> str:
    """A MuJoCo model whose motors lag, saturate, are late and pull to one side as was found.

    Each wheel is a servo of speed within its motor's torque. Its wheels are spheres, as far apart as the turn rate
    shows it. A car has one front wheel, in the middle, and an open differential.

    A delay needs a MuJoCo whose actuators have one (the attribute `delay`).
    """
    radius, mass, baseline = instance.figure("wheel_radius"), instance.figure("mass"), instance.baseline_m
    wheelbase = instance.figure("wheelbase") if instance.steers else 0.0
    # Inertia of a car's steering [kg m²], large beside that of its wheel
    length, height, armature = 1.2 * (wheelbase or baseline), 1.2 * radius, 0.1 * mass * radius**2
    numbers = {
        "timestep": TIMESTEP_S,
        "radius": radius,
        "half_baseline": baseline / 2.0,
        "chassis_x": 0.4 * wheelbase or -0.15 * baseline,
        "chassis_z": radius if wheelbase else radius + height / 2.0,
        "chassis_mass": 0.89 * mass,
        "caster": 0.35 * radius,
        "caster_x": -0.5 * baseline,
        "caster_mass": 0.01 * mass,
        "wheel_mass": 0.05 * mass,
        "wheelbase": wheelbase,
        "armature": armature,
        "damping": 2.0 * armature * STEERS_HZ,
    }
    name = escape(instance.robot.name, {'"': "&quot;"})
    said = {key: f"{number:.9g}" for key, number in numbers.items()}
    own = tomllib.loads(fill("mujoco_parts.toml", **said))
    if wheelbase:  # A servo of the mean speed of the rear wheels, and one of the front wheel's angle
        rear = _speed_servo(instance, 'name="throttle" tendon="rear"', 0, 2)
        actuators = [rear, _steering_servo(instance, armature * STEERS_HZ**2)]
    else:
        sides = enumerate(("left", "right"))
        actuators = [_speed_servo(instance, f'name="{one}" joint="axle_{one}"', side, 1) for side, one in sides]
    return fill(
        "mujoco.xml.txt",
        **said,
        name=name,
        comment=xml_comment(instance, "mjcf", 7),
        chassis_size=f"{length / 2.0:.6g} {0.35 * baseline:.6g} {height / 2.0:.6g}",
        parts="\n".join([own["front_wheel" if wheelbase else "caster"], *_mounted(instance)]),
        control="throttle and steering (left is above 0)" if wheelbase else "duties of the left and right wheels",
        excluded='    <exclude body1="$name" body2="wheel_front"/>\n'.replace("$name", name) if wheelbase else "",
        tendons=own["open_differential"] if wheelbase else "",
        actuators="\n".join(actuators),
    )


def _speed_servo(instance: Instance, place: str, side: int, wheels: int) -> str:
    """A servo: torque = stiffness · (full wheel speed · gain · command − wheel speed)."""
    radius, torque = instance.figure("wheel_radius"), wheels * instance.figure("wheel_torque")
    stiffness = wheels * instance.figure("mass") * radius**2 / 2.0 / SERVO_S
    full = stiffness * instance.figure("full_speed") / radius * instance.gains[side]
    limit = instance.limits[side]
    least = -limit if instance.robot.reverse else 0.0
    words = [
        f'<general {place} gainprm="{full:.9g}" biastype="affine" biasprm="0 0 {-stiffness:.9g}"',
        f'ctrllimited="true" ctrlrange="{least:.9g} {limit:.9g}"',
        f'forcelimited="true" forcerange="{-torque:.9g} {torque:.9g}"',
        *_follows(instance, instance.lags_s[side] - SERVO_S),
    ]
    return "    " + " ".join(words) + "/>"


def _steering_servo(instance: Instance, stiffness: float) -> str:
    """A servo of the front wheel: torque = stiffness · (full angle · (gain · command + offset) − angle)."""
    full = stiffness * math.radians(instance.figure("wheel_angle"))
    limit = instance.value("steering_saturation", "limit", 1.0)
    offset, gain = instance.value("steering_offset", "offset", 0.0), instance.value("steering_gain", "gain", 1.0)
    words = [
        f'<general name="steering" joint="steering" gainprm="{full * gain:.9g}" biastype="affine"',
        f'biasprm="{full * offset:.9g} {-stiffness:.9g} 0" ctrllimited="true" ctrlrange="{-limit:.9g} {limit:.9g}"',
        *_follows(instance, instance.value("steering_lag", "time_constant", 0.0) - 2.0 / STEERS_HZ),
    ]
    return "    " + " ".join(words) + "/>"


def _mounted(instance: Instance) -> Iterator[str]:
    """The camera and the tracked point, where there are such."""
    if (camera := instance.camera) is not None:
        # It looks along its −z axis; its x axis is the picture's right, its y axis the picture's top.
        turned = orientation(camera)
        axes = numbers_text(np.concatenate((-turned[:, 1], turned[:, 2])))
        place, size = f"{camera.forward_m:.9g} 0 {camera.height_m:.9g}", f"{camera.columns} {camera.rows}"
        looks = f'xyaxes="{axes}" fovy="{camera.field_of_view_deg:.9g}" resolution="{size}"'
        yield f'      <camera name="camera" pos="{place}" {looks}/>'
    if (tracked := instance.tracked_point) is not None:
        forward, left, angle = tracked
        turn = f"{math.cos(angle / 2.0):.9g} 0 0 {math.sin(angle / 2.0):.9g}"
        yield f'      <site name="tracked_point" pos="{forward:.9g} {left:.9g} 0" quat="{turn}"/>'


def _follows(instance: Instance, lag_s: float) -> list[str]:
    """How late an actuator hears its command, and how slowly it follows."""
    delay = instance.value("delay", "delay", 0.0)
    late = f'delay="{delay:.9g}" nsample="{math.ceil(delay / TIMESTEP_S) + 2}" interp="linear"'
    return [f'dyntype="filterexact" dynprm="{lag_s:.9g}"'] * (lag_s > 0.0) + [late] * (delay > 0.0)
