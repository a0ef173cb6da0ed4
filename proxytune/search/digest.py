"""Which code something depends on: with other code, a finished run may not be what would be run today."""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOM = "proxytune.search"
FOLDER = Path(__file__).parent


@cache
def code_of(*modules: str) -> str:
    """A digest of modules of the search and of all that they import of it, directly or not."""
    found: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        path = FOLDER / f"{module.removeprefix(ROOM).removeprefix('.')}.py"
        if module not in found and path.is_file():
            found[module] = path
            waiting.extend(_imported(path))
    files = [found[module] for module in sorted(found)]
    return hashlib.sha256(b"".join(path.name.encode() + path.read_bytes() for path in files)).hexdigest()[:12]


def _imported(path: Path) -> Iterator[str]:
    """What a module imports, anywhere in it, by full names."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
