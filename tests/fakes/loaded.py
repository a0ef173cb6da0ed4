"""Loads every module of proxytune and what these need, for forks that need not, and has them draw blank figures."""

import gc
from importlib import import_module
from pkgutil import walk_packages

from blank import blank
from matplotlib.figure import Figure

import proxytune

Figure.savefig = blank
for module in walk_packages(proxytune.__path__, "proxytune."):
    if module.name != "proxytune.__main__":
        import_module(module.name)
for name in ("matplotlib.pyplot", "skopt", "sklearn.gaussian_process", "scipy.optimize", "scipy.stats"):
    import_module(name)
gc.freeze()
