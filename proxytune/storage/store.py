"""What a study has done so far, kept in study.db: every finished episode is there at once and for good."""

import json
import sqlite3
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, TypeVar

from proxytune.domain import Episode, Outcome
from proxytune.errors import InputError
from proxytune.space import Theta
from proxytune.storage import records
from proxytune.storage.checksums import chain, count_sweeps, seal
from proxytune.storage.complaints import not_ours, sqlite_errors_as_store_errors
from proxytune.storage.database import connect, disconnect, transaction
from proxytune.storage.records import SweepRecord, TrialRecord, theta_json
from proxytune.storage.renaming import RENAMING
from proxytune.storage.under_way import UnderWay

FILE_NAME = "study.db"
Made = TypeVar("Made")


class Store:
    """A study's database. Every method raises StoreError in one line; what had been committed stays."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection
        # What has been read or written, since one writer at a time holds the study's lock.
        self._trials: dict[str, dict[int, TrialRecord]] = {}
        self._outcomes: dict[tuple[str, str], dict[Episode, Outcome]] = {}
        self._seconds: dict[tuple[str, int], tuple[float, int]] | None = None

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
        return dict(self._made(records.fact_of, "SELECT key, value FROM facts"))

    def begin(self, facts: Mapping[str, Any], objective: str = "prpv") -> None:
        """Start a search afresh with these facts beside those of others; episodes are kept, its trials are not."""
        with self._transaction() as connection:
            connection.execute("DELETE FROM trials WHERE objective = ?", (objective,))
            chain(connection, objective)
            connection.execute("DELETE FROM facts")
            rows = [(key, json.dumps(value, allow_nan=False)) for key, value in facts.items()]
            connection.executemany("INSERT INTO facts (key, value) VALUES (?, ?)", rows)
            seal(connection, "facts")
        self._trials.pop(objective, None)

    def save_fact(self, key: str, value: Any) -> None:
        """Write one more fact, over what it was before; trials are kept."""
        with self._transaction() as connection:
            row = (key, json.dumps(value, allow_nan=False))
            connection.execute("INSERT OR REPLACE INTO facts (key, value) VALUES (?, ?)", row)
            seal(connection, "facts", "key = ?", (key,))

    def rename_identity(self, earlier: Collection[str], identity: str) -> None:
        """Make all that is kept under earlier identities of a domain family belong to this one, at once.

        Where both have the same episode or sweep, this one's is kept.
        """
        with self._transaction() as connection:
            for name in earlier:
                for statement in RENAMING:
                    connection.execute(statement, {"earlier": name, "now": identity})
                values = (json.dumps(identity), json.dumps(name))
                connection.execute("UPDATE facts SET value = ? WHERE key = 'identity' AND value = ?", values)
            for table in ("facts", "instances", "sweeps"):
                seal(connection, table)
            count_sweeps(connection)
        self._outcomes.clear()

    def trials(self, objective: str = "prpv") -> list[TrialRecord]:
        """Every trial of a search, in order; the last ones may be open."""
        if objective not in self._trials:
            trials = self._made(
                records.trial_of,
                "SELECT number, theta, state, score, measures, failed_episodes, failure, decided, bound, seconds"
                " FROM trials JOIN instances ON instances.id = trials.instance WHERE objective = ? ORDER BY number",
                (objective,),
            )
            self._trials[objective] = {trial.number: trial for trial in trials}
        return [trial for _, trial in sorted(self._trials[objective].items())]

    def searches(self) -> list[str]:
        """The objectives by which trials have ended."""
        return [row[0] for row in self._all("SELECT DISTINCT objective FROM trials WHERE state <> 'open'")]

    def save_trial(self, identity: str, *trials: TrialRecord, objective: str = "prpv") -> None:
        """Write a trial, or several at once, over what was known of it before."""
        with self._transaction() as connection:
            for trial in trials:
                instance = self._instance(connection, identity, theta_json(trial.theta))
                scored = (trial.state, trial.score, json.dumps(dict(trial.measures), allow_nan=False))
                rest = (trial.failed_episodes, trial.failure, json.dumps(trial.decided), trial.bound, trial.seconds)
                connection.execute(
                    "INSERT OR REPLACE INTO trials VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, '')",
                    (objective, trial.number, instance, *scored, *rest),
                )
            chain(connection, objective, min((trial.number for trial in trials), default=1))
        if objective in self._trials:
            self._trials[objective] |= {trial.number: trial for trial in trials}

    def drop_trials(self, objective: str, first: int) -> None:
        """Forget the trials of a search from one on; episodes are kept."""
        with self._transaction() as connection:
            connection.execute("DELETE FROM trials WHERE objective = ? AND number >= ?", (objective, first))
            chain(connection, objective, first)
        self._trials.pop(objective, None)

    def save_outcome(self, identity: str, outcome: Outcome, code: str | None = None) -> None:
        """Write an episode, over an earlier failure of the same; of a failure, the code that failed too."""
        episode = outcome.episode
        theta = theta_json(episode.theta)
        metrics = None if outcome.metrics is None else json.dumps(dict(outcome.metrics), allow_nan=False)
        failure = None if outcome.metrics is not None else outcome.failure
        with self._transaction() as connection:
            instance = self._instance(connection, identity, theta)
            row = (instance, episode.agent, episode.start, episode.seed, metrics, failure, outcome.seconds)
            failed = None if failure is None else code
            connection.execute("INSERT OR REPLACE INTO episodes VALUES (?, ?, ?, ?, ?, ?, ?, ?, 0)", (*row, failed))
            seal(connection, "episodes", "instance = ? AND agent = ? AND start = ? AND seed = ?", row[:4])
        self._remember(identity, theta, outcome)

    def outcomes(self, identity: str, theta: Theta) -> Mapping[Episode, Outcome]:
        """Every episode known of a domain instance: read once, and kept up with what is written."""
        key = identity, theta_json(theta)
        if key not in self._outcomes:
            outcomes = self._made(
                records.outcome_of,
                "SELECT theta, agent, start, seed, metrics, failure, seconds"
                " FROM episodes JOIN instances ON instances.id = episodes.instance WHERE identity = ? AND theta = ?",
                key,
            )
            self._outcomes[key] = {outcome.episode: outcome for outcome in outcomes}
        return self._outcomes[key]

    def under_way(self, identity: str) -> UnderWay:
        """Which episode runs of the domain family with this identity."""
        return UnderWay(self.path, self._connection, identity)

    def failed_in_other_code(self, identity: str, code: str) -> set[Episode]:
        """The episodes that failed in other code than this; those of which the code is not known are left out."""
        query = (
            "SELECT theta, agent, start, seed FROM episodes JOIN instances ON instances.id = episodes.instance"
            " WHERE identity = ? AND failure IS NOT NULL AND code <> ?"
        )
        return set(self._made(records.episode_of, query, (identity, code)))

    def forget_failures(self) -> None:
        """Make every failure one of other code, so that it is tried again."""
        with self._transaction() as connection:
            connection.execute("UPDATE episodes SET code = '' WHERE failure IS NOT NULL")
            seal(connection, "episodes", "failure IS NOT NULL")

    def seconds(self) -> dict[tuple[str, int], float]:
        """How long the episodes of each agent and start took on average."""
        if self._seconds is None:
            rows = self._all("SELECT agent, start, total(seconds), count(*) FROM episodes GROUP BY agent, start")
            self._seconds = {(agent, start): (total, count) for agent, start, total, count in rows}
        return {key: total / count for key, (total, count) in self._seconds.items()}

    def seconds_of_trials(self, objective: str, last: int, seeds: Collection[int]) -> float:
        """How long the episodes with these seeds took of all trials of a search up to this one."""
        query = (
            "SELECT total(episodes.seconds) FROM trials JOIN episodes ON episodes.instance = trials.instance"
            f" WHERE objective = ? AND number <= ? AND seed IN ({', '.join('?' * len(seeds))})"
        )
        return float(self._all(query, (objective, last, *seeds))[0][0])

    def save_sweep(self, identity: str, sweep: SweepRecord) -> None:
        """Remember that a sweep has been asked for in the domain family with this identity."""
        row = (sweep.parameter, theta_json(sweep.base), json.dumps(sweep.points), identity)
        with self._transaction() as connection:
            # A sweep asked for again becomes the last one.
            connection.execute(
                "INSERT OR REPLACE INTO sweeps VALUES (NULL, ?, ?, ?, ?, ?, ?, 0)",
                (*row, sweep.target_model, sweep.replays),
            )
            seal(connection, "sweeps", "number = last_insert_rowid()")
            count_sweeps(connection)

    def sweeps(self) -> list[tuple[str, SweepRecord]]:
        """Every sweep that has been asked for, the last one last, with the identity of its domain family."""
        query = "SELECT identity, parameter, base, points, target_model, replays FROM sweeps ORDER BY number"
        return self._made(records.sweep_of, query)

    def _remember(self, identity: str, theta: str, outcome: Outcome) -> None:
        driven = outcome.episode
        if (identity, theta) in self._outcomes:
            self._outcomes[identity, theta][driven] = outcome
        if self._seconds is not None:
            total, count = self._seconds.get((driven.agent, driven.start), (0.0, 0))
            self._seconds[driven.agent, driven.start] = (total + outcome.seconds, count + 1)

    def _instance(self, connection: sqlite3.Connection, identity: str, theta: str) -> int:
        made = connection.execute("INSERT OR IGNORE INTO instances (identity, theta) VALUES (?, ?)", (identity, theta))
        if made.rowcount > 0:
            seal(connection, "instances", "identity = ? AND theta = ?", (identity, theta))
        query = "SELECT id FROM instances WHERE identity = ? AND theta = ?"
        return int(connection.execute(query, (identity, theta)).fetchone()[0])

    def _made(self, make: Callable[..., Made], query: str, values: tuple[Any, ...] = ()) -> list[Made]:
        """What rows are made into; a row that is whole and none of ours is damage too."""
        rows = self._all(query, values)
        try:
            return [make(*row) for row in rows]
        except (ValueError, TypeError, AttributeError, RecursionError) as problem:
            raise not_ours(self.path, problem) from None

    def _all(self, query: str, values: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        with sqlite_errors_as_store_errors(self.path):
            return self._connection.execute(query, values).fetchall()

    def _transaction(self) -> AbstractContextManager[sqlite3.Connection]:
        return transaction(self._connection, self.path)
