"""Names of values, of code and of versions: a digest under which something is kept, or found to have changed.

Code is digested by what it means, so that comments, layout and docstrings do not change it: Python by its syntax
without strings that stand alone, TOML by its values, anything else by its bytes, and so is what cannot be parsed. The
walk over a syntax tree is our own, since `ast.dump` differs between versions of Python. Docstrings are left out even
where code reads them when it runs.
"""

import ast
import functools
import hashlib
import inspect
import json
import os
import re
import textwrap
import tomllib
import warnings
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import CodeType
from typing import Any

LEFT_OUT = ("kind", "type_comment")
"""Fields of a syntax tree without a meaning: the u of u"…", and comments."""
NOT_A_PACKAGE = ("study.toml", "pyvenv.cfg", "play_commands.py")
"""A folder with one of these is another study, an environment, or the drive that a diagnosis designed."""
FILTER = re.compile(rb'#!/usr/bin/env python3\n"""Bend .* as proxytune found ')
"""The head of a filter that `export` wrote: a ROS node, which a study next to it does not import."""


def digest(*values: object, length: int = 16) -> str:
    """A short name of plain values: of a single text by its bytes, of others by what `repr` shows of them together."""
    text = values[0] if len(values) == 1 and isinstance(values[0], str) else repr(values)
    return hashlib.sha256(text.encode()).hexdigest()[:length]


def meaning_of(paths: Iterable[Path], root: Path) -> str:
    """A digest of what files mean and of their names within a folder, in any order; an OSError if one is unreadable."""
    parts = {path.relative_to(root).as_posix(): _meaning(path.suffix, path.read_bytes()) for path in paths}
    return hashlib.sha256(repr(sorted(parts.items())).encode()).hexdigest()


def files_beside(folder: Path) -> list[Path]:
    """The files of a folder and of those within it that can be packages, hidden ones and filters left out, in order."""
    found, known = [], set[str]()
    for here, folders, names in os.walk(folder, followlinks=True):
        known.add(os.path.realpath(here))
        # A link may lead back up.
        within = [name for name in folders if os.path.realpath(Path(here, name)) not in known]
        named = [name for name in within if name.isidentifier() and name != "__pycache__"]
        folders[:] = [name for name in named if not any(Path(here, name, one).exists() for one in NOT_A_PACKAGE)]
        found += [Path(here, name) for name in names if not name.startswith(".")]
    return sorted(path for path in found if not (is_module(path) and FILTER.match(path.read_bytes())))


def modules_beside(folder: Path) -> list[Path]:
    """A user's own modules: those in a folder and in its packages, in order."""
    return [path for path in files_beside(folder) if is_module(path)]


def is_module(path: Path) -> bool:
    """True if this is a module of Python."""
    return path.suffix == ".py" and path.is_file()


def meaning_of_code(thing: Any) -> str:
    """A digest of what a function means, or an object by its class; of its source, or where there is none its code.

    What it calls is not looked at.
    """
    kept: tuple[Any, ...] = ()
    while isinstance(thing, functools.partial):
        thing, kept = thing.func, (*kept, repr(thing.args), repr(sorted(thing.keywords.items())))
    if isinstance(thing, str):
        return digest(thing, *kept)
    code: Any = thing if inspect.isroutine(thing) or inspect.isclass(thing) else type(thing)
    try:
        return digest(_meaning(".py", _source_of(code)), *kept)
    except (OSError, TypeError):
        return digest(_compiled(getattr(code, "__code__", code.__qualname__)), *kept)


@functools.lru_cache(maxsize=256)
def _source_of(code: Any) -> bytes:
    """Kept, since Python reads a whole module for each of its classes."""
    return textwrap.dedent(inspect.getsource(code)).encode()


def _compiled(code: Any) -> object:
    """Compiled code without places in files."""
    if not isinstance(code, CodeType):
        return code
    return code.co_code, code.co_names, [_compiled(one) for one in code.co_consts]


@functools.lru_cache(maxsize=4096)
def _meaning(suffix: str, content: bytes) -> str:
    """A digest of one file's meaning."""
    known = content
    try:
        if suffix == ".py":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                known = "\n".join(_walk(ast.parse(content), [])).encode()
        if suffix == ".toml":
            known = json.dumps(tomllib.loads(content.decode()), sort_keys=True, default=str).encode()
    except (SyntaxError, ValueError, RecursionError):
        pass
    return hashlib.sha256(known).hexdigest()


def _walk(node: Any, lines: list[str]) -> list[str]:
    """Add a syntax tree to lines; fields that are empty go unsaid, since newer versions of Python have more of them."""
    if isinstance(node, list):
        lines.append("[")
        for one in node:
            # A string that is a statement of its own is a docstring, or describes an attribute.
            constant = one.value if isinstance(one, ast.Expr) else None
            if not (isinstance(constant, ast.Constant) and isinstance(constant.value, str)):
                _walk(one, lines)
        lines.append("]")
    elif isinstance(node, ast.AST):
        lines.append(f"({type(node).__name__}")
        for name, value in ast.iter_fields(node):
            if name not in LEFT_OUT and value is not None and value != []:
                lines.append(name)
                _walk(value, lines)
        lines.append(")")
    else:
        lines.append(repr(node))
    return lines


CALLED = {"numpy": "NumPy", "pybullet": "PyBullet", "scipy": "SciPy", "optuna": "Optuna"}
"""What a package is called, where that is not its name."""


def versions_of(packages: Iterable[str]) -> dict[str, str]:
    """The version of each package, without importing it; "unknown" where it was not installed as one."""
    versions = {}
    for package in packages:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "unknown"
    return versions


def version_changes(before: Mapping[str, str], after: Mapping[str, str]) -> list[str]:
    """Each package whose version has changed, as one phrase for the user."""
    both = {name: (before.get(name, "not used"), after.get(name, "not used")) for name in {**after, **before}}
    return [f"{CALLED.get(name, name)} {new} (was {old})" for name, (old, new) in both.items() if old != new]
