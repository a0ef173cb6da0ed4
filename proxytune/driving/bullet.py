"""All that runs on PyBullet: the reference plant and the reference camera.

The plant drives the robot's URDF with contact, friction and limited torque; it takes an emptied world again, since a
new one takes as long as a second's driving. The camera is PyBullet's own renderer over the floor's picture.
"""

import contextlib
import math
import os
import struct
import weakref
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from proxytune.driving.optics import SKY, CameraFigures, lens_rays, orientation
from proxytune.driving.plants import AXLES, STEERS
from proxytune.driving.road_picture import Floor
from proxytune.driving.robot import Robot
from proxytune.effects import Signal
from proxytune.errors import InputError
from proxytune.files import temporary_folder


@contextlib.contextmanager
def _standard_error_closed() -> Iterator[None]:
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


try:
    # PyBullet's extension module announces its build time on standard error, where people look for what went wrong
    with _standard_error_closed():
        import pybullet
except ImportError:
    pybullet = None


def has_pybullet() -> bool:
    """Tell whether PyBullet is installed."""
    return pybullet is not None


def need_pybullet(instead: str = 'plant = "planar"') -> None:
    """Refuse to go on without PyBullet, which has wheels for Python 3.11 alone."""
    if not has_pybullet():
        built = "with a C++ compiler run `pip install pybullet`"
        raise InputError(f"PyBullet is not installed; take {instead}, use Python 3.11, or {built}")


_empty: list[int] = []


def open_world() -> int:
    """A world with nothing in it; physics are the same, to the bit, in a new one and in one that was left."""
    need_pybullet()
    return _empty.pop() if _empty else int(pybullet.connect(pybullet.DIRECT))


def leave_world(world: int) -> None:
    """Empty a world for whoever opens one next; once is enough, twice does no harm."""
    if world not in _empty:
        pybullet.resetSimulation(physicsClientId=world)
        _empty.append(world)


SUBSTEPS = 4
"""Physics steps in a tick: 240 Hz at 60 ticks per second."""
SOLVER_ITERATIONS = 20
"""Enough for one robot on a floor: 50, PyBullet's default, moves it by less than a millimetre a metre."""


SLOWEST = 0.01
"""Below this speed [m/s] a car's front wheels stay as they are."""
SERVO_TORQUE = 100.0
"""Servos hold their wheels whatever the floor does [N m]: how they follow is the steering effects' part."""
_SPEED: Any = getattr(pybullet, "VELOCITY_CONTROL", None)
_WHERE: Any = getattr(pybullet, "getBasePositionAndOrientation", None)
_GAINS = (0.1, 1.0, 0.0)
"""The mode of a driven wheel, the call that tells its body's place, and the gains that PyBullet takes by itself."""


