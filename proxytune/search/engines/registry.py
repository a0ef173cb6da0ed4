"""The engines by name."""

from importlib.util import find_spec

from proxytune.errors import InputError
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
WITH_OUTPUTS = tuple(engine.name for engine in ENGINES if engine.learns_from == "outputs")
"""What learns from the outputs that a score is computed from."""
DEFAULT_ENGINE = outcomes.ENGINE.name
SCORE_ENGINE = gaussian_process.ENGINE.name
"""The default where a score has no parts."""


def engine_of(name: str) -> Engine:
    """The engine of this name; every look-up goes through here.

    Raises:
        InputError: If there is no such engine.
    """
    for engine in ENGINES:
        if engine.name == name:
            return engine
    raise InputError(f"unknown engine '{name}'; {nearest(name, NAMES)}")


def why_not(name: str, *, composed: bool) -> str:
    """Why an engine cannot be used, in one phrase; empty if it can.

    Args:
        name: Of the engine.
        composed: Whether the score is computed from outcomes that are known.
    """
    try:
        engine = engine_of(name)
    except InputError as problem:
        return str(problem)
    if engine.needs and not installed(engine):
        modules, library, extra = engine.needs
        verb = "are" if len(modules) > 1 else "is"
        remedy = f"pip install 'proxytune[{extra}]', or use another engine"
        return f"'{name}' needs {library}, which {verb} not installed; {remedy}"
    if engine.learns_from == "outputs" and not composed:
        return f"'{name}' models what a score is computed from, and this one has no such parts; use '{SCORE_ENGINE}'"
    return ""


def installed(engine: Engine) -> bool:
    """Whether the library that an engine needs is there."""
    return engine.needs is None or all(find_spec(module) for module in engine.needs.modules)


def make_proposer(name: str, initial: int, goal: Goal | None = None) -> Proposer:
    """The proposer of an engine, with so many trials from the quasi-random design first: all engines share it.

    Args:
        name: Of the engine.
        initial: How many trials come from the design.
        goal: What the outputs of a trial are to come to; None where a score has no such parts.

    Raises:
        InputError: If there is no such engine, or it cannot be used.
    """
    reason = why_not(name, composed=goal is not None)
    if reason:
        raise InputError(reason)
    engine = engine_of(name)
    return AfterDesign(engine.make(goal) if engine.learns_from == "outputs" else engine.make(), initial)


def engine_code(name: str) -> str:
    """A digest of the code that an engine's proposals depend on."""
    return code_of(after_design.__name__, engine_of(name).make.__module__)
