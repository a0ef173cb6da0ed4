"""The episode that runs in a study's own process: where the process ends with it, study.db still names it.

It is in a table of its own (formats.py), which is made when it is first needed.
"""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from proxytune.domain import Episode
from proxytune.storage.complaints import sqlite_errors_as_store_errors
from proxytune.storage.formats import UNDER_WAY
from proxytune.storage.records import under_way_of

COLUMNS = "identity, theta, agent, start, seed"


class UnderWay:
    """Which episode of a domain family runs. Every method raises StoreError in one line."""

    def __init__(self, path: Path, connection: sqlite3.Connection, identity: str) -> None:
        self._path, self._connection, self._identity = path, connection, identity
        with sqlite_errors_as_store_errors(path):
            connection.execute(UNDER_WAY)

    def left(self) -> list[Episode]:
        """The episode during which an earlier process ended, if one did; whether it ended of it is not known."""
        with sqlite_errors_as_store_errors(self._path):
            query = f"SELECT {COLUMNS} FROM under_way WHERE identity = ?"
            rows = self._connection.execute(query, (self._identity,)).fetchall()
        return [under_way_of(*row) for _, *row in rows]

    def agents_that_failed(self, *how: str) -> set[str]:
        """The agents with a failed episode, in any family, whose failure begins so."""
        which = " OR ".join(["substr(failure, 1, ?) = ?"] * len(how))
        values = [value for one in how for value in (len(one), one)]
        with sqlite_errors_as_store_errors(self._path):
            rows = self._connection.execute(f"SELECT DISTINCT agent FROM episodes WHERE {which}", values).fetchall()
        return {agent for (agent,) in rows}

    def begin(self, episode: Episode) -> None:
        """An episode begins, and the one before has ended."""
        which = (self._identity, json.dumps(dict(episode.theta)), episode.agent, episode.start, episode.seed)
        with sqlite_errors_as_store_errors(self._path):
            self._connection.execute(
                f"INSERT OR REPLACE INTO under_way (place, {COLUMNS}) VALUES (1, ?, ?, ?, ?, ?)", which
            )

    @contextmanager
    def ended(self) -> Iterator[None]:
        """A context after which none is under way, however it is left."""
        try:
            yield
        finally:
            with sqlite_errors_as_store_errors(self._path):
                self._connection.execute("DELETE FROM under_way")
