"""A user's own URDF, SDF or MuJoCo model with what was found of wheels and camera; all else in it stays.

What is changed is relative: a wheel's radius grows by its gain, and the wheels' distance by the baseline found over the
robot's own, so that whatever turns velocities into wheel speeds stays as it is. A camera stands where it was found.
"""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from proxytune.arrays import Floats
from proxytune.driving import link_pose, links_called, mounted_camera, origin_of, rotation
from proxytune.errors import InputError
from proxytune.report.export.instance import IN_WHEELS, Instance
from proxytune.report.export.urdf import angles_of, end_of
from proxytune.report.export.xml_patch import XmlPatch

SMALL = 1e-9
XACRO = "is a program that makes a URDF: run `xacro {0} > {1}`, patch {1}, and change in {0} what the diff shows"


@dataclass(frozen=True)
class Wheel:
    """A driven wheel in a file."""

    joint: str
    centre: Floats  # in the frame that wheels and camera share (3,) [m]
    radius_m: float | None  # None of a mesh
    move: Callable[[Floats], None]  # moves it by so much in that frame (3,) [m]
    grow: Callable[[float], None]  # multiplies its radius


@dataclass(frozen=True)
class OwnFile:
    """What a file of another simulator has that may be changed."""

    wheels: tuple[Wheel, Wheel]  # left and right
    aim: Callable[[Floats], None] | None  # gives its only camera a pose (4, 4) in the frame of the wheels
    widen: Callable[[float], None] | None = None  # gives that a vertical field of view [deg]; None where it has none


@dataclass(frozen=True)
class Patched:
    """A patched file: its text, what changed as `diff -u` shows it, and the effects of wheels and camera it has now."""

    text: str
    diff: str
    has: frozenset[str]


def patch(instance: Instance, path: Path, output: Path, wheels: Sequence[str] = ()) -> Patched:
    """A user's own file (.urdf, .sdf, or .xml of MuJoCo) with what was found; the diff calls it as the output.

    The joints of both wheels are found where they are not given. An InputError if they cannot be told, or something is
    beyond what is understood here.
    """
    if path.suffix == ".xacro":
        made = f"{path.name.removesuffix('.xacro').removesuffix('.urdf')}.urdf"
        raise InputError(f"{path}: {XACRO.format(path.name, made)}")
    xml = XmlPatch(path)
    if (reader := READERS.get(xml.root.tag)) is None:
        raise InputError(f"{path}: begins with <{xml.root.tag}>; give a URDF (<robot>), <sdf> or <mujoco>")
    try:
        with np.errstate(invalid="raise", over="raise"):
            own = reader(xml, *_joints(xml, wheels))
            has = set(_change_wheels(instance, own)) | set(_change_camera(instance, own))
    except (ValueError, ArithmeticError, LookupError, RecursionError) as problem:
        what = " ".join(str(problem).split())
        raise InputError(f"{path}: a number or a frame in it is not sound ({what}); correct it") from None
    return Patched(xml.text(), xml.diff(output.name), frozenset(has))


def _change_wheels(instance: Instance, own: OwnFile) -> Iterator[str]:
    left, right = own.wheels
    if not left.centre[1] > right.centre[1]:
        raise InputError(f"joint '{left.joint}' is not to the left of '{right.joint}'; name them: --wheels LEFT,RIGHT")
    wider = 1.0 if instance.steers else instance.baseline_m / instance.figure("effective_baseline")
    apart = (wider - 1.0) * (left.centre[1] - right.centre[1]) / 2.0
    for wheel, gain, side in zip(own.wheels, instance.gains, (1.0, -1.0), strict=True):
        higher = (gain - 1.0) * (wheel.radius_m or instance.figure("wheel_radius"))
        if max(abs(apart), abs(higher)) > SMALL:
            wheel.move(np.array((0.0, side * apart, higher)))
        if abs(gain - 1.0) > SMALL:
            wheel.grow(gain)
    yield from (name for name in IN_WHEELS if instance.robot.catalogue.knows(name))


