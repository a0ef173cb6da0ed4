"""A study.db edited as a test needs it, with digests that fit, as if a study had been run so."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from proxytune.storage.database import open_file, seal


@contextmanager
def edited(path: Path) -> Iterator[sqlite3.Connection]:
    """A connection to edit with."""
    with closing(open_file(path, writable=True)) as plain:
        yield plain
        seal(plain)
