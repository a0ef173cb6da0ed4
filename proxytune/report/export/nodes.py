"""ROS 2 nodes: one stands before the driver and bends commands as was found, one plays a designed drive."""

import tomllib
from collections.abc import Sequence
from pprint import pformat

import numpy as np

from proxytune.diagnosis import Diagnosis, commands_as
from proxytune.driving import REQUIRED, Robot
from proxytune.effects import effect_of, is_learnt
from proxytune.logs import CAR_COMMANDS, COMMANDS
from proxytune.report.export.instance import BENT, FILTER, Instance, header
from proxytune.report.writing import fill

RATE_HZ = 60.0
"""How often the node tells the driver a velocity; it is also the tick of proxytune's own plants."""


def node_text(instance: Instance, has: Sequence[str] = ()) -> str:
    """The node as a Python file: all values in it, no other file needed."""
    names = REQUIRED[instance.robot.drive]
    kinds = instance.robot.catalogue
    known = {
        name: value
        for name, value in sorted(instance.theta.items())
        if is_learnt(name) or kinds.effect(effect_of(name)).stage in BENT
    }
    return fill(
        "ackermann_filter.py.txt" if instance.steers else "cmd_vel_filter.py.txt",
        head="\n".join(header(instance, FILTER, has)).replace("\\", "/").replace('"""', "'''"),
        theta=pformat(known, sort_dicts=False),
        figures=pformat({name: float(instance.figure(name)) for name in names}, sort_dicts=False),
        has=repr(tuple(has)),
        rate=RATE_HZ,
        reverse=instance.robot.reverse,
    )


def player_text(diagnosis: Diagnosis) -> str:
    """The node for the next drive of a diagnosis that has one, as a Python file."""
    drive, kind = diagnosis.next_drive, diagnosis.command
    assert drive is not None
    told = tomllib.loads(fill("player.toml"))["ackermann" if kind in CAR_COMMANDS else "twist"]
    return fill(
        "player.py.txt",
        **told,
        times=drive.times,
        room=" × ".join(f"{side:.1f}" for side in drive.room),
        columns=" and ".join(COMMANDS[kind]),
        names=repr(COMMANDS[kind]),
        matrix=pformat(_to_velocity(kind, diagnosis.robot)),
        rate=round(drive.rate_hz, 6),
    )


def _to_velocity(kind: str, robot: Robot) -> tuple[tuple[float, ...], ...]:
    """How the columns of a kind of commands add up to a velocity: rows of the shares of both columns."""
    if kind == "twist":
        return ((1.0, 0.0), (0.0, 1.0))
    unit = np.eye(2)
    own = commands_as(kind, robot, unit)
    velocities = commands_as("speed_steering" if kind in CAR_COMMANDS else "twist", robot, unit)
    return tuple(tuple(float(f"{share:.9g}") for share in row) for row in (np.linalg.inv(own) @ velocities).T.tolist())


def commands_text(diagnosis: Diagnosis) -> str:
    """The next drive of a diagnosis that has one as a log's commands.csv, in the log's kind of commands."""
    drive = diagnosis.next_drive
    assert drive is not None
    rows = commands_as(diagnosis.command, diagnosis.robot, drive.commands).tolist()
    lines = [
        f"next,{number / drive.rate_hz:.4f},{first:.7g},{second:.7g}" for number, (first, second) in enumerate(rows)
    ]
    return "\n".join([",".join(("episode", "time", *COMMANDS[diagnosis.command])), *lines]) + "\n"