def _change_camera(instance: Instance, own: OwnFile) -> Iterator[str]:
    """The camera, where it was found to be elsewhere than the robot's figures say."""
    if (found := instance.camera) is None:
        return
    nominal = mounted_camera(instance.robot, ())
    floor = np.mean([wheel.centre for wheel in own.wheels], axis=0)
    floor[2] -= own.wheels[0].radius_m or instance.figure("wheel_radius")
    pose = instance.mounts["camera"].copy()
    pose[:3, 3] = floor + pose[:3, 3]
    names = ("pitch_deg", "roll_deg", "yaw_deg", "height_m", "forward_m")
    if own.aim is not None:
        if any(getattr(found, name) != getattr(nominal, name) for name in names):
            own.aim(pose)
        yield from ("camera_pitch", "camera_roll", "camera_yaw", "camera_height", "camera_forward")
    if own.widen is not None:
        if found.field_of_view_deg != nominal.field_of_view_deg:
            own.widen(found.field_of_view_deg)
        yield "field_of_view"


def _joints(xml: XmlPatch, wheels: Sequence[str]) -> tuple[ET.Element, ET.Element]:
    """The joints of both wheels: those named, those that a plug-in names, or one pair of left and right names."""
    turning = {
        one.get("name", ""): one
        for one in xml.root.iter("joint")
        if one.get("type", "hinge") in ("continuous", "revolute", "hinge")
        and xml.parents[one].tag in ("robot", "model", "body")
    }
    named = [[(one.text or "").strip() for one in xml.root.iter(f"{side}_joint")] for side in ("left", "right")]
    mirrored = ((name, _mirrored(name)) for name in turning if _mirrored(name) != name)
    pairs = [pair for pair in mirrored if pair[1] in turning]
    given = [tuple(wheels)] if wheels else [pair for pair in zip(*named, strict=False) if set(pair) <= set(turning)]
    chosen = given or pairs
    if len(set(chosen)) != 1 or len(chosen[0]) != 2 or not set(chosen[0]) <= set(turning):
        known = ", ".join(filter(None, turning)) or "none"
        remedy = f"name their joints: --wheels LEFT,RIGHT of {known}"
        raise InputError(f"{xml.path}: the driven wheels cannot be told; {remedy}")
    left, right = chosen[0]
    return turning[left], turning[right]


def _mirrored(name: str) -> str:
    words = next((name.replace(a, b) for a, b in (("left", "right"), ("Left", "Right")) if a in name), name)
    return words if words != name else re.sub("(?<![^_])l(?![^_])", "r", name)  # wheel_l_joint


def _urdf(xml: XmlPatch, left: ET.Element, right: ET.Element) -> OwnFile:
    root = xml.root

    def wheel(joint: ET.Element) -> Wheel:
        link = end_of(joint, "child")
        turned = link_pose(root, end_of(joint, "parent"))[:3, :3]
        shapes = [one for body in links_called(root, link) for one in body.iterfind("*/geometry/*[@radius]")]
        meshes = [one for body in links_called(root, link) for one in body.iterfind("collision/geometry/mesh")]

        def grow(factor: float) -> None:
            for shape in shapes:
                xml.set(shape, "radius", _numbers([factor * float(shape.get("radius", "0"))]))
            for mesh in meshes:
                xml.set(mesh, "scale", _numbers([factor * float(v) for v in mesh.get("scale", "1 1 1").split()]))

        def move(by: Floats) -> None:
            _set_origin(xml, joint, origin_of(joint)[:3, 3] + turned.T @ by, None)

        radius = float(shapes[0].get("radius", "0")) if shapes else None
        return Wheel(joint.get("name", ""), link_pose(root, link)[:3, 3], radius, move, grow)

    links = (link.get("name", "") for link in root.iter("link"))
    cameras = [name for name in links if "camera" in name and "optical" not in name]
    mounts = [one for one in root.iter("joint") if end_of(one, "child") in cameras[:1]]

    def aim(pose: Floats) -> None:
        local = np.linalg.inv(link_pose(root, end_of(mounts[0], "parent"))) @ pose
        _set_origin(xml, mounts[0], local[:3, 3], local[:3, :3])

    return OwnFile((wheel(left), wheel(right)), aim if len(cameras) == len(mounts) == 1 else None)


