"""Arrays kept on disk by what determines them: made once, found again after any interruption."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.drafts import draft_of
from proxytune.errors import StoreError

Arrays = Mapping[str, NDArray[Any]]
FACTS = "facts"
"""The array in each file that says, as JSON, what determines the others."""


@dataclass(frozen=True)
class Cache:
    """A folder of `KIND-DIGEST.npz`, each with its arrays and, as JSON, what determines them.

    Attributes:
        folder: Where it is; made when first written to.
    """

    folder: Path

    def get(self, kind: str, facts: Mapping[str, Any], make: Callable[[], Arrays]) -> Arrays:
        """The arrays that these facts determine, made and kept where they are not there yet.

        A file is whole or not there at all, so several processes may use one cache, and a killed one leaves no harm.

        Args:
            kind: What they are, the beginning of the file's name.
            facts: All that determines them, as JSON has it.
            make: Makes them.

        Raises:
            StoreError: If the folder cannot be written, or a file in it is damaged.
        """
        path = self.path(kind, facts)
        if not path.exists():
            _write(path, {**make(), FACTS: np.array(_text(facts))})
        return _read(path)

    def path(self, kind: str, facts: Mapping[str, Any]) -> Path:
        """Where the arrays of these facts are, or would be."""
        return self.folder / f"{kind}-{digest(facts)}.npz"

    def has(self, kind: str, facts: Mapping[str, Any]) -> bool:
        """Whether they are there."""
        return self.path(kind, facts).exists()


def digest(facts: Mapping[str, Any]) -> str:
    """A short name for facts, the same whatever their order."""
    return hashlib.sha256(_text(facts).encode()).hexdigest()[:20]


def _text(facts: Mapping[str, Any]) -> str:
    return json.dumps(facts, sort_keys=True, allow_nan=False)


def _write(path: Path, arrays: Arrays) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(path) as draft, draft.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
    except OSError as problem:
        raise StoreError(f"{path}: cannot be written ({problem.strerror}); make room and run again") from None


def _read(path: Path) -> Arrays:
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            return {name: file[name] for name in file.files if name != FACTS}
    # A damaged file fails in many ways: zipfile's, zlib's and numpy's own.
    except Exception as problem:
        raise StoreError(f"{path}: is damaged ({problem}); delete it, and run again to make it anew") from None
