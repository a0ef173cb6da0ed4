"""Steps that are kept: one whose output is there, made from the same inputs, is not done again."""

import hashlib
import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from proxytune.errors import StoreError
from proxytune.logs import Log
from proxytune.report.writing import write_text
from proxytune.running.progress import Watcher

FILE_NAME = "loop.json"


class Teller(Protocol):
    """Hears how a loop goes."""

    def say(self, line: str) -> None:
        """A step begins, or there is something to be known at once."""
        ...

    def episodes(self, total: int) -> AbstractContextManager[Watcher]:
        """So many episodes at most are driven."""
        ...

    def diagnosis(self, log: Log) -> AbstractContextManager[Callable[[str], None]]:
        """A log is diagnosed; gives what hears of each step of that."""
        ...


@dataclass(frozen=True)
class Step:
    """A step of a loop.

    Attributes:
        name: What it is called.
        inputs: A digest of all that its output depends on.
        output: The file that is there once it is done.
        do: Makes the output.
    """

    name: str
    inputs: str
    output: Path
    do: Callable[[], object]


class Kept:
    """What a loop has done so far, in loop.json: each step's digest of its inputs, written once its output is there."""

    def __init__(self, folder: Path) -> None:
        """Read what is known.

        Raises:
            StoreError: If loop.json cannot be read.
        """
        self._path = folder / FILE_NAME
        self._inputs: dict[str, str] = _read(self._path)

    def inputs_of(self, name: str) -> str | None:
        """The digest of the inputs that a step's output was made of; None where it was never done."""
        return self._inputs.get(name)

    def has(self, step: Step) -> bool:
        """Whether a step is done."""
        return self._inputs.get(step.name) == step.inputs and step.output.exists()

    def run(self, step: Step) -> None:
        """Do a step.

        Raises:
            RunError: If loop.json cannot be written.
        """
        self._write({name: inputs for name, inputs in self._inputs.items() if name != step.name})
        step.do()
        self._write({**self._inputs, step.name: step.inputs})

    def _write(self, inputs: dict[str, str]) -> None:
        # Until a step has been done again, what is left of its old output counts as none.
        if inputs != self._inputs:
            write_text(self._path, json.dumps({"format": 1, "steps": inputs}, indent=2) + "\n")
        self._inputs = inputs


def digest(*parts: Any) -> str:
    """A digest of plain values."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()[:16]


def digest_of_files(path: Path) -> str:
    """A digest of a file, or of all files in a folder with their names; its hidden and compiled ones are left out."""
    files = [path] if path.is_file() else _files_in(path)
    return digest([(str(one.relative_to(path)), hashlib.sha256(one.read_bytes()).hexdigest()) for one in files])


def _files_in(folder: Path) -> list[Path]:
    files = sorted(one for one in folder.rglob("*") if one.is_file())
    return [one for one in files if not one.name.startswith(".") and one.parent.name != "__pycache__"]


def _read(path: Path) -> dict[str, str]:
    try:
        steps = json.loads(path.read_text(encoding="utf-8"))["steps"]
        return {str(name): str(inputs) for name, inputs in steps.items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise StoreError(f"{path}: cannot be read; remove it to do every step again") from None
