"""Commands of a car as they go to a VESC, the motor controller of F1TENTH's cars: its motor's speed and its servo.

ackermann_to_vesc publishes each as one number on a topic of its own; vesc.yaml has the gains that lead from speed and
wheel angle to them.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.bag import Bag, Topic, choose_times, collect
from proxytune.importing.source import Commands, finite
from proxytune.settings import table_text

KIND = "std_msgs/msg/Float64 of a VESC"
"""What the type of a motor's topic is called where its servo's stands beside it."""
MOTOR, SERVO = "commands/motor/speed", "commands/servo/position"
TOGETHER_S = 0.002
"""Two messages that come within this time are one command."""
GAINS = tuple(f"{of}_{part}" for of in ("speed_to_erpm", "steering_angle_to_servo") for part in ("gain", "offset"))
"""What vesc.yaml calls them: erpm = gain · speed [m/s] + offset, servo = gain · wheel angle [rad] + offset."""


def servo_of(motor: str) -> str:
    """The topic of the servo that belongs to a motor's."""
    return f"{motor.removesuffix(MOTOR)}{SERVO}"


def pair_topics(topics: tuple[Topic, ...]) -> tuple[Topic, ...]:
    """The topics of a bag; a motor's speed with its servo beside it counts as commands of a VESC."""
    filled = {topic.name for topic in topics if topic.count and not topic.lacking and topic.kind.endswith("/Float64")}
    return tuple(
        replace(topic, kind=KIND)
        if topic.name in filled and topic.name.endswith(MOTOR) and servo_of(topic.name) in filled
        else topic
        for topic in topics
    )


def read_vesc(bag: Bag, motor: str, gains: Path | None) -> tuple[Commands, tuple[str, ...]]:
    """Speed [m/s] and wheel angle [rad] of the commands to a VESC, at the times when the bag received them.

    The motor's topic has electrical revolutions per minute; the gains are the car's vesc.yaml.
    """
    if gains is None:
        raise LogError(f"{bag.path}: {motor}: has a VESC's units; give the car's gains by --vesc vesc.yaml")
    speed_gain, speed_offset, servo_gain, servo_offset = _read_gains(gains)
    times, held = [], []
    for topic in (motor, servo_of(motor)):
        stamps, values = collect(bag, topic, lambda message: (message.data,))
        received, _ = choose_times(stamps, "receive", topic)
        order = np.argsort(received, kind="stable")
        times.append(received[order])
        held.append(values[order, 0])
    union = np.unique(np.concatenate(times))
    union = union[union >= max(times[0][0], times[1][0])]
    union = union[np.diff(union, append=np.inf) > TOGETHER_S]
    erpm, servo = (of[np.searchsorted(at, union, side="right") - 1] for at, of in zip(times, held, strict=True))
    columns = ((erpm - speed_offset) / speed_gain, (servo - servo_offset) / servo_gain)
    speed = f"speed is (erpm {-speed_offset:+g}) / {speed_gain:g}"
    angle = f"the wheels' angle (servo {-servo_offset:+g}) / {servo_gain:g}, by {gains}"
    note = f"{servo_of(motor)} is the steering; {speed}, {angle}; times are when the bag received each message."
    return Commands("speed_steering", union, np.column_stack(columns)), (note,)


def _read_gains(path: Path) -> tuple[float, ...]:
    remedy = "give the car's vesc.yaml"
    text = table_text(path, LogError, missing=remedy, no_text=f"cannot be read as text; {remedy}")
    gains = []
    for name in GAINS:
        # At the top in ROS 1, below a node's name in ROS 2.
        stated = re.search(rf"^\s*{name}\s*:\s*([^\s#]+)", text, re.MULTILINE)
        value = None if stated is None else finite(stated[1])
        if value is None or (name.endswith("gain") and value == 0.0):
            shown = "is missing" if stated is None else f"is '{stated[1]}'"
            raise LogError(f"{path}: {name} {shown}; give the vesc.yaml that the car was driven with")
        gains.append(value)
    return tuple(gains)
