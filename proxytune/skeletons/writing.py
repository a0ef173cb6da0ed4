"""Skeletons: the files of a study, a domain family or a robot to start from, and the commands to type then.

A study has a target to try it; a family is a tiny simulator with all that a study asks of one; a robot has two wheels,
a caster and a camera, for both plants, and what is not known of it is guessed and marked EDIT.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

from proxytune.driving import UNITS, Robot
from proxytune.effects import PARAMETERS
from proxytune.errors import InputError, SettingsError
from proxytune.files import fill_template, package_table
from proxytune.settings import nearest


@dataclass(frozen=True)
class Skeleton:
    """The files that `new` writes."""

    files: Mapping[str, str]  # texts by file name
    next: tuple[str, ...]  # the commands to type then
    notes: tuple[str, ...] = field(default=())  # what was read and what is to be known, in one line each


fill = partial(fill_template, "skeletons")
AROUND_DEG = 10.0
"""How far the box of the camera's pitch reaches to either side of the nominal one."""
OFF_DEG = 4.0
"""How far the pitch that is to be found is from the nominal one."""
HIGHEST_DEG = 45.0


def study_skeleton(name: str, robot: Robot) -> Skeleton:
    """A study.toml for the plant that the robot can drive on, and a truth.toml.

    Args:
        name: Of the study's folder.
        robot: Which one; it needs a camera.

    Raises:
        SettingsError: If it has no camera.
    """
    pitch = robot.camera_figures().pitch_deg
    low, high = max(0.0, pitch - AROUND_DEG), min(HIGHEST_DEG, pitch + AROUND_DEG)
    off = pitch + OFF_DEG if pitch + OFF_DEG < high else pitch - OFF_DEG
    trim = robot.catalogue.declared[0]
    values = {"name": name, "robot": robot.name, "plant": _plant(robot), "trim": trim, "pitch": f"{off:g}"}
    values |= {"pitch_low": f"{low:g}", "pitch_high": f"{high:g}"}
    on_wheels = robot.drive == "differential"
    values |= {"map": "small_loop" if on_wheels else "car_loop", "dead_band": "0.06" if on_wheels else "0.02"}
    values |= {"trim_key": robot.catalogue.effect(trim).parameters[0].name}
    return Skeleton({part: fill(f"{part}.txt", **values) for part in ("study.toml", "truth.toml")}, commands(name))


def commands(name: str) -> tuple[str, str]:
    """The commands that make the target of a study and run it."""
    return (
        f"python -m proxytune measure {name} --model {name}/truth.toml --output {name}/target.csv",
        f"python -m proxytune study {name}",
    )


def _plant(robot: Robot) -> str:
    try:
        robot.body()
    except SettingsError:
        return "planar"
    return "bullet"


PAGE = "docs/how-to/extending.md"


def family_skeleton(name: str) -> Skeleton:
    """A module, a study of it, a truth.toml and a test.

    Args:
        name: Of the folder and of the module in it; a Python name.
    """
    templates = {
        f"{name}.py": "family.py.txt",
        "study.toml": "family_study.toml.txt",
        "truth.toml": "family_truth.toml.txt",
        f"test_{name}.py": "family_test.py.txt",
    }
    files = {file: fill(template, name=name, page=PAGE) for file, template in templates.items()}
    note = f"put your simulator where {name}.py says EDIT ({PAGE}, 'Another simulator')"
    return Skeleton(files, (*commands(name), f"PYTHONPATH={name} python -m pytest {name}/test_{name}.py"), (note,))


GUESSES: Mapping[str, Mapping[str, tuple[float, str]]] = package_table("skeletons/templates/figures.toml")
"""By how a robot drives, what is written where nothing is known of a figure, and how to know it."""
SIX = ("wheel_radius", "wheel_distance", "full_speed", "motor_time_constant", "camera_height", "camera_pitch")
"""What a skeleton's body and model are made of; the rest can wait."""
EIGHT = ("wheelbase", "wheel_angle", *SIX)
"""What a car's body and model are made of."""
HIGHEST = {
    "motor_time_constant": PARAMETERS["motor_lag.time_constant"].high,
    "camera_pitch": PARAMETERS["camera_pitch"].high,
}
"""The most that the effect of the same meaning may have."""
LEAST_S = 0.05
"""A motor is taken to be no faster than that where its torque is guessed [s]."""


def robot_skeleton(name: str, figures: Mapping[str, float], drive: str = "differential") -> Skeleton:
    """A robot.toml and a URDF of its own, which agree with each other.

    Args:
        name: Of the robot and its folder.
        figures: What is known of it; the rest is guessed and marked.
        drive: "differential", or "ackermann" for a car.

    Raises:
        InputError: If a figure is unknown or cannot be.
    """
    check_figures(figures)
    values = completed(figures, drive)
    body = _car_text(name, values) if drive == "ackermann" else fill("body.urdf.txt", name=name, **_dimensions(values))
    return Skeleton(
        {"robot.toml": robot_text(name, values, {"given to `new robot`": figures}, drive), f"{name}.urdf": body},
        then(name),
        (f"what is not known of {name} is marked EDIT in robot.toml; its wheels are in {name}.urdf too",),
    )


def then(name: str) -> tuple[str, ...]:
    """The commands to type once a robot is there."""
    return ("python -m proxytune list robots", f"python -m proxytune new study {name}_study --robot {name}")


