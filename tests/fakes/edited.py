"""A study.db edited as a test needs it, with checksums that fit, as if a study had been run so."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from proxytune.storage.checksums import prepare, seal_all


@contextmanager
def edited(path: Path) -> Iterator[sqlite3.Connection]:
    """A connection to edit with."""
    plain = sqlite3.connect(path)
    try:
        with plain:
            prepare(plain)
            yield plain
            seal_all(plain)
    finally:
        plain.close()
