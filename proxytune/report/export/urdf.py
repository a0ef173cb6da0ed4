"""A robot's URDF with what was found of its wheels, its camera and the tracked point."""

import math
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from proxytune import driving
from proxytune.arrays import Floats
from proxytune.report.export.instance import Instance, xml_comment


def urdf_text(instance: Instance) -> str:
    """A URDF of a domain instance: a literal drive in it turns and pulls as was found.

    A wheel that turns faster than nominal is a larger one; wheels stand as far apart as the turn rate shows it.

    Raises:
        SettingsError: If the robot has no URDF, its axles are not to be found there, or a number in it is none.
    """
    path = instance.robot.body()
    root = driving.parse_urdf(path)
    driving.read_body(root, path)
    with driving.sound_urdf(path):
        for side, (axle, gain, limit) in enumerate(zip(driving.AXLES, instance.gains, instance.limits, strict=True)):
            joint = next(one for one in root.iter("joint") if one.get("name") == axle)
            _set_wheel(root, joint, (0.5 - side) * instance.baseline_m, instance.figure("wheel_radius"), gain)
            top_speed = limit * instance.figure("full_speed") / instance.figure("wheel_radius")
            _part(joint, "limit", effort="0").set("velocity", f"{top_speed:.6g}")
        if offset := instance.value("steering_offset", "offset", 0.0):
            turned = driving.rotation(0.0, 0.0, math.radians(offset * instance.figure("wheel_angle")))
            for joint in (one for one in root.iter("joint") if one.get("name") in driving.STEERS):
                pose = driving.origin_of(joint)
                pose[:3, :3] = pose[:3, :3] @ turned
                _set_origin(joint, pose)
        for link, pose in instance.mounts.items():
            _mount(root, link, pose)
    ET.indent(root)
    comment = xml_comment(instance, "urdf", 5)
    return f'<?xml version="1.0"?>\n<!-- {comment} -->\n{ET.tostring(root, encoding="unicode")}\n'


def _set_wheel(root: ET.Element, joint: ET.Element, left_m: float, radius_m: float, gain: float) -> None:
    """Give a wheel its place and its radius; it goes on touching the floor."""
    parent, link = end_of(joint, "parent"), end_of(joint, "child")
    centre = driving.link_pose(root, link)
    centre[1, 3] = left_m
    centre[2, 3] += (gain - 1.0) * radius_m
    _set_origin(joint, np.linalg.inv(driving.link_pose(root, parent)) @ centre)
    for element in driving.links_called(root, link)[:1]:
        for geometry in (*element.iterfind("*/geometry/sphere"), *element.iterfind("*/geometry/cylinder")):
            geometry.set("radius", f"{gain * float(geometry.get('radius', radius_m)):.9g}")


def _mount(root: ET.Element, link: str, pose: Floats) -> None:
    """Fix a link to the robot at a pose in the root link's frame; where there is none of that name, add it."""
    if joints := [one for one in root.iter("joint") if end_of(one, "child") == link]:
        _set_origin(joints[0], np.linalg.inv(driving.link_pose(root, end_of(joints[0], "parent"))) @ pose)
        return
    driving.add_little_mass(ET.SubElement(root, "link", name=link))
    joint = ET.SubElement(root, "joint", name=f"{link}_mount", type="fixed")
    children = {end_of(one, "child") for one in root.iter("joint")}
    names = (one.get("name", "") for one in root.findall("link"))
    ET.SubElement(joint, "parent", link=next(name for name in names if name not in children))
    ET.SubElement(joint, "child", link=link)
    _set_origin(joint, pose)


def _set_origin(joint: ET.Element, pose: Floats) -> None:
    """Write a pose as xyz and rpy, unless it is the one that stands there."""
    if np.allclose(driving.origin_of(joint), pose, atol=1e-12):
        return
    origin = _part(joint, "origin")
    origin.set("xyz", numbers_text(pose[:3, 3]))
    origin.set("rpy", numbers_text(angles_of(pose[:3, :3])))


def _part(element: ET.Element, tag: str, **otherwise: str) -> ET.Element:
    found = element.find(tag)
    return ET.SubElement(element, tag, otherwise) if found is None else found


def end_of(joint: ET.Element, end: str) -> str:
    """Name of the link at an end of a joint, its parent or child; empty where it has none."""
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def angles_of(turned: Floats) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a rotation (3, 3) [rad]."""
    with warnings.catch_warnings():
        # Straight up or down, roll and yaw are one angle: it takes that for the one and 0 for the other, and warns
        warnings.simplefilter("ignore", UserWarning)
        return tuple(Rotation.from_matrix(turned).as_euler("xyz").tolist())


def numbers_text(values: Iterable[float]) -> str:
    """Numbers as an attribute of XML has them; what rounds to zero has no sign."""
    return " ".join(f"{round(float(value), 12) + 0.0:.9g}" for value in values)
