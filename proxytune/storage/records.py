"""The rows of study.db as values."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, cast

from proxytune.domain import Episode, Outcome
from proxytune.settings import is_finite
from proxytune.space import Theta

State = Literal["open", "finished", "failed", "cut"]


@dataclass(frozen=True)
class TrialRecord:
    """One trial of a study.

    Attributes:
        number: Counted from 1.
        theta: Where it was.
        state: Whether it has been scored, has failed, was cut off, or is still open.
        score: What the search makes small: the objective, with its sign turned if it is to be large; of a trial that
            was cut off, what that is expected to be. None if it failed or is open.
        measures: Every measure of it by name, the objective's among them; None where one is undefined. Empty unless
            finished.
        failed_episodes: How many of its episodes failed.
        failure: Why it failed, empty if it did not.
        decided: The agents that had been driven when it was cut off; empty if it was not.
        bound: What its PRPV cannot be below, None unless it was cut off.
        seconds: How long it took, where its episodes do not tell.
    """

    number: int
    theta: Theta
    state: State = "open"
    score: float | None = None
    measures: Mapping[str, float | None] = field(default_factory=dict)
    failed_episodes: int = 0
    failure: str = ""
    decided: tuple[str, ...] = ()
    bound: float | None = None
    seconds: float = 0.0

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
        """What its PRPV is expected to be; None unless it was cut off."""
        return self.score if self.state == "cut" else None


@dataclass(frozen=True)
class SweepRecord:
    """A sweep that has been asked for.

    Attributes:
        parameter: What is swept.
        base: Values of the others; those not named are nominal.
        points: Where it is looked at, in rising order.
        target_model: The target's model.toml as it was when POD was asked for; empty where it was not.
        replays: Identity of the domain family whose episodes are POD's replays; empty without POD.
    """

    parameter: str
    base: Theta
    points: tuple[float, ...]
    target_model: str = ""
    replays: str = ""


def theta_json(theta: Theta | Iterable[tuple[str, float]]) -> str:
    """θ in the one form in which it is stored: sorted by name, every digit kept."""
    return json.dumps({name: float(value) for name, value in sorted(dict(theta).items())}, allow_nan=False)


def fact_of(key: str, value: str) -> tuple[str, Any]:
    """A fact from its row.

    Raises:
        ValueError: If it is none that proxytune writes; so do the others below.
    """
    return key, json.loads(value)


def trial_of(number: int, theta: str, *rest: Any) -> TrialRecord:
    """A trial from its row, in the order of its attributes."""
    state, score, measures, failed, failure, decided, bound, seconds = rest
    for value in (score, bound):
        _expect(value is None or _is_number(value), "a score that is no number", value)
    _expect(type(failed) is int and _is_number(seconds), "a count or time that is no number", (failed, seconds))
    counted = (_numbers(measures, or_none=True), failed, failure, tuple(_list(decided, str)), bound, seconds)
    return TrialRecord(number, _numbers(theta), state, score, *counted)


def episode_of(theta: str, agent: str, start: int, seed: int) -> Episode:
    """An episode from the columns that determine it."""
    return Episode(tuple(_numbers(theta).items()), agent, start, seed)


def under_way_of(theta: str, agent: str, start: int, seed: int) -> Episode:
    """The episode under way, which no checksum covers, from its row."""
    for text in (theta, agent):
        _expect(type(text) is str, "a text that is none", text)
        text.encode()
    _expect(type(start) is int and type(seed) is int, "a number that is none", (start, seed))
    return episode_of(theta, agent, start, seed)


def outcome_of(theta: str, agent: str, start: int, seed: int, *rest: Any) -> Outcome:
    """An episode's outcome from its row."""
    metrics, failure, seconds = rest
    _expect(_is_number(seconds), "a time that is no number", seconds)
    scored = _numbers(metrics) if metrics else None
    return Outcome(episode_of(theta, agent, start, seed), scored, failure or "", seconds)


def sweep_of(identity: str, parameter: str, base: str, points: str, *pod: str) -> tuple[str, SweepRecord]:
    """A sweep and the identity of its domain family from its row."""
    target_model, replays = pod
    return identity, SweepRecord(parameter, _numbers(base), tuple(_list(points, int, float)), target_model, replays)


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
