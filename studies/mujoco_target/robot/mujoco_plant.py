"""A Duckiebot in MuJoCo: contact, dry friction in the gears, rotors with inertia, and commands that arrive late."""

import math
from collections import deque
from pathlib import Path

import mujoco
import numpy as np

BODY = Path(__file__).with_name("body.xml")
TICK_S = 1.0 / 60.0
UPRIGHT = 0.7
"""Below this cosine of its tilt the robot has fallen over."""


class MujocoPlant:
    """One robot on a floor without end; a plant as proxytune's are, but of duties (time, 2), not of twists."""

    def __init__(self, start, *, gear_friction, motor_imbalance, latency):
        """Put the robot down.

        Args:
            start: x [m], y [m], heading [rad] of the middle of the axle.
            gear_friction: Torque that it takes to turn a gear, as a share of the motor's stall torque.
            motor_imbalance: How much stronger the right motor is than nominal, and the left one weaker.
            latency: Between a command and the motors [s].
        """
        self._model = mujoco.MjModel.from_xml_string(BODY.read_text(encoding="utf-8"))
        stall = self._model.actuator_gainprm[:, 0].copy()
        for side, sign in enumerate((-1.0, 1.0)):
            self._model.dof_frictionloss[6 + side] = gear_friction * stall[side]
            self._model.actuator_gainprm[side, 0] = stall[side] * (1.0 + sign * motor_imbalance)
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:2] = start[:2]
        self._data.qpos[3:7] = math.cos(start[2] / 2.0), 0.0, 0.0, math.sin(start[2] / 2.0)
        mujoco.mj_forward(self._model, self._data)
        self._heading = float(start[2])
        steps = round(latency / self._model.opt.timestep)
        self._late = deque([(0.0, 0.0)] * steps)
        self._substeps = round(TICK_S / self._model.opt.timestep)

    def move(self, duties):
        """Drive duties (time, 2), each for a tick: the poses after each (time, 3), and whether it has fallen over."""
        poses = np.empty((len(duties), 3))
        for index, duty in enumerate(duties):
            for _ in range(self._substeps):
                self._late.append(duty)
                self._data.ctrl[:] = self._late.popleft()
                mujoco.mj_step(self._model, self._data)
            poses[index] = self._pose()
        upwards = self._data.body("chassis").xmat[8]
        return poses, bool(upwards < UPRIGHT)

    def _pose(self):
        chassis = self._data.body("chassis")
        heading = math.atan2(chassis.xmat[3], chassis.xmat[0])
        self._heading += math.remainder(heading - self._heading, math.tau)
        return chassis.xpos[0], chassis.xpos[1], self._heading

    def __enter__(self):
        return self

    def __exit__(self, kind, problem, trace):
        return None
