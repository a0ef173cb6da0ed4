"""Driving recorded commands without an agent or a camera, and measuring the poses."""

import numpy as np

from proxytune.driving.episode import TICK_HZ, Instance, measured
from proxytune.driving.plant import Plant
from proxytune.effects import Setting, Signal


def follow(instance: Instance, plant: Plant, start: Signal, duties: Signal, seed: int) -> Signal:
    """Drive commands on open floor.

    Args:
        instance: Whose effects bend commands, motion and measurement.
        plant: What moves, at its start.
        start: That start (3,): x [m], y [m], heading [rad].
        duties: Commands (rows, 2), one per control step.
        seed: Of everything random in the effects.

    Returns:
        The measured pose at each command (rows, 3).
    """
    figures = instance.robot.figures
    hold = round(TICK_HZ / figures["control_rate"])
    train = instance.drivetrain
    memory = train.begin(Setting(TICK_HZ, np.zeros(2), figures, seed, start[2:], start[None, :2]))
    poses = [start[None]]
    for command in duties[:-1]:
        twists, memory = train.apply(np.repeat(command[None], hold, axis=0), memory)
        poses.append(plant.move(twists)[0])
    return np.asarray(measured(instance, np.concatenate(poses), seed)[::hold])