class BulletPlant:
    """One robot in a PyBullet world of its own.

    The wheels are 0.10 m apart in the URDF, but scrubbing tyres turn the robot as if they were `effective_baseline`
    apart. So each rim is driven at the speed that reaches the floor after scrub. A car's rear wheels are driven so too,
    and its front wheels point along their own circles.
    """

    def __init__(self, robot: Robot, start: Signal, tick_s: float) -> None:
        urdf = robot.body()
        self._world = open_world()
        self._tick_s = tick_s
        self._radius = robot.figures["wheel_radius"]
        self._half_distance = robot.figures["wheel_distance"] / 2.0
        self._torques = [robot.figures["wheel_torque"]] * 2
        self._wheelbase = robot.figures["wheelbase"] if robot.drive == "ackermann" else 0.0
        self._body = self._build(urdf, start)
        self._heading = float(start[2])

    def move(self, twists: Signal) -> tuple[Signal, bool]:
        """Follow twists, each for one tick."""
        poses, world, body, reached = [], self._world, self._body, self._heading
        half, radius, (left, right), (torque, _) = self._half_distance, self._radius, self._wheels, self._torques
        spin, step, where = pybullet.setJointMotorControl2, pybullet.stepSimulation, _WHERE
        ahead, aside, _ = self._offset
        for forward, sideways, yaw in twists.tolist():
            if self._steered:
                self._steer(forward, yaw)
            # Arguments by place, and one call a wheel: a list of two takes longer to unpack
            spin(body, left, _SPEED, 0.0, (forward - yaw * half) / radius, torque, *_GAINS, world)
            spin(body, right, _SPEED, 0.0, (forward + yaw * half) / radius, torque, *_GAINS, world)
            step(world)
            if sideways:
                self._shift(sideways * self._tick_s)
            centre, (x, y, z, w) = where(body, world)
            heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
            reached += math.remainder(heading - reached, math.tau)
            cosine, sine = math.cos(heading), math.sin(heading)
            axle_x, axle_y = centre[0] - cosine * ahead + sine * aside, centre[1] - sine * ahead - cosine * aside
            poses.append((axle_x, axle_y, reached))
        self._heading = reached
        # On its wheels and caster the chassis touches nothing
        touched = pybullet.getContactPoints(bodyA=body, linkIndexA=-1, physicsClientId=world)
        return np.array(poses).reshape(-1, 3), bool(touched)

    def _build(self, urdf: Path, start: Signal) -> int:
        world: dict[str, Any] = {"physicsClientId": self._world}
        pybullet.setGravity(0.0, 0.0, -9.81, **world)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._tick_s,
            numSubSteps=SUBSTEPS,
            numSolverIterations=SOLVER_ITERATIONS,
            deterministicOverlappingPairs=1,
            **world,
        )
        floor = pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE, **world), **world)
        pybullet.changeDynamics(floor, -1, lateralFriction=1.0, **world)
        turn = pybullet.getQuaternionFromEuler((0.0, 0.0, float(start[2])))
        body: int = pybullet.loadURDF(str(urdf), (0.0, 0.0, 0.0), **world)
        joints = range(pybullet.getNumJoints(body, **world))
        named = {pybullet.getJointInfo(body, joint, **world)[1].decode(): joint for joint in joints}
        self._wheels = [named[name] for name in AXLES]
        self._steered = [named[name] for name in STEERS] if self._wheelbase else []
        if self._steered:  # PyBullet brakes every joint of its own accord
            for joint in set(joints) - {*self._wheels, *self._steered}:
                pybullet.setJointMotorControl2(body, joint, _SPEED, force=0.0, **world)
        self._floor = floor
        self._offset = pybullet.getDynamicsInfo(body, -1, **world)[3]
        centre = np.array((start[0], start[1], 0.0)) + pybullet.rotateVector(turn, list(self._offset))
        pybullet.resetBasePositionAndOrientation(body, centre.tolist(), turn, **world)
        for link in range(-1, pybullet.getNumJoints(body, **world)):
            pybullet.changeDynamics(body, link, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0, **world)
        return body

    def _steer(self, forward: float, yaw: float) -> None:
        """Point each front wheel along its own circle; a car that stands keeps them as they are."""
        if abs(forward) < SLOWEST:
            return
        for joint, aside in zip(self._steered, (self._half_distance, -self._half_distance), strict=True):
            angle = math.atan2(self._wheelbase * yaw, abs(forward - yaw * aside)) * math.copysign(1.0, forward)
            pybullet.setJointMotorControl2(
                self._body, joint, pybullet.POSITION_CONTROL, angle, force=SERVO_TORQUE, physicsClientId=self._world
            )

    def _shift(self, sideways: float) -> None:
        """Slide the body to its left [m], its speeds unchanged: wheels cannot push that way."""
        centre, turn = pybullet.getBasePositionAndOrientation(self._body, physicsClientId=self._world)
        linear, angular = pybullet.getBaseVelocity(self._body, physicsClientId=self._world)
        step = pybullet.rotateVector(turn, (0.0, sideways, 0.0))
        moved = [a + b for a, b in zip(centre, step, strict=True)]
        pybullet.resetBasePositionAndOrientation(self._body, moved, turn, physicsClientId=self._world)
        pybullet.resetBaseVelocity(self._body, linear, angular, physicsClientId=self._world)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        leave_world(self._world)


OVERSAMPLING = 4
"""Rendered pixels along a side of a pixel, averaged: the renderer itself does nothing against aliasing."""
NEAR, FAR, HORIZON = 0.01, 100.0, 50.0
"""What the renderer draws, and how far the floor goes on around the map [m]: at 50 m it ends 0.1° below the horizon."""
WIDEST = math.tan(math.radians(80.0))
"""How far off its axis a lens that distorts can look, to either side: beyond, pictures without distortion are huge."""


