"""Bags, CSV files, trajectories and arrays of others, made a log.

Whatever reads here raises LogError, in one line with file and place, where a source is not what it takes it for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
