"""Logs: commands and measured poses of a robot, as a folder with log.toml, samples.csv and maybe commands.csv."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
