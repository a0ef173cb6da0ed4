"""The bullet plant: the robot's URDF with contact, friction and limited torque, in PyBullet."""

import math
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import pybullet

from proxytune.driving.bullet.worlds import leave_world, open_world
from proxytune.driving.robot import Robot
from proxytune.effects import Signal

SUBSTEPS = 4
"""Physics steps in a tick: 240 Hz at 60 ticks per second."""

SOLVER_ITERATIONS = 20
"""Enough for one robot on a floor: 50, PyBullet's default, moves it by less than a millimetre a metre."""


class BulletPlant:
    """One robot in a PyBullet world of its own.

    The wheels are 0.10 m apart in the URDF, but scrubbing tyres turn the robot as if they were `effective_baseline`
    apart. So each rim is driven at the speed that reaches the floor after scrub.
    """

    def __init__(self, robot: Robot, start: Signal, tick_s: float) -> None:
        urdf = robot.body()
        self._world = open_world()
        self._tick_s = tick_s
        self._radius = robot.figures["wheel_radius"]
        self._half_distance = robot.figures["wheel_distance"] / 2.0
        self._torques = [robot.figures["wheel_torque"]] * 2
        self._body = self._build(urdf, start)
        self._heading = float(start[2])

    def move(self, twists: Signal) -> tuple[Signal, bool]:
        """Follow twists, each for one tick."""
        poses = []
        for forward, sideways, yaw in twists.tolist():
            self._spin(forward, yaw)
            pybullet.stepSimulation(self._world)
            if sideways:
                self._shift(sideways * self._tick_s)
            poses.append(self._pose())
        return np.array(poses).reshape(-1, 3), self._crashed()

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
        self._wheels = self._find_wheels(body)
        self._floor = floor
        self._offset = pybullet.getDynamicsInfo(body, -1, **world)[3]
        centre = np.array((start[0], start[1], 0.0)) + pybullet.rotateVector(turn, list(self._offset))
        pybullet.resetBasePositionAndOrientation(body, centre.tolist(), turn, **world)
        for link in range(-1, pybullet.getNumJoints(body, **world)):
            pybullet.changeDynamics(body, link, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0, **world)
        return body

    def _find_wheels(self, body: int) -> list[int]:
        joints = range(pybullet.getNumJoints(body, physicsClientId=self._world))
        names = {pybullet.getJointInfo(body, j, physicsClientId=self._world)[1].decode(): j for j in joints}
        return [names["axle_left"], names["axle_right"]]

    def _spin(self, forward: float, yaw: float) -> None:
        difference = yaw * self._half_distance
        pybullet.setJointMotorControlArray(
            self._body,
            self._wheels,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[(forward - difference) / self._radius, (forward + difference) / self._radius],
            forces=self._torques,
            physicsClientId=self._world,
        )

    def _shift(self, sideways: float) -> None:
        """Slide the body to its left [m], its speeds unchanged: wheels cannot push that way."""
        centre, turn = pybullet.getBasePositionAndOrientation(self._body, physicsClientId=self._world)
        linear, angular = pybullet.getBaseVelocity(self._body, physicsClientId=self._world)
        step = pybullet.rotateVector(turn, (0.0, sideways, 0.0))
        moved = [a + b for a, b in zip(centre, step, strict=True)]
        pybullet.resetBasePositionAndOrientation(self._body, moved, turn, physicsClientId=self._world)
        pybullet.resetBaseVelocity(self._body, linear, angular, physicsClientId=self._world)

    def _pose(self) -> tuple[float, float, float]:
        centre, (x, y, z, w) = pybullet.getBasePositionAndOrientation(self._body, physicsClientId=self._world)
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        self._heading += math.remainder(heading - self._heading, math.tau)
        cosine, sine = math.cos(heading), math.sin(heading)
        ahead, left, _ = self._offset
        return centre[0] - cosine * ahead + sine * left, centre[1] - sine * ahead - cosine * left, self._heading

    def _crashed(self) -> bool:
        """Whether the chassis touches anything: on its wheels and caster it never does."""
        return bool(pybullet.getContactPoints(bodyA=self._body, linkIndexA=-1, physicsClientId=self._world))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        leave_world(self._world)
