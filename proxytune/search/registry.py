"""The engines by name, and a digest of the code that the proposals of each depend on.

With code of another digest the next trials of a study may not be those that it would have had: that is told, unless
proxytune/lineage.toml states that the code proposes the same.
"""

import ast
import inspect
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from proxytune.errors import ExtensionError, InputError, to_install
from proxytune.extensions import load, plugins
from proxytune.identity import meaning_of
from proxytune.lineage import named
from proxytune.search.engine import RANDOM, SOBOL, AfterDesign, Engine, outside_proposer
from proxytune.search.loop import Goal, Proposer
from proxytune.search.optuna_bridge import TREE_PARZEN
from proxytune.search.outcomes import COMPOSITE, OUTCOMES
from proxytune.search.surrogate import GAUSSIAN_PROCESS
from proxytune.settings import nearest

FOLDER = Path(__file__).resolve().parent.parent
ROOM = "search"
"""A digest looks into this room alone: the ground floor and the simulators are not what proposes."""


@cache
def code_of(*modules: str) -> str:
    """A digest of what modules of the search mean, with all that they import of it."""
    found: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        parts = module.split(".")[1:]
        path = FOLDER.joinpath(*parts).with_suffix(".py")
        if module not in found and parts[:1] == [ROOM] and path.is_file():
            found[module] = path
            waiting.extend(_imported(path))
    return meaning_of(found.values(), FOLDER)[:12]


def _imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


ENGINES: tuple[Engine, ...] = (
    OUTCOMES,
    COMPOSITE,
    GAUSSIAN_PROCESS,
    RANDOM,
    SOBOL,
    TREE_PARZEN,
)
"""A new engine is a module of its own and a line here; each says all about itself (engine.py)."""
ENGINE_NAMES = tuple(engine.name for engine in ENGINES)
"""What a study may name."""
DEFAULT_ENGINE = OUTCOMES.name
SCORE_ENGINE = GAUSSIAN_PROCESS.name
"""The default where a score has no parts."""


def engine_of(name: str, beside: Path | None = None) -> Engine:
    """The engine of this name, shipped, of a plug-in or `module:attribute`; every look-up goes through here.

    Modules beside a study come before the installed ones. An InputError if there is no such engine, or it is none.
    """
    shipped = {engine.name: engine for engine in ENGINES}
    if name not in shipped and ":" not in name and name not in plugins("engine", shipped):
        told = f"unknown engine '{name}' (your own is written module:attribute)"
        raise InputError(f"{told}; {nearest(name, ENGINE_NAMES)}")
    engine = load(name, kind="engine", beside=beside, shipped=shipped)
    if not isinstance(engine, Engine):
        kind = type(engine).__name__
        raise ExtensionError(f"engine '{name}' is a {kind}; make it a proxytune.search.engine.Engine")
    return engine if engine.name == name else replace(engine, name=name)


def why_not(name: str, *, composed: bool, beside: Path | None = None) -> str:
    """Why an engine cannot be used, in one phrase; empty if it can. A score is composed where outcomes are known."""
    try:
        return why_not_engine(engine_of(name, beside), composed=composed)
    except InputError as problem:
        return str(problem)


def why_not_engine(engine: Engine, *, composed: bool) -> str:
    """The same of an engine at hand."""
    if engine.needs and not is_installed(engine):
        modules, library, extra = engine.needs
        verb = "are" if len(modules) > 1 else "is"
        remedy = f"{to_install(extra)}, or use another engine"
        return f"'{engine.name}' needs {library}, which {verb} not installed; {remedy}"
    if engine.learns_from == "outputs" and not composed:
        remedy = f"use '{SCORE_ENGINE}'"
        return f"'{engine.name}' models what a score is computed from, and this one has no such parts; {remedy}"
    return ""


def is_installed(engine: Engine) -> bool:
    """Tell whether the library that an engine needs is there."""
    return engine.needs is None or all(find_spec(module) for module in engine.needs.modules)


def make_proposer(engine: str | Engine, initial: int, goal: Goal | None = None) -> Proposer:
    """The proposer of an engine, with so many trials from the quasi-random design first: all engines share it.

    Without a goal a score has no parts. An InputError if there is no such engine, or it cannot be used.
    """
    engine = engine_of(engine) if isinstance(engine, str) else engine
    reason = why_not_engine(engine, composed=goal is not None)
    if reason:
        raise InputError(reason)
    if engine.name not in ENGINE_NAMES:
        return AfterDesign(outside_proposer(engine, goal), initial)
    return AfterDesign(engine.make(goal) if engine.learns_from == "outputs" else engine.make(), initial)


def engine_code(engine: str | Engine) -> str:
    """A digest of the code that an engine's proposals depend on."""
    engine = engine_of(engine) if isinstance(engine, str) else engine
    code = code_of(AfterDesign.__module__, engine.make.__module__)
    if engine.name in ENGINE_NAMES:
        return named(f"engine {engine.name}", code)
    source = Path(inspect.getfile(engine.make))
    return f"{named('design', code)} {meaning_of([source], source.parent)[:12]}"