def _set_origin(xml: XmlPatch, joint: ET.Element, place: Floats, turned: Floats | None) -> None:
    values = {"xyz": _numbers(place)} | ({} if turned is None else {"rpy": _numbers(angles_of(turned))})
    if (origin := joint.find("origin")) is None:
        xml.add(joint, "<origin " + " ".join(f'{name}="{value}"' for name, value in values.items()) + "/>")
        return
    for name, value in values.items():
        xml.set(origin, name, value)


class _Sdf:
    """The model of an SDF that the wheels are in."""

    def __init__(self, xml: XmlPatch, model: ET.Element) -> None:
        self.xml, self.model = xml, model
        self.named = {one.get("name", ""): one for tag in ("joint", "frame", "link") for one in model.findall(tag)}

    def pose_of(self, element: ET.Element) -> Floats:
        """The pose of a link, joint or frame in the model's frame."""
        found = element.find("pose")
        above = found.get("relative_to") if found is not None else None
        if not above:  # In whose frame it stands where it does not say so
            of_joint = (element.findtext("child") or "").strip() if element.tag == "joint" else ""
            above = element.get("attached_to", "") if element.tag == "frame" else of_joint
        pose = _six(found)
        return pose if above in ("", "__model__") else np.asarray(self.pose_of(self.named[above]) @ pose)

    def wheel(self, joint: ET.Element) -> Wheel:
        """The wheel of a joint; a link that stands where its joint does is moved with that."""
        link = self.named[(joint.findtext("child") or "").strip()]
        pose = link.find("pose")
        placed = joint if pose is not None and pose.get("relative_to") == joint.get("name") else link
        radii = list(link.iterfind("*/geometry/*/radius"))

        def grow(factor: float) -> None:
            for radius in radii:
                self.xml.set_text(radius, _numbers([factor * float(radius.text or "0")]))

        def move(by: Floats) -> None:
            if (spot := placed.find("pose")) is None:
                raise InputError(f"{self.xml.path}: {placed.tag} '{placed.get('name')}' states no <pose>; give it one")
            turned = (self.pose_of(placed) @ np.linalg.inv(_six(spot)))[:3, :3]
            values = [float(value) for value in (spot.text or "").split()]
            self.xml.set_text(spot, _numbers([*(np.array(values[:3]) + turned.T @ by), *values[3:]]))

        radius = float(radii[0].text or "0") if radii else None
        return Wheel(joint.get("name", ""), self.pose_of(link)[:3, 3], radius, move, grow)


def _sdf(xml: XmlPatch, left: ET.Element, right: ET.Element) -> OwnFile:
    own = _Sdf(xml, xml.parents[left])
    wheels = own.wheel(left), own.wheel(right)
    cameras = [(link, one) for link in own.model.iter("link") for one in link.iterfind("sensor[@type='camera']")]
    if len(cameras) != 1:
        return OwnFile(wheels, None)
    link, sensor = cameras[0]
    spot, across = sensor.find("pose"), sensor.find("camera/horizontal_fov")

    def aim(pose: Floats) -> None:
        local = np.linalg.inv(own.pose_of(link)) @ pose
        values = _numbers([*local[:3, 3], *angles_of(local[:3, :3])])
        if spot is None:
            xml.add(sensor, f"<pose>{values}</pose>")
        else:
            xml.set_text(spot, values)

    def widen(vertical_deg: float) -> None:
        columns, rows = (float(sensor.findtext(f"camera/image/{side}", "1")) for side in ("width", "height"))
        angle = 2.0 * math.atan(columns / rows * math.tan(math.radians(vertical_deg) / 2.0))
        if across is not None:
            xml.set_text(across, _numbers([angle]))

    return OwnFile(wheels, aim, widen if across is not None else None)


