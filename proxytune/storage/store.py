"""Results of a study so far, kept in study.db: every finished episode is there at once and for good.

Rows go in and come out as values; database.py says what a row is, and what tells a damaged one.
"""

import json
import sqlite3
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

from proxytune.domain import Episode, Outcome
from proxytune.errors import InputError, StoreError
from proxytune.settings import is_finite
from proxytune.space import Theta
from proxytune.storage import database
from proxytune.storage.folder import refuse_links

FILE_NAME = "study.db"
OF_FAMILY = (
    "SELECT theta, agent, start, seed FROM episodes JOIN instances ON instances.id = episodes.instance"
    " WHERE identity = ?"
)
State = Literal["open", "finished", "failed", "cut"]
Made = TypeVar("Made")


@dataclass(frozen=True)
class TrialRecord:
    """One trial of a study."""

    number: int  # counted from 1
    theta: Theta  # where it was
    state: State = "open"  # whether it has been scored, has failed, was cut off, or is still open
    # what the search makes small: the objective, with its sign turned if it is to be large; of a trial that was cut
    # off, what that is expected to be; None if it failed or is open
    score: float | None = None
    measures: Mapping[str, float | None] = field(default_factory=dict)  # by name, the objective's too; None: undefined
    failed_episodes: int = 0  # how many of its episodes failed
    failure: str = ""  # why it failed, empty if it did not
    decided: tuple[str, ...] = ()  # the agents that had been driven when it was cut off; empty if it was not
    bound: float | None = None  # what its PRPV cannot be below, None unless it was cut off
    seconds: float = 0.0  # how long it took, where its episodes do not tell

    @property
    def prpv(self) -> float | None:
        """Its PRPV; None unless finished."""
        return self.measures.get("prpv")

    @property
    def ppv(self) -> float | None:
        """Its PPV; None unless finished, and where the target's agents all score alike."""
        return self.measures.get("ppv")

    @property
    def estimate(self) -> float | None:
        """Its expected PRPV; None unless it was cut off."""
        return self.score if self.state == "cut" else None


