"""Confirming on the bullet plant what the planar plant found."""

import numpy as np

from proxytune.diagnosis.horizon.windows import Windows, pose_errors_along
from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.model.replay import measured_paths, twists_of
from proxytune.driving.bullet.plant import BulletPlant
from proxytune.space import Theta


def has_body(drives: Drives) -> bool:
    """Whether the bullet plant has a body for this robot."""
    return drives.robot.urdf is not None


def bullet_pose_errors(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """How far the bullet plant's pose is from the measured one (M, 2): distance [m], heading [rad].

    Each episode is driven in one go from its first command; windows compare the motion since their beginning.
    """
    twists = twists_of(drives, theta)
    poses = np.zeros((len(twists), twists.shape[1], 3))
    for episode in np.unique(drives.episode):
        last = int(drives.last[drives.episode == episode].max())
        with BulletPlant(drives.robot, np.zeros(3), 1.0 / drives.tick_hz) as plant:
            poses[episode, :last], _ = plant.move(twists[episode, :last])
    return pose_errors_along(drives, measured_paths(drives, theta, poses), windows)
