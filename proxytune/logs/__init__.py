"""Logs: commands and measured poses of a robot, as a folder with log.toml, samples.csv and maybe commands.csv.

Whatever reads here raises LogError, in one line with file, line and column, where a log is not as it must be.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