class BulletCamera:
    """The same picture as GroundPlaneCamera's, in a PyBullet world of its own that ends with the camera.

    The renderer draws straight lines straight: rays of a lens that bends them are looked up in a larger such picture.
    """

    def __init__(self, figures: CameraFigures, floor: Floor) -> None:
        """Lay the floor, and find where the rays of a lens that distorts meet the picture without distortion."""
        need_pybullet('camera = "ground_plane"')
        self._figures = self._straight = figures
        self._places: NDArray[np.float64] | None = None
        if figures.k1 != 0.0:
            slopes = _slopes(figures)
            self._straight = _without_distortion(figures, slopes)
            middle = np.reshape([self._straight.columns / 2.0, self._straight.rows / 2.0], (2, 1, 1))
            self._places = (middle + self._straight.focal * slopes)[::-1] * OVERSAMPLING - 0.5
        self._world: int = pybullet.connect(pybullet.DIRECT)
        self._end = weakref.finalize(self, pybullet.disconnect, self._world)
        _lay(floor, self._world)

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """Render what it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""
        figures = self._figures
        pictures = np.empty((len(poses), figures.rows, figures.columns, 3), dtype=np.uint8)
        for picture, pose in zip(pictures, poses, strict=True):
            straight = self._shoot(pose)
            fine: NDArray[Any] = straight
            if self._places is not None:  # linear between the pixels of the picture without distortion
                colours = np.moveaxis(straight, -1, 0)
                fine = np.stack([map_coordinates(one, self._places, np.float32, order=1) for one in colours], axis=-1)
            fine = fine.reshape(figures.rows, OVERSAMPLING, figures.columns, OVERSAMPLING, 3)
            picture[:] = np.rint(fine.mean(axis=(1, 3)))
        return pictures

    def close(self) -> None:
        """End the camera's PyBullet world; once is enough, twice does no harm."""
        self._end()

    def _shoot(self, pose: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        figures = self._straight
        width, height = figures.columns * OVERSAMPLING, figures.rows * OVERSAMPLING
        _, _, colours, _, bodies = pybullet.getCameraImage(
            width,
            height,
            _view(figures, pose),
            _projection(figures, width, height),
            shadow=0,
            lightAmbientCoeff=1.0,
            lightDiffuseCoeff=0.0,
            lightSpecularCoeff=0.0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._world,
        )
        picture = np.reshape(np.asarray(colours, dtype=np.uint8), (height, width, 4))[..., :3].copy()
        picture[np.reshape(bodies, (height, width)) < 0] = SKY
        return picture


def _slopes(figures: CameraFigures) -> NDArray[np.float64]:
    """Slopes right and down at which each fine pixel looks, (2, rows, columns), per metre along the lens' axis."""
    places = ((np.arange(count * OVERSAMPLING) + 0.5) / OVERSAMPLING for count in (figures.columns, figures.rows))
    columns, rows = np.meshgrid(*places)
    ahead, left, up = np.moveaxis(lens_rays(figures, columns, rows) @ orientation(figures), -1, 0)
    slopes: NDArray[np.float64] = np.clip(np.stack((-left / ahead, -up / ahead)), -WIDEST, WIDEST)
    return slopes


def _without_distortion(figures: CameraFigures, slopes: NDArray[np.float64]) -> CameraFigures:
    """A camera at the same place, with the same focal length, that draws straight lines straight and sees as much."""
    focal = figures.focal
    columns, rows = (2 * math.ceil(focal * float(np.abs(one).max()) + 0.5) for one in slopes)
    field = math.degrees(2.0 * math.atan(rows / 2.0 / focal))
    plain = {"k1": 0.0, "centre_right": 0.0, "centre_down": 0.0, "aspect": 1.0}
    return replace(figures, columns=columns, rows=rows, field_of_view_deg=field, **plain)


def _projection(figures: CameraFigures, width: int, height: int) -> list[float]:
    """OpenGL's projection matrix of the lens without distortion."""
    matrix = list(pybullet.computeProjectionMatrixFOV(figures.field_of_view_deg, width / height, NEAR, FAR))
    matrix[0] *= figures.aspect
    # The renderer looks through the lower left corner of a pixel instead of its middle
    matrix[8] += 1.0 / width - 2.0 * figures.centre_right * figures.rows / figures.columns
    matrix[9] += 1.0 / height + 2.0 * figures.centre_down
    return matrix


def _view(figures: CameraFigures, pose: NDArray[np.floating[Any]]) -> tuple[float, ...]:
    """OpenGL's view matrix of the camera on a robot at this pose."""
    x, y, heading = (float(value) for value in pose)
    cos, sin = np.cos(heading), np.sin(heading)
    eye = np.array([x + cos * figures.forward_m, y + sin * figures.forward_m, figures.height_m])
    axes = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ orientation(figures)
    return tuple(pybullet.computeViewMatrix(eye, eye + axes[:, 0], axes[:, 2]))


def _lay(floor: Floor, world: int) -> None:
    """Nine rectangles with the floor's picture on the middle one and its edge drawn out over the others."""
    size = floor.pixels.shape[0]
    texel, far = 0.5 / size, size / floor.pixels_per_metre
    inset = 0.5 / floor.pixels_per_metre
    places = floor.origin + np.array([-HORIZON, inset, far - inset, far + HORIZON])
    textures = np.array([texel, texel, 1.0 - texel, 1.0 - texel])
    corners = [4 * row + column for row in range(3) for column in range(3)]
    triangles = [corner + step for corner in corners for step in (0, 1, 5, 0, 5, 4)]
    shape = pybullet.createVisualShape(
        pybullet.GEOM_MESH,
        vertices=[[x, y, 0.0] for y in places for x in places],
        uvs=[[u, v] for v in textures for u in textures],
        normals=[[0.0, 0.0, 1.0]] * 16,
        indices=triangles,
        physicsClientId=world,
    )
    body = pybullet.createMultiBody(0, -1, shape, physicsClientId=world)
    with temporary_folder() as folder:
        # An uncompressed TGA, whose rows go up and whose pixels are blue, green, red
        path = folder / "floor.tga"
        header = struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, size, size, 24, 0)
        path.write_bytes(header + floor.pixels[..., ::-1].tobytes())
        texture = pybullet.loadTexture(str(path), physicsClientId=world)
    pybullet.changeVisualShape(body, -1, textureUniqueId=texture, rgbaColor=(1, 1, 1, 1), physicsClientId=world)