def _six(pose: ET.Element | None) -> Floats:
    """A <pose> of six numbers as a transform (4, 4)."""
    numbers = [float(value) for value in ((pose.text if pose is not None else None) or "0 0 0 0 0 0").split()]
    if pose is not None and (pose.get("degrees") == "true" or len(numbers) != 6):
        raise ValueError(f"<pose>{pose.text}</pose>; write x y z roll pitch yaw in metres and radians")
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation(*numbers[3:]), numbers[:3]
    return out


def _mjcf_place(xml: XmlPatch, element: ET.Element) -> Floats:
    """The place of a body or camera in its tree's first body, whose frame all share; none between may be turned."""
    parent = xml.parents[element]
    if parent.tag == "worldbody":
        return np.zeros(3)
    if xml.parents[parent].tag != "worldbody" and set(parent.attrib) & TURNS:
        name = parent.get("name", "")
        raise InputError(f"{xml.path}: body '{name}' is turned; put wheels and camera in one that is not")
    return np.asarray(_mjcf_place(xml, parent) + _place(element))


def _mjcf_wheel(xml: XmlPatch, joint: ET.Element) -> Wheel:
    body = xml.parents[joint]
    round_ones = [one for one in body.findall("geom") if one.get("type", "sphere") in ("sphere", "cylinder")]
    sizes = {one: one.get("size", "").split() for one in round_ones if one.get("size")}

    def grow(factor: float) -> None:
        if not sizes:
            name = body.get("name", "")
            lacks = f"body '{name}' has no sphere or cylinder that states its own size"
            raise InputError(f"{xml.path}: {lacks}; give it one")
        for geom, size in sizes.items():
            xml.set(geom, "size", " ".join([_numbers([factor * float(size[0])]), *size[1:]]))

    def move(by: Floats) -> None:
        xml.set(body, "pos", _numbers(_place(body) + by))

    radius = next((float(size[0]) for size in sizes.values()), None)
    return Wheel(joint.get("name", ""), _mjcf_place(xml, body), radius, move, grow)


def _mjcf(xml: XmlPatch, left: ET.Element, right: ET.Element) -> OwnFile:
    wheels = _mjcf_wheel(xml, left), _mjcf_wheel(xml, right)
    cameras = [one for one in xml.root.iter("camera") if xml.parents[one].tag == "body"]
    if len(cameras) != 1:
        return OwnFile(wheels, None)
    camera = cameras[0]

    def aim(pose: Floats) -> None:
        above = _mjcf_place(xml, camera) - _place(camera)
        for name in TURNS - {"xyaxes"}:
            xml.unset(camera, name)
        xml.set(camera, "pos", _numbers(pose[:3, 3] - above))
        xml.set(camera, "xyaxes", _numbers([*-pose[:3, 1], *pose[:3, 2]]))

    return OwnFile(wheels, aim, lambda angle: xml.set(camera, "fovy", _numbers([angle])))


def _place(element: ET.Element) -> Floats:
    return np.array([float(value) for value in element.get("pos", "0 0 0").split()])


TURNS = {"quat", "euler", "axisangle", "xyaxes", "zaxis"}
"""Attributes by which MuJoCo turns a body or camera."""
Reader = Callable[[XmlPatch, ET.Element, ET.Element], OwnFile]
READERS: dict[str, Reader] = {"robot": _urdf, "sdf": _sdf, "mujoco": _mjcf}


def _numbers(values: Sequence[float] | Floats) -> str:
    if not np.isfinite(values).all():
        raise ValueError("a number is infinite, or none")
    return " ".join(f"{round(float(value), 9) + 0.0:.9g}" for value in values)
