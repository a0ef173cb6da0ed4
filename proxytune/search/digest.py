"""Which code something depends on: with code of another meaning, a finished run may not be what would be run today."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from proxytune.meaning import meaning_of

FOLDER = Path(__file__).resolve().parent.parent
ROOMS = ("search", "comparison")
"""What a digest looks into: the ground floor and the simulators are not what proposes."""


@cache
def code_of(*modules: str) -> str:
    """A digest of what modules of the search or a comparison mean, with all that they import of these."""
    found: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        parts = module.split(".")[1:]
        path = FOLDER.joinpath(*parts).with_suffix(".py")
        if module not in found and parts[:1] and parts[0] in ROOMS and path.is_file():
            found[module] = path
            waiting.extend(_imported(path))
    return meaning_of(found.values(), FOLDER)[:12]


def _imported(path: Path) -> Iterator[str]:
    """What a module imports, anywhere in it, by full names."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
