"""Commands of a log as fractions of full speed, each held from its own time."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.robot import Robot
from proxytune.errors import LogError
from proxytune.logs import Log, LogEpisode

Floats = NDArray[Any]


def duties_of(log: Log, robot: Robot, commands: Floats) -> Floats:
    """A log's commands (…, 2) as fractions of full wheel speed, left and right.

    Raises:
        LogError: If the log has no commands, or they ask for more than full speed.
    """
    figures = robot.figures
    if log.command == "duty":
        return commands
    if log.command == "none":
        raise LogError(f"{log.name}: has no commands; a log needs duties, twists or wheel speeds to learn from")
    if log.command == "twist":
        turn = commands[..., 1] * figures["effective_baseline"] / 2.0
        speeds = np.stack((commands[..., 0] - turn, commands[..., 0] + turn), axis=-1)
    else:
        speeds = commands * figures["wheel_radius"]
    duties = speeds / figures["full_speed"]
    fastest = float(np.abs(duties).max())
    if fastest > 1.0 + 1e-9:
        raise LogError(
            f"{log.name}: asks a wheel for {fastest * figures['full_speed']:.2f} m/s, more than the robot's full speed "
            f"{figures['full_speed']:g} m/s; state a higher full_speed_m_s in log.toml"
        )
    return np.asarray(duties)


class Commands(NamedTuple):
    """An episode's commands.

    Attributes:
        times: When each was issued (M,) [s after the first sample]; earlier ones are below 0.
        duties: As fractions of full speed (M, 2).
        rest: What was in force before the first sample (2,).
        ticks_each: Ticks that each lasts, where they go with the samples; else 0.
    """

    times: Floats
    duties: Floats
    rest: Floats
    ticks_each: int

    def over_ticks(self, length: int, tick_hz: float) -> Floats:
        """The mean of the command in force over each tick (length, 2); each is held from its own time."""
        if self.ticks_each:
            held = np.repeat(self.duties, self.ticks_each, axis=0)
            return np.concatenate((held, np.repeat(held[-1:], length - len(held), axis=0)))
        ends = np.array((min(0.0, self.times[0]) - 1.0, *self.times, max(length / tick_hz, self.times[-1]) + 1.0))
        held = np.concatenate((self.rest[None], self.duties))
        total = np.concatenate((np.zeros((1, 2)), np.cumsum(held * np.diff(ends)[:, None], axis=0)))
        edges = np.arange(length + 1) / tick_hz
        gone = np.stack([np.interp(edges, ends, channel) for channel in total.T], axis=1)
        return np.asarray(np.diff(gone, axis=0) * tick_hz)

    def ticks(self, length: int, tick_hz: float) -> NDArray[np.bool_]:
        """The ticks within which one is issued (length,)."""
        at = np.floor(self.times * tick_hz + 1e-6).astype(int)
        found = np.zeros(length, dtype=bool)
        found[at[(at >= 0) & (at < length)]] = True
        return found


def commands_of(log: Log, robot: Robot, episode: LogEpisode, ticks: int) -> Commands:
    """An episode's commands; `ticks` are a sample's.

    Raises:
        LogError: If it has none, or they ask for more than full speed.
    """
    duties, rest = duties_of(log, robot, episode.commands), _rest(episode, robot)
    if episode.issued is None:
        return Commands(np.arange(len(duties)) / log.rate_hz, duties, rest, ticks)
    times = episode.issued - episode.times[0]
    before = np.flatnonzero(times < -1e-9)
    return Commands(times, duties, duties[before[-1]] if len(before) and episode.wheels is None else rest, 0)


def commands_a_second(log: Log, episodes: Sequence[LogEpisode]) -> float:
    """How often commands are issued: with the samples, or at the usual interval between their own times."""
    between = [np.diff(e.issued) for e in episodes if e.issued is not None and len(e.issued) > 1]
    return 1.0 / float(np.median(np.concatenate(between))) if between else log.rate_hz


def _rest(episode: LogEpisode, robot: Robot) -> Floats:
    """What the wheels did before the first row: turned as measured, or stood."""
    if episode.wheels is None or not np.isfinite(episode.wheels[0]).all():
        return np.zeros(2)
    return np.asarray(episode.wheels[0] * robot.figures["wheel_radius"] / robot.figures["full_speed"])
