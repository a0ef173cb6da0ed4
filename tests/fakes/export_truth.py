"""Instances to export, and how MuJoCo drives them."""

import numpy as np

from proxytune.driving import read_robot
from proxytune.report.export.instance import Instance

ROBOT = read_robot("duckiebot")


def instance(robot=ROBOT, intervals=None, **theta):
    """The Duckiebot with these values, written `effect__parameter` where an effect has more than one."""
    named = {name.replace("__", "."): value for name, value in theta.items()}
    return Instance(robot, {**robot.theta, **named}, intervals or {}, "a test")


def driven_by(mujoco, model, controls, rate_hz=60.0):
    """Poses of a MuJoCo model after each of its controls."""
    data, poses = mujoco.MjData(model), []
    for tick, control in enumerate(controls, start=1):
        data.ctrl[:] = control
        while data.time < tick / rate_hz - 1e-9:
            mujoco.mj_step(model, data)
        w, _, _, z = data.qpos[3:7]
        poses.append((*data.qpos[:2], 2.0 * np.arctan2(z, w)))
    return np.array(poses)
