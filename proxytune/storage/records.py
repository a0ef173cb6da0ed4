"""The rows of study.db as values."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from proxytune.domain import Episode, Outcome
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


def trial_of(number: int, theta: str, *rest: Any) -> TrialRecord:
    """A trial from its row, in the order of its attributes."""
    state, score, measures, failed, failure, decided, bound, seconds = rest
    counted = (json.loads(measures), failed, failure, tuple(json.loads(decided)), bound, seconds)
    return TrialRecord(number, json.loads(theta), state, score, *counted)


def episode_of(theta: str, agent: str, start: int, seed: int) -> Episode:
    """An episode from the columns that determine it."""
    return Episode(tuple(json.loads(theta).items()), agent, start, seed)


def outcome_of(theta: str, agent: str, start: int, seed: int, *rest: Any) -> Outcome:
    """An episode's outcome from its row."""
    metrics, failure, seconds = rest
    return Outcome(
        episode_of(theta, agent, start, seed), json.loads(metrics) if metrics else None, failure or "", seconds
    )
