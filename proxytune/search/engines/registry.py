"""The engines by name."""

import inspect
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from proxytune.errors import ExtensionError, InputError
from proxytune.extensions import load, plugins
from proxytune.meaning import meaning_of
from proxytune.search.digest import code_of
from proxytune.search.engines import (
    after_design,
    botorch_nei,
    composite,
    gaussian_process,
    optuna_gp,
    outcomes,
    random_points,
    scikit_optimize,
    sobol,
    tree_parzen,
)
from proxytune.search.engines.after_design import AfterDesign
from proxytune.search.engines.engine import Engine
from proxytune.search.engines.outside import outside_proposer
from proxytune.search.goal import Goal
from proxytune.search.proposer import Proposer
from proxytune.settings import nearest

ENGINES: tuple[Engine, ...] = (
    outcomes.ENGINE,
    composite.ENGINE,
    gaussian_process.ENGINE,
    random_points.ENGINE,
    sobol.ENGINE,
    tree_parzen.ENGINE,
    scikit_optimize.ENGINE,
    optuna_gp.ENGINE,
    botorch_nei.ENGINE,
)
"""A new engine is a module of its own and a line here; each says all about itself (engine.py)."""

NAMES = tuple(engine.name for engine in ENGINES)
"""What can be compared."""
STUDY_ENGINES = tuple(engine.name for engine in ENGINES if engine.in_studies)
"""What a study may name."""
DEFAULT_ENGINE = outcomes.ENGINE.name
SCORE_ENGINE = gaussian_process.ENGINE.name
"""The default where a score has no parts."""


def engine_of(name: str, beside: Path | None = None) -> Engine:
    """The engine of this name; every look-up goes through here.

    Args:
        name: Of a shipped engine or of a plug-in, or `module:attribute` of one's own.
        beside: The folder whose modules come before the installed ones.

    Raises:
        InputError: If there is no such engine, or it is none.
    """
    shipped = {engine.name: engine for engine in ENGINES}
    if name not in shipped and ":" not in name and name not in plugins("engine", shipped):
        raise InputError(f"unknown engine '{name}' (your own is written module:attribute); {nearest(name, NAMES)}")
    engine = load(name, kind="engine", beside=beside, shipped=shipped)
    if not isinstance(engine, Engine):
        kind = type(engine).__name__
        raise ExtensionError(f"engine '{name}' is a {kind}; make it a proxytune.search.engines.engine.Engine")
    return engine if engine.name == name else replace(engine, name=name)


def why_not(name: str, *, composed: bool, beside: Path | None = None) -> str:
    """Why an engine cannot be used, in one phrase; empty if it can.

    Args:
        name: Of the engine.
        composed: Whether the score is computed from outcomes that are known.
        beside: The folder whose modules come before the installed ones.
    """
    try:
        return why_not_engine(engine_of(name, beside), composed=composed)
    except InputError as problem:
        return str(problem)


def why_not_engine(engine: Engine, *, composed: bool) -> str:
    """The same of an engine at hand."""
    if engine.needs and not installed(engine):
        modules, library, extra = engine.needs
        verb = "are" if len(modules) > 1 else "is"
        remedy = f"pip install 'proxytune[{extra}]', or use another engine"
        return f"'{engine.name}' needs {library}, which {verb} not installed; {remedy}"
    if engine.learns_from == "outputs" and not composed:
        remedy = f"use '{SCORE_ENGINE}'"
        return f"'{engine.name}' models what a score is computed from, and this one has no such parts; {remedy}"
    return ""


def installed(engine: Engine) -> bool:
    """Whether the library that an engine needs is there."""
    return engine.needs is None or all(find_spec(module) for module in engine.needs.modules)


def make_proposer(engine: str | Engine, initial: int, goal: Goal | None = None) -> Proposer:
    """The proposer of an engine, with so many trials from the quasi-random design first: all engines share it.

    Args:
        engine: The engine, or the name of a shipped one.
        initial: How many trials come from the design.
        goal: What the outputs of a trial are to come to; None where a score has no such parts.

    Raises:
        InputError: If there is no such engine, or it cannot be used.
    """
    engine = engine_of(engine) if isinstance(engine, str) else engine
    reason = why_not_engine(engine, composed=goal is not None)
    if reason:
        raise InputError(reason)
    if engine.name not in NAMES:
        return AfterDesign(outside_proposer(engine, goal), initial)
    return AfterDesign(engine.make(goal) if engine.learns_from == "outputs" else engine.make(), initial)


def engine_code(engine: str | Engine) -> str:
    """A digest of the code that an engine's proposals depend on."""
    engine = engine_of(engine) if isinstance(engine, str) else engine
    code = code_of(after_design.__name__, engine.make.__module__)
    if engine.name in NAMES:
        return code
    source = Path(inspect.getfile(engine.make))
    return f"{code} {meaning_of([source], source.parent)[:12]}"