def check_figures(figures: Mapping[str, float]) -> None:
    """Refuse figures that a robot.toml does not have, and values that none can have."""
    for figure, value in figures.items():
        if figure not in UNITS:
            raise InputError(f"--figures: no figure '{figure}'; {nearest(figure, UNITS)}")
        highest = HIGHEST.get(figure, math.inf)
        if value > highest:
            raise InputError(f"--figures: {figure} must be at most {highest:g} {UNITS[figure]}, got {value:g}")
        may_be_zero = figure in ("motor_time_constant", "camera_pitch", "camera_forward", "expert_disturbance")
        if not 0.0 <= value < math.inf or (value == 0.0 and not may_be_zero):
            raise InputError(f"--figures: {figure} must be above 0 and finite, got {value:g}")


def _guesses(drive: str) -> Mapping[str, tuple[float, str]]:
    guesses = {**GUESSES["differential"], **GUESSES[drive]}
    return {name: one for name, one in guesses.items() if drive == "differential" or name != "effective_baseline"}


def completed(figures: Mapping[str, float], drive: str = "differential") -> dict[str, float]:
    """Every figure: those known, and guesses that go with them."""
    values = {name: guess for name, (guess, _) in _guesses(drive).items()} | dict(figures)
    if drive == "differential" and "effective_baseline" not in figures:
        values["effective_baseline"] = values["wheel_distance"]
    if "wheel_torque" not in figures:
        force = 2.0 * values["mass"] * values["full_speed"] / max(values["motor_time_constant"], LEAST_S)
        values["wheel_torque"] = float(f"{force * values['wheel_radius'] / 2.0:.2g}")
    return values


def robot_text(
    name: str, values: Mapping[str, float], known: Mapping[str, Mapping[str, float]], drive: str = "differential"
) -> str:
    """A robot.toml with the values of every figure, those that matter most first; what is not known is marked EDIT.

    Of the sources of known figures the first that has one is named.
    """
    rows, guesses = [], _guesses(drive)
    template, first = ("robot.toml.txt", SIX) if drive == "differential" else ("car.toml.txt", EIGHT)
    for figure in (*first, *(one for one in values if one not in first)):
        cell = f'value = {values[figure]:.6g}, unit = "{UNITS[figure]}"'
        source = next((source for source, figures in known.items() if figure in figures), "")
        how = guesses[figure][1] if figure in guesses else "measure it"
        edit = "" if source else f"  # EDIT: {how}"
        rows.append(f'{figure} = {{ {cell}, source = "{source or "a guess"}" }}{edit}')
    effects = {key: f"{values[key]:.6g}" for key in ("motor_time_constant", "camera_pitch")}
    return fill(template, name=name, figures="\n".join(rows), **effects)


def _car_text(name: str, values: Mapping[str, float]) -> str:
    """A car's body: a box over four wheels, of which the front ones hang on knuckles that turn."""
    common = _dimensions(values)
    base, half, radius = values["wheelbase"], values["wheel_distance"] / 2.0, values["wheel_radius"]
    length, width, height = 1.3 * base, 1.6 * half, 1.2 * radius
    own = {"half_wheelbase": base / 2.0, "middle": 1.3 * radius + height / 2.0}
    own |= _chassis(0.77 * values["mass"], length, width, height)
    common |= {key: f"{number:.6g}" for key, number in own.items()}
    wheels = ""
    for side, sign in (("left", 1.0), ("right", -1.0)):
        rear, front = (f"{x:.6g} {sign * half:.6g} {radius:.6g}" for x in (0.0, base))
        wheels += fill(
            "wheel.urdf.txt", **common, at=f"rear_{side}", joint=f"axle_{side}", parent="chassis", place=rear
        )
        wheels += fill("knuckle.urdf.txt", **common, side=side, place=front)
        hub = {"joint": f"hub_{side}", "parent": f"knuckle_{side}", "place": "0 0 0"}
        wheels += fill("wheel.urdf.txt", **common, at=f"front_{side}", **hub)
    return fill("car.urdf.txt", name=name, wheels=wheels, **common)


def _chassis(mass: float, length: float, width: float, height: float) -> dict[str, float]:
    """A box of this mass [kg] and these sides [m], with its moments of inertia."""
    return {
        "length": length,
        "width": width,
        "height": height,
        "chassis_mass": mass,
        "chassis_ixx": mass * (width**2 + height**2) / 12.0,
        "chassis_iyy": mass * (length**2 + height**2) / 12.0,
        "chassis_izz": mass * (length**2 + width**2) / 12.0,
    }


def _dimensions(values: Mapping[str, float]) -> dict[str, str]:
    """The values of the template of a body: a box between the wheels, its weight behind the axle, on the caster."""
    radius, distance, mass = values["wheel_radius"], values["wheel_distance"], values["mass"]
    length, width, height = 1.2 * distance, 0.7 * distance, 1.2 * radius
    wheel, caster = 0.05 * mass, 0.35 * radius
    numbers = {
        "radius": radius,
        "half_distance": distance / 2.0,
        "tread": 0.6 * radius,
        "torque": values["wheel_torque"],
        "top_speed": 2.0 * values["full_speed"] / radius,
        "middle": radius + height / 2.0,
        "weight_x": -0.15 * distance,
        **_chassis(0.88 * mass, length, width, height),
        "wheel_mass": wheel,
        "wheel_iyy": wheel * radius**2 / 2.0,
        "wheel_ixx": wheel * radius**2 / 4.0,
        "small_mass": 0.01 * mass,
        "small_i": 0.01 * mass * caster**2,
        "caster": caster,
        "caster_x": -0.5 * distance,
        "camera_x": values["camera_forward"],
        "camera_z": values["camera_height"],
        "camera_pitch": values["camera_pitch"] * math.pi / 180.0,
    }
    return {key: f"{number:.6g}" for key, number in numbers.items()}
