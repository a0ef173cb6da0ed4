"""Families of Gymnasium environments, from the lines of a [domain] table in a folder with toys.py."""

import shutil
import tomllib
from pathlib import Path

from proxytune.environments.family import gymnasium_family
from proxytune.settings import Section

TOYS = Path(__file__).with_name("toys.py")
PENDULUM = """
environment = "Pendulum-v1"
steps = 20
[parameters]
gravity = { argument = "g", low = 8.0, high = 12.0, neutral = 10.0, unit = "m/s²" }
mass = { attribute = "unwrapped.m", low = 0.5, high = 2.0, neutral = 1.0, unit = "kg" }
"""
CART = 'environment = "toys:Cart"\nsteps = 12\nrate_hz = 10.0\n'
SCREEN = 'environment = "toys:Screen"\nsteps = 8\n'


def domain(folder, text):
    """A [domain] table of a study in this folder."""
    shutil.copy(TOYS, folder / "toys.py")
    return Section(folder / "study.toml", "domain.", tomllib.loads(text))


def family(folder, text, model=""):
    """Its family, with a model.toml if there is one."""
    path = folder / "model.toml" if model else None
    if path:
        path.write_text(model, encoding="utf-8")
    return gymnasium_family(domain(folder, text), model=path)
