"""A robot from a URDF that there is already: read, and made as the bullet plant drives it."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from proxytune import driving
from proxytune.errors import InputError
from proxytune.report import end_of
from proxytune.skeletons.writing import Skeleton, check_figures, completed, robot_text, then

WHEELS = ("wheel_radius", "wheel_distance")
"""Of these robot.toml and URDF must say the same: the bullet plant drives by both."""


def robot_from_urdf(name: str, path: Path, figures: Mapping[str, float], drive: str = "differential") -> Skeleton:
    """A robot.toml with what a URDF says, and that URDF with its axles and origin as the bullet plant has them.

    Args:
        name: Of the robot and its folder.
        path: The URDF.
        figures: What the user states; it goes before what the URDF says, save for the wheels.
        drive: "differential", or "ackermann" for a car.

    Raises:
        InputError: If its wheels cannot be told, or a number in it is none.
    """
    check_figures(figures)
    root = driving.parse_urdf(path)
    with driving.sound_urdf(path):
        _drop_empty_roots(root, path)
        named = tuple(_name_joints(root, path)) if drive == "ackermann" else ()
        body = driving.read_body(root, path)
        radius = body.left.radius_m or body.right.radius_m or figures.get("wheel_radius")
        if not radius:
            raise InputError(f"{path}: its wheels are meshes; state their radius: --figures wheel_radius=METRES")
        base = {"wheelbase": driving.wheelbase_of(root, body, path)} if drive == "ackermann" else {}
        notes = (*named, *_conform(root, body, radius))
    read = {name: value for name, value in _figures(body, radius).items() if name in WHEELS or name not in figures}
    read |= base
    known = {f"read from {path.name}": read, "given to `new robot`": figures}
    values = completed({**figures, **read}, drive)
    ET.indent(root)
    urdf = ET.tostring(root, encoding="unicode") + "\n"
    said = ", ".join(f"{figure} {value:.4g}" for figure, value in read.items())
    lines = (f"read from {path.name}: {said}", *notes, "what a URDF cannot know is marked EDIT in robot.toml")
    return Skeleton({"robot.toml": robot_text(name, values, known, drive), f"{name}.urdf": urdf}, then(name), lines)


def _name_joints(root: ET.Element, path: Path) -> Iterator[str]:
    """Name the joints of a car as the bullet plant calls them; says what was changed."""
    joints = [joint for joint in root.iter("joint") if joint.get("type") in ("revolute", "continuous")]
    upright = [joint for joint in joints if abs(_axis(root, joint)[2]) > driving.ACROSS]
    front = {link for joint in upright for link in _below(root, end_of(joint, "child"))}
    rear = [one for one in joints if abs(_axis(root, one)[1]) > driving.ACROSS and end_of(one, "child") not in front]
    for what, found, names in (("steer", upright, driving.STEERS), ("are driven, behind", rear, driving.AXLES)):
        pair = [one for one in found if one.get("name") in names] or found
        if len(pair) != 2:
            told = ", ".join(one.get("name", "") for one in pair) or "none"
            problem = f"{path}: a car needs two joints that {what}, found {told}"
            raise InputError(f"{problem}; call them {' and '.join(names)}")
        pair.sort(key=lambda joint: -driving.link_pose(root, end_of(joint, "child"))[1, 3])
        for joint, name in zip(pair, names, strict=True):
            if joint.get("name") != name:
                yield f"joint {joint.get('name')} is now called {name}"
            joint.set("name", name)
            joint.set("type", "revolute" if names is driving.STEERS else "continuous")


def _below(root: ET.Element, link: str) -> Iterator[str]:
    """A link and all that hang on it."""
    yield link
    for joint in root.iter("joint"):
        if end_of(joint, "parent") == link:
            yield from _below(root, end_of(joint, "child"))


def _axis(root: ET.Element, joint: ET.Element) -> NDArray[np.float64]:
    """Direction of a joint's axis in the root link's frame (3,)."""
    axis = joint.find("axis")
    said = axis.get("xyz", "1 0 0") if axis is not None else "1 0 0"
    direction = np.array([float(value) for value in said.split()])
    turned = driving.link_pose(root, end_of(joint, "child"))[:3, :3]
    return np.asarray(turned @ (direction / np.linalg.norm(direction)))


def _figures(body: driving.Body, radius: float) -> dict[str, float]:
    """The figures that a URDF states; the camera's from its pose, the lens looking along its x axis."""
    read = {"wheel_radius": radius, "wheel_distance": body.wheel_distance}
    read |= {"mass": body.mass_kg} if body.mass_kg > 0.0 else {}
    read |= {"wheel_torque": body.left.effort} if body.left.effort > 0.0 else {}
    if body.camera is None:
        return read
    origin, place, looks = _origin(body, radius), body.camera[:3, 3], body.camera[:3, 0]
    pitch = max(0.0, math.degrees(math.asin(max(-1.0, min(1.0, -looks[2])))))
    forward, height = max(0.0, place[0] - origin[0]), place[2] - origin[2]
    return read | ({"camera_forward": forward, "camera_height": height, "camera_pitch": pitch} if height > 0.0 else {})


