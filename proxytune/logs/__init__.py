"""Logs: commands and measured poses of a robot, as a folder with log.toml, samples.csv and maybe commands.csv."""

from proxytune.logs.log import COMMANDS, GEOMETRY, Frames, Log, LogEpisode, Measured
from proxytune.logs.reading import read_log

__all__ = ["COMMANDS", "GEOMETRY", "Frames", "Log", "LogEpisode", "Measured", "read_log"]
