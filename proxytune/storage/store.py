"""What a study has done so far, kept in study.db: every finished episode is there at once and for good."""

import json
import sqlite3
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from proxytune.domain import Episode, Outcome
from proxytune.errors import InputError
from proxytune.space import Theta
from proxytune.storage.database import connect, disconnect, sqlite_errors_as_store_errors
from proxytune.storage.records import SweepRecord, TrialRecord

FILE_NAME = "study.db"


def theta_json(theta: Theta | Iterable[tuple[str, float]]) -> str:
    """θ in the one form in which it is stored: sorted by name, every digit kept."""
    return json.dumps({name: float(value) for name, value in sorted(dict(theta).items())}, allow_nan=False)


def _trial(number: int, theta: str, *rest: Any) -> TrialRecord:
    """A trial from its row, in the order of its attributes."""
    decided = tuple(json.loads(rest[5]))
    return replace(TrialRecord(number, json.loads(theta), *rest[:5]), decided=decided, bound=rest[6], estimate=rest[7])


class Store:
    """A study's database. Every method raises StoreError in one line; what had been committed stays."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection

    @classmethod
    @contextmanager
    def open(cls, folder: Path) -> Iterator["Store"]:
        """Open the study's database for writing, making it where there is none; to be held under the study's lock."""
        path = folder / FILE_NAME
        connection = connect(path, writable=True)
        try:
            yield cls(path, connection)
        finally:
            disconnect(connection)

    @classmethod
    @contextmanager
    def read(cls, folder: Path) -> Iterator["Store"]:
        """Open the study's database for reading, also while the study runs.

        Raises:
            InputError: If the study has not been run.
        """
        path = folder / FILE_NAME
        if not path.exists():
            raise InputError(f"{path}: no such file; run the study first: python -m proxytune study {folder}")
        connection = connect(path, writable=False)
        try:
            yield cls(path, connection)
        finally:
            connection.close()

    def facts(self) -> dict[str, Any]:
        """What determined the finished trials; empty before the first."""
        return {key: json.loads(value) for key, value in self._all("SELECT key, value FROM facts")}

    def begin(self, facts: Mapping[str, Any]) -> None:
        """Start a study afresh with these facts; episodes are kept, trials are not."""
        with self._transaction() as connection:
            connection.execute("DELETE FROM trials")
            connection.execute("DELETE FROM facts")
            rows = [(key, json.dumps(value, allow_nan=False)) for key, value in facts.items()]
            connection.executemany("INSERT INTO facts VALUES (?, ?)", rows)

    def trials(self) -> list[TrialRecord]:
        """Every trial, in order; the last ones may be open."""
        rows = self._all(
            "SELECT number, theta, state, prpv, ppv, failed_episodes, failure, decided, bound, estimate"
            " FROM trials JOIN instances ON instances.id = trials.instance ORDER BY number"
        )
        return [_trial(*row) for row in rows]

    def save_trial(self, identity: str, *trials: TrialRecord) -> None:
        """Write a trial, or several at once, over what was known of it before."""
        with self._transaction() as connection:
            for trial in trials:
                row = (trial.state, trial.prpv, trial.ppv, trial.failed_episodes, trial.failure)
                cut = (json.dumps(trial.decided), trial.bound, trial.estimate)
                instance = self._instance(connection, identity, theta_json(trial.theta))
                connection.execute(
                    "INSERT OR REPLACE INTO trials VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                    (trial.number, instance, *row, *cut),
                )

    def save_outcome(self, identity: str, outcome: Outcome) -> None:
        """Write an episode, over an earlier failure of the same."""
        episode = outcome.episode
        metrics = None if outcome.metrics is None else json.dumps(dict(outcome.metrics), allow_nan=False)
        failure = None if outcome.metrics is not None else outcome.failure
        with self._transaction() as connection:
            instance = self._instance(connection, identity, theta_json(episode.theta))
            row = (instance, episode.agent, episode.start, episode.seed, metrics, failure, outcome.seconds)
            connection.execute("INSERT OR REPLACE INTO episodes VALUES (?, ?, ?, ?, ?, ?, ?)", row)

    def outcomes(self, identity: str, theta: Theta) -> dict[Episode, Outcome]:
        """Every episode known of a domain instance."""
        rows = self._all(
            "SELECT theta, agent, start, seed, metrics, failure, seconds"
            " FROM episodes JOIN instances ON instances.id = episodes.instance WHERE identity = ? AND theta = ?",
            (identity, theta_json(theta)),
        )
        found = {}
        for text, agent, start, seed, metrics, failure, seconds in rows:
            episode = Episode(tuple(json.loads(text).items()), agent, start, seed)
            found[episode] = Outcome(episode, json.loads(metrics) if metrics else None, failure or "", seconds)
        return found

    def seconds(self) -> dict[tuple[str, int], float]:
        """How long the episodes of each agent and start took on average."""
        rows = self._all("SELECT agent, start, avg(seconds) FROM episodes GROUP BY agent, start")
        return {(agent, start): mean for agent, start, mean in rows}

    def seconds_of_trials(self, last: int, seeds: Collection[int]) -> float:
        """How long the episodes with these seeds took of all trials up to this one."""
        query = (
            "SELECT total(seconds) FROM trials JOIN episodes ON episodes.instance = trials.instance"
            f" WHERE number <= ? AND seed IN ({', '.join('?' * len(seeds))})"
        )
        return float(self._all(query, (last, *seeds))[0][0])

    def save_sweep(self, identity: str, sweep: SweepRecord) -> None:
        """Remember that a sweep has been asked for in the domain family with this identity."""
        row = (sweep.parameter, theta_json(sweep.base), json.dumps(sweep.points), identity)
        with self._transaction() as connection:
            # A sweep asked for again becomes the last one.
            connection.execute(
                "INSERT OR REPLACE INTO sweeps VALUES (NULL, ?, ?, ?, ?, ?, ?)",
                (*row, sweep.target_model, sweep.replays),
            )

    def sweeps(self) -> list[tuple[str, SweepRecord]]:
        """Every sweep that has been asked for, the last one last, with the identity of its domain family."""
        rows = self._all("SELECT identity, parameter, base, points, target_model, replays FROM sweeps ORDER BY number")
        return [
            (identity, SweepRecord(name, json.loads(base), tuple(json.loads(points)), *pod))
            for identity, name, base, points, *pod in rows
        ]

    def _instance(self, connection: sqlite3.Connection, identity: str, theta: str) -> int:
        connection.execute("INSERT OR IGNORE INTO instances (identity, theta) VALUES (?, ?)", (identity, theta))
        query = "SELECT id FROM instances WHERE identity = ? AND theta = ?"
        return int(connection.execute(query, (identity, theta)).fetchone()[0])

    def _all(self, query: str, values: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        with sqlite_errors_as_store_errors(self.path):
            return self._connection.execute(query, values).fetchall()

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with sqlite_errors_as_store_errors(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection
                self._connection.execute("COMMIT")
            except BaseException:
                # A full disk may have rolled back already.
                with suppress(sqlite3.Error):
                    self._connection.execute("ROLLBACK")
                raise