def _origin(body: driving.Body, radius: float) -> NDArray[np.float64]:
    """The middle of the axle, on the floor, in the root link's frame (3,) [m]."""
    return np.asarray((body.left.centre + body.right.centre) / 2.0 - (0.0, 0.0, radius))


def _conform(root: ET.Element, body: driving.Body, radius: float) -> Iterator[str]:
    """Make the URDF what the bullet plant drives, its axles named and pointing to the left; says what was changed."""
    for wheel, name in zip((body.left, body.right), driving.AXLES, strict=True):
        joint = next(one for one in root.iter("joint") if one.get("name") == wheel.joint)
        joint.set("name", name)
        axis = joint.find("axis")
        if wheel.axis[1] < 0.0 and axis is not None:
            axis.set("xyz", _text(-float(value) for value in axis.get("xyz", "1 0 0").split()))
        if wheel.joint != name:
            yield f"joint {wheel.joint} is now called {name}"
    shift = _origin(body, radius)
    if np.abs(shift).max() > 1e-9:
        _move(root, shift)
        yield f"the origin is now the middle of the axle, on the floor: moved by {_text(shift)} m"
    yield from _complete_links(root)
    yield "if an episode ends at once, the root link touches the floor: make its casters links of their own"


def _complete_links(root: ET.Element) -> Iterator[str]:
    """Take out looks that are meshes, which nothing draws, and give every link a mass."""
    links = list(root.iter("link"))
    meshes = [(link, one) for link in links for one in link.findall("visual") if one.find("geometry/mesh") is not None]
    for link, mesh in meshes:
        link.remove(mesh)
    if meshes:
        yield f"{len(meshes)} meshes of its looks are left out: nothing draws them"
    without = [link for link in links if link.find("inertial") is None]
    for link in without:
        driving.add_little_mass(link)
    if without:
        yield f"links without mass have 1 g now: {', '.join(link.get('name', '') for link in without)}"
    if root.find("link/collision/geometry/mesh") is not None:
        yield "EDIT: write boxes, cylinders or spheres for the meshes under <collision>: they are not found here"


def _drop_empty_roots(root: ET.Element, path: Path) -> None:
    """Take out root links without mass (as base_footprint): PyBullet would give them 1 kg."""
    while True:
        children = {child.get("link") for child in root.findall("joint/child")}
        link = next((one for one in root.findall("link") if one.get("name") not in children), None)
        if link is None:
            raise InputError(f"{path}: has no root link: its joints go round in a circle; correct it")
        below = [one for one in root.findall("joint") if end_of(one, "parent") == link.get("name")]
        if link.find("inertial") is not None or len(below) != 1 or below[0].get("type") != "fixed":
            return
        if not np.allclose(driving.origin_of(below[0])[:3, :3], np.eye(3)):
            raise InputError(f"{path}: joint '{below[0].get('name')}' turns the robot; write its URDF with x forward")
        root.remove(link)
        root.remove(below[0])


def _move(root: ET.Element, shift: NDArray[np.float64]) -> None:
    """Move the root link's origin: everything that hangs on it moves the other way."""
    children = {child.get("link") for child in root.findall("joint/child")}
    link = next(one for one in root.findall("link") if one.get("name") not in children)
    parts = [part for kind in ("inertial", "visual", "collision") for part in link.findall(kind)]
    for element in (*parts, *(one for one in root.findall("joint") if end_of(one, "parent") == link.get("name"))):
        if (origin := element.find("origin")) is None:
            origin = ET.SubElement(element, "origin")
        before = np.array([float(value) for value in origin.get("xyz", "0 0 0").split()])
        origin.set("xyz", _text(before - shift))


def _text(values: Iterator[float] | NDArray[np.float64]) -> str:
    return " ".join(f"{float(value) + 0.0:.9g}" for value in values)
