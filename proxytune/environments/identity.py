"""What the name of a family's episodes depends on besides its settings: our code, and the user's files."""

import functools
from pathlib import Path

from proxytune.identity import files_beside, meaning_of

PACKAGE = Path(__file__).resolve().parent.parent
MODULES = (
    "actuators",
    "agents",
    "episode",
    "family",
    "making",
    "models",
    "parameters",
    "sensors",
    "settings",
    "signals",
    "spaces",
)
"""Of this room, those that play episodes."""
READ_BY_CODE = (".py", ".xml", ".urdf", ".sdf", ".zip", ".npz", ".pt", ".onnx")
"""Modules, bodies and policies: what a study makes itself, as tables and figures, is none of them."""


@functools.lru_cache
def code_meaning() -> str:
    """What the code of effects and of this room means."""
    own = [Path(__file__).with_name(f"{module}.py") for module in MODULES]
    return meaning_of([*(PACKAGE / "effects").rglob("*.py"), *own], PACKAGE)


def folder_meaning(folder: Path) -> str:
    """What the modules, bodies and policies of a user's folder mean."""
    return meaning_of((path for path in files_beside(folder) if path.suffix in READ_BY_CODE), folder)
