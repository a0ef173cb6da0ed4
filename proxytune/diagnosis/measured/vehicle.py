"""The robot that drove a log: one of robots/, or what the log says of its own."""

from dataclasses import replace

import numpy as np

from proxytune.diagnosis.measured.drives import Floats
from proxytune.driving.robot import Robot, read_robot, robot_from_geometry, robot_names
from proxytune.effects import SHIPPED, Catalogue
from proxytune.errors import LogError
from proxytune.logs import GEOMETRY, Log
from proxytune.settings import nearest

NEEDED = {figure: key for key, figure in GEOMETRY.items() if figure != "full_speed"}
"""Figures that a log must state of a robot without a folder, and their keys in log.toml."""


def robot_of(log: Log, name: str | None = None, catalogue: Catalogue = SHIPPED) -> Robot:
    """The robot of a log, or the named one in its stead, with the effects that it may have.

    A robot without a folder needs wheel radius and baseline in log.toml; its full speed is stated there too, or taken
    from the fastest command, or from how fast it drove.

    Raises:
        LogError: If the robot is unknown and the log does not state its geometry.
        SettingsError: If the named robot is unknown.
    """
    names = robot_names(catalogue.folder)
    if log.robot in names or name not in (None, log.robot):
        return replace(read_robot(name or log.robot, catalogue.folder), catalogue=catalogue)
    missing = [key for figure, key in NEEDED.items() if figure not in log.geometry]
    if missing:
        raise LogError(
            f"{log.name}: robot '{log.robot}' is unknown ({nearest(log.robot, names)}) and log.toml does not "
            f"state {' and '.join(missing)}; state them, or name a robot with --robot"
        )
    geometry = {**log.geometry}
    geometry.setdefault("full_speed", _full_speed(log))
    return replace(robot_from_geometry(log.robot, geometry, log.rate_hz), catalogue=catalogue)


def _full_speed(log: Log) -> float:
    """The wheel speed [m/s] that a duty of 1 stands for, rounded up to two digits."""
    commands = np.concatenate([episode.commands for episode in log.episodes])
    if log.command == "twist":
        fastest = np.abs(commands[:, 0]) + np.abs(commands[:, 1]) * log.geometry["effective_baseline"] / 2.0
    elif log.command == "wheel_speed":
        fastest = np.abs(commands).max(axis=1) * log.geometry["wheel_radius"]
    else:
        fastest = _speed_per_duty(log)
    digit = 10.0 ** (np.floor(np.log10(max(float(fastest.max(initial=0.0)), 1e-3))) - 1)
    return float(np.ceil(float(fastest.max(initial=1e-3)) / digit - 1e-9) * digit)


def _speed_per_duty(log: Log) -> Floats:
    """Metres a second that the robot drove per unit of duty, over all drives together (1,)."""
    every = max(1, round(log.rate_hz / 2.0))
    way = duty = 0.0
    for episode in log.episodes:
        places = episode.poses[::every, :2]
        known = np.flatnonzero(np.isfinite(places).all(axis=1))
        if len(known) > 1:
            between = slice(known[0] * every, known[-1] * every)
            way += float(np.hypot(*np.diff(places[known], axis=0).T).sum())
            duty += float(np.abs(episode.held[between].mean(axis=1)).sum()) / log.rate_hz
    return np.array([way / duty if duty > 0.0 else 1e-3])