@dataclass(frozen=True)
class SweepRecord:
    """A sweep that has been asked for."""

    parameter: str  # what is swept
    base: Theta  # values of the others; those not named are nominal
    points: tuple[float, ...]  # where it is looked at, in rising order
    target_model: str = ""  # the target's model.toml as it was when POD was asked for; empty where it was not
    replays: str = ""  # identity of the domain family whose episodes are POD's replays; empty without POD


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
        connection = database.connect(path, writable=True)
        try:
            yield cls(path, connection)
        finally:
            database.disconnect(connection)

    @classmethod
    @contextmanager
    def read(cls, folder: Path) -> Iterator["Store"]:
        """Open the study's database for reading, also while the study runs; an InputError if it has not been run."""
        path = folder / FILE_NAME
        if not path.exists():
            raise InputError(f"{path}: no such file; run the study first: python -m proxytune study {folder}")
        connection = database.connect(path, writable=False)
        try:
            yield cls(path, connection)
        finally:
            connection.close()

    def facts(self) -> dict[str, Any]:
        """Facts that determined the finished trials; empty before the first."""
        return dict(self._made(lambda key, value: (key, json.loads(value)), "SELECT key, value FROM facts"))

    def begin(self, facts: Mapping[str, Any], objective: str = "prpv") -> None:
        """Start a search afresh with these facts beside those of others; episodes are kept, its trials are not."""
        with self._transaction() as connection:
            connection.execute("DELETE FROM trials WHERE objective = ?", (objective,))
            connection.execute("DELETE FROM facts")
            database.seal(connection, "trials", "facts")
            for key, value in facts.items():
                database.write_row(connection, "facts", {"key": key, "value": json.dumps(value, allow_nan=False)})
        self._trials.pop(objective, None)

    def save_fact(self, key: str, value: Any) -> None:
        """Write one more fact, over what it was before; trials are kept."""
        with self._transaction() as connection:
            database.write_row(connection, "facts", {"key": key, "value": json.dumps(value, allow_nan=False)})

    def trials(self, objective: str = "prpv") -> list[TrialRecord]:
        """Every trial of a search, in order; the last ones may be open."""
        if objective not in self._trials:
            trials = self._made(
                _trial,
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
                row = {
                    "objective": objective,
                    "instance": self._instance(connection, identity, theta_json(trial.theta)),
                    "measures": json.dumps(dict(trial.measures), allow_nan=False),
                    "decided": json.dumps(trial.decided),
                }
                database.write_row(connection, "trials", vars(trial) | row)
        if objective in self._trials:
            self._trials[objective] |= {trial.number: trial for trial in trials}

    def save_outcome(self, identity: str, *outcomes: Outcome, code: str | None = None) -> None:
        """Write an episode, or several at once, over an earlier failure of the same; of a failure, its code too."""
        thetas = [theta_json(outcome.episode.theta) for outcome in outcomes]
        with self._transaction() as connection:
            for outcome, theta in zip(outcomes, thetas, strict=True):
                episode, works = outcome.episode, outcome.metrics is not None
                row = {
                    "instance": self._instance(connection, identity, theta),
                    "metrics": json.dumps(dict(outcome.metrics or {}), allow_nan=False) if works else None,
                    "failure": None if works else outcome.failure,
                    "seconds": outcome.seconds,
                    "code": None if works else code,
                }
                if database.write_row(connection, "episodes", vars(episode) | row):
                    self._seconds = None  # They are of what is there now
        for outcome, theta in zip(outcomes, thetas, strict=True):
            episode = outcome.episode
            if (identity, theta) in self._outcomes:
                self._outcomes[identity, theta][episode] = outcome
            if self._seconds is not None:
                total, count = self._seconds.get((episode.agent, episode.start), (0.0, 0))
                self._seconds[episode.agent, episode.start] = (total + outcome.seconds, count + 1)

    def outcomes(self, identity: str, theta: Theta) -> Mapping[Episode, Outcome]:
        """Every episode known of a domain instance: read once, and kept up with what is written."""
        key = identity, theta_json(theta)
        if key not in self._outcomes:
            outcomes = self._made(
                _outcome,
                "SELECT theta, agent, start, seed, metrics, failure, seconds"
                " FROM episodes JOIN instances ON instances.id = episodes.instance WHERE identity = ? AND theta = ?",
                key,
            )
            self._outcomes[key] = {outcome.episode: outcome for outcome in outcomes}
        return self._outcomes[key]

    def under_way(self, identity: str) -> list[Episode]:
        """The episodes of a domain family during which an earlier process ended; they need not be why."""
        query = "SELECT theta, agent, start, seed FROM under_way WHERE identity = ? ORDER BY place"
        return self._made(_episode, query, (identity,))

    def begin_episode(self, identity: str, *episodes: Episode) -> None:
        """Keep which episodes, if any, run in this very process now, not those before: they may end the process."""
        with self._transaction() as connection:
            connection.execute("DELETE FROM under_way")
            database.seal(connection, "under_way")
            for place, episode in enumerate(episodes, start=1):
                which = {"theta": json.dumps(dict(episode.theta)), "agent": episode.agent}
                row = {"place": place, "identity": identity, "start": episode.start, "seed": episode.seed}
                database.write_row(connection, "under_way", row | which)

    def agents_that_failed(self, *how: str) -> set[str]:
        """The agents with a failed episode, in any family, whose failure begins so."""
        which = " OR ".join(["substr(failure, 1, ?) = ?"] * len(how))
        values = tuple(value for one in how for value in (len(one), one))
        return {agent for (agent,) in self._all(f"SELECT DISTINCT agent FROM episodes WHERE {which}", values)}

    def failed_by(self, identity: str, how: str) -> set[Episode]:
        """The episodes of a domain family whose failure begins so."""
        return set(self._made(_episode, f"{OF_FAMILY} AND substr(failure, 1, ?) = ?", (identity, len(how), how)))

    def failed_in_other_code(self, identity: str, code: str) -> set[Episode]:
        """The episodes that failed in other code than this; those of which the code is not known are left out."""
        return set(self._made(_episode, f"{OF_FAMILY} AND failure IS NOT NULL AND code <> ?", (identity, code)))

    def forget_failures(self) -> None:
        """Make every failure one of other code, so that it is tried again."""
        with self._transaction() as connection:
            connection.execute("UPDATE episodes SET code = '' WHERE failure IS NOT NULL")
            database.seal(connection, "episodes")

    def seconds(self) -> dict[tuple[str, int], float]:
        """Mean time that the episodes of each agent and start took."""
        if self._seconds is None:
            rows = self._all("SELECT agent, start, total(seconds), count(*) FROM episodes GROUP BY agent, start")
            self._seconds = {(agent, start): (total, count) for agent, start, total, count in rows}
        return {key: total / count for key, (total, count) in self._seconds.items()}

    def seconds_of_trials(self, objective: str, last: int, seeds: Collection[int]) -> float:
        """Time that the episodes with these seeds took of all trials of a search up to this one."""
        query = (
            "SELECT total(episodes.seconds) FROM trials JOIN episodes ON episodes.instance = trials.instance"
            f" WHERE objective = ? AND number <= ? AND seed IN ({', '.join('?' * len(seeds))})"
        )
        return float(self._all(query, (objective, last, *seeds))[0][0])

    def save_sweep(self, identity: str, sweep: SweepRecord) -> None:
        """Remember that a sweep has been asked for in the domain family with this identity; it is the last one now."""
        with self._transaction() as connection:
            row = {"number": _next(connection, "number", "sweeps"), "identity": identity}
            texts = {"base": theta_json(sweep.base), "points": json.dumps(sweep.points)}
            database.write_row(connection, "sweeps", vars(sweep) | row | texts)

    def sweeps(self) -> list[tuple[str, SweepRecord]]:
        """Every sweep that has been asked for, the last one last, with the identity of its domain family."""

        def sweep(identity: str, parameter: str, base: str, points: str, *pod: str) -> tuple[str, SweepRecord]:
            return identity, SweepRecord(parameter, _numbers(base), tuple(_list(points, int, float)), *pod)

        query = "SELECT identity, parameter, base, points, target_model, replays FROM sweeps ORDER BY number"
        return self._made(sweep, query)

    def _instance(self, connection: sqlite3.Connection, identity: str, theta: str) -> int:
        query = "SELECT id FROM instances WHERE identity = ? AND theta = ?"
        if (known := connection.execute(query, (identity, theta)).fetchone()) is None:
            known = (_next(connection, "id", "instances"),)
            database.write_row(connection, "instances", {"id": known[0], "identity": identity, "theta": theta})
        return int(known[0])

    def _made(self, make: Callable[..., Made], query: str, values: tuple[Any, ...] = ()) -> list[Made]:
        """Make values of rows; a row that is whole and none of ours is damage too."""
        rows = self._all(query, values)
        try:
            return [make(*row) for row in rows]
        except (ValueError, TypeError, AttributeError, RecursionError) as problem:
            why = " ".join(str(problem).split())[:120]
            line = f"has a row that no proxytune wrote ({why}); restore a copy, or move it away"
            raise StoreError(f"{self.path}: {line}") from None

    def _all(self, query: str, values: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        with database.sqlite_errors_as_store_errors(self.path):
            return self._connection.execute(query, values).fetchall()

    def _transaction(self) -> AbstractContextManager[sqlite3.Connection]:
        return database.transaction(self._connection, self.path)


def _next(connection: sqlite3.Connection, column: str, table: str) -> int:
    return int(connection.execute(f"SELECT coalesce(max({column}), 0) + 1 FROM {table}").fetchone()[0])


def is_begun(folder: Path) -> bool:
    """Tell whether a study has a database; not where a kill came before its first table."""
    path = folder / FILE_NAME
    refuse_links(folder)
    database.undo_broken_write(path)
    return path.is_file() and path.stat().st_size > 0


def theta_json(theta: Theta | Iterable[tuple[str, float]]) -> str:
    """θ in the one form in which it is stored: sorted by name, every digit kept."""
    return json.dumps({name: float(value) for name, value in sorted(dict(theta).items())}, allow_nan=False)


# What makes values of rows raises ValueError where a row is none that proxytune writes.


def _trial(number: int, theta: str, *rest: Any) -> TrialRecord:
    state, score, measures, failed, failure, decided, bound, seconds = rest
    for value in (score, bound):
        _expect(value is None or _is_number(value), "a score that is no number", value)
    _expect(type(failed) is int and _is_number(seconds), "a count or time that is no number", (failed, seconds))
    counted = (_numbers(measures, or_none=True), failed, failure, tuple(_list(decided, str)), bound, seconds)
    return TrialRecord(number, _numbers(theta), state, score, *counted)


def _episode(theta: str, agent: str, start: int, seed: int) -> Episode:
    _expect(type(start) is int and type(seed) is int, "a number that is none", (start, seed))
    return Episode(tuple(_numbers(theta).items()), agent, start, seed)


def _outcome(theta: str, agent: str, start: int, seed: int, *rest: Any) -> Outcome:
    metrics, failure, seconds = rest
    _expect(_is_number(seconds), "a time that is no number", seconds)
    scored = _numbers(metrics) if metrics else None
    return Outcome(_episode(theta, agent, start, seed), scored, failure or "", seconds)


def _numbers(text: str, or_none: bool = False) -> dict[str, Any]:
    """Numbers by name."""
    known = json.loads(text)
    _expect(isinstance(known, dict), "no numbers by name", text)
    for value in known.values():
        _expect(_is_number(value) or (or_none and value is None), "a value that is no number", value)
    return known  # type: ignore[no-any-return]


def _list(text: str, *kinds: type) -> list[Any]:
    known = json.loads(text)
    _expect(isinstance(known, list) and all(type(one) in kinds for one in known), "another list", text)
    return known  # type: ignore[no-any-return]


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and is_finite(cast(float, value))


def _expect(holds: bool, what: str, found: object) -> None:
    if not holds:
        raise ValueError(f"{what}: {found!r:.60}")
