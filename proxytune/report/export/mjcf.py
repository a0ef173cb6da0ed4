"""A complete MuJoCo model of a domain instance: a robot on a floor, its control the duties of both wheels."""

import math
from string import Template
from xml.sax.saxutils import escape

import numpy as np

from proxytune.driving import CameraFigures, orientation
from proxytune.report.export.instance import Instance, xml_comment

TIMESTEP_S = 0.0005
"""Short, and integrated explicitly: MuJoCo's implicit integrators push a robot with stiffly driven light wheels."""
SERVO_S = 0.01
"""Time constant of the wheels' servos, with which the robot's mass follows [s]; part of the motors' lag."""
MODEL = Template("""\
<mujoco model="$name">
  <!-- $comment -->
  <!-- Control: duties of the left and right wheels, -1 to 1. Origin: middle of the axle, on the floor; x forward. -->
  <option timestep="$timestep"/>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="floor" type="plane" size="10 10 0.1" friction="1 0.005 0.0001"/>
    <body name="$name">
      <freejoint/>
      <geom name="chassis" type="box" pos="$chassis_x 0 $chassis_z" size="$chassis_size" mass="$chassis_mass"/>
      <geom name="caster" type="sphere" pos="$caster_x 0 $caster" size="$caster" mass="$caster_mass"
            condim="1" priority="1"/>
$parts
      <body name="wheel_left" pos="0 $half_baseline $radius">
        <joint name="axle_left" type="hinge" axis="0 1 0"/>
        <geom type="sphere" size="$radius" mass="$wheel_mass"/>
      </body>
      <body name="wheel_right" pos="0 -$half_baseline $radius">
        <joint name="axle_right" type="hinge" axis="0 1 0"/>
        <geom type="sphere" size="$radius" mass="$wheel_mass"/>
      </body>
    </body>
  </worldbody>
  <contact>
    <exclude body1="$name" body2="wheel_left"/>
    <exclude body1="$name" body2="wheel_right"/>
  </contact>
  <actuator>
$actuators
  </actuator>
</mujoco>
""")


def mjcf_text(instance: Instance) -> str:
    """A MuJoCo model whose motors lag, saturate, are late and pull to one side as was found.

    Each wheel is a servo of speed within its motor's torque. Its wheels are spheres, as far apart as the turn rate
    shows it. A delay needs a MuJoCo whose actuators have one (the attribute `delay`).

    Raises:
        InputError: If the robot states no mass or no wheel torque.
    """
    radius, mass, baseline = instance.figure("wheel_radius"), instance.figure("mass"), instance.baseline_m
    length, height = 1.2 * baseline, 1.2 * radius
    numbers = {
        "timestep": TIMESTEP_S,
        "radius": radius,
        "half_baseline": baseline / 2.0,
        "chassis_x": -0.15 * baseline,
        "chassis_z": radius + height / 2.0,
        "chassis_mass": 0.89 * mass,
        "caster": 0.35 * radius,
        "caster_x": -0.5 * baseline,
        "caster_mass": 0.01 * mass,
        "wheel_mass": 0.05 * mass,
    }
    return MODEL.substitute(
        {key: f"{number:.9g}" for key, number in numbers.items()},
        name=escape(instance.robot.name, {'"': "&quot;"}),
        comment=xml_comment(instance, "mjcf", 7),
        chassis_size=f"{length / 2.0:.6g} {0.35 * baseline:.6g} {height / 2.0:.6g}",
        parts="\n".join(_parts(instance)),
        actuators="\n".join(_actuator(instance, side) for side in (0, 1)),
    )


def _parts(instance: Instance) -> list[str]:
    """The camera and the tracked point, where there are such."""
    parts = []
    if (camera := instance.camera) is not None:
        parts.append(_camera(camera))
    if (tracked := instance.tracked_point) is not None:
        forward, left, angle = tracked
        turned = f"{math.cos(angle / 2.0):.9g} 0 0 {math.sin(angle / 2.0):.9g}"
        parts.append(f'<site name="tracked_point" pos="{forward:.9g} {left:.9g} 0" quat="{turned}"/>')
    return [f"      {part}" for part in parts]


def _camera(figures: CameraFigures) -> str:
    """MuJoCo's camera looks along its −z axis; its x axis is the picture's right, its y axis the picture's top."""
    turned = orientation(figures)
    axes = " ".join(f"{round(value, 12) + 0.0:.9g}" for value in np.concatenate((-turned[:, 1], turned[:, 2])).tolist())
    place = f"{figures.forward_m:.9g} 0 {figures.height_m:.9g}"
    size = f"{figures.columns} {figures.rows}"
    fovy = f"{figures.field_of_view_deg:.9g}"
    return f'<camera name="camera" pos="{place}" xyaxes="{axes}" fovy="{fovy}" resolution="{size}"/>'


def _actuator(instance: Instance, side: int) -> str:
    """A servo of one wheel's speed: torque = stiffness · (full wheel speed · gain · duty − wheel speed)."""
    radius = instance.figure("wheel_radius")
    stiffness = instance.figure("mass") * radius**2 / 2.0 / SERVO_S
    full = stiffness * instance.figure("full_speed") / radius * instance.gains[side]
    torque, limit, lag = instance.figure("wheel_torque"), instance.limits[side], instance.lags_s[side] - SERVO_S
    delay = instance.value("delay", "delay", 0.0)
    words = [
        f'<general name="{("left", "right")[side]}" joint="{("axle_left", "axle_right")[side]}"',
        f'gainprm="{full:.9g}" biastype="affine" biasprm="0 0 {-stiffness:.9g}"',
        f'ctrllimited="true" ctrlrange="{-limit:.9g} {limit:.9g}"',
        f'forcelimited="true" forcerange="{-torque:.9g} {torque:.9g}"',
        *([f'dyntype="filterexact" dynprm="{lag:.9g}"'] if lag > 0.0 else []),
        *(
            [f'delay="{delay:.9g}" nsample="{math.ceil(delay / TIMESTEP_S) + 2}" interp="linear"']
            if delay > 0.0
            else []
        ),
    ]
    return "    " + " ".join(words) + "/>"
