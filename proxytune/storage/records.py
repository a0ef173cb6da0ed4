"""The rows of study.db as values."""

from dataclasses import dataclass
from typing import Literal

from proxytune.space import Theta

State = Literal["open", "finished", "failed", "cut"]


@dataclass(frozen=True)
class TrialRecord:
    """One trial of a study.

    Attributes:
        number: Counted from 1.
        theta: Where it was.
        state: Whether it has been scored, has failed, was cut off, or is still open.
        prpv: Its PRPV, None unless finished.
        ppv: Its PPV, None unless finished, and where the target's agents all score alike.
        failed_episodes: How many of its episodes failed.
        failure: Why it failed, empty if it did not.
        decided: The agents that had been driven when it was cut off; empty if it was not.
        bound: What its PRPV cannot be below, None unless it was cut off.
        estimate: What its PRPV is expected to be, None unless it was cut off.
    """

    number: int
    theta: Theta
    state: State = "open"
    prpv: float | None = None
    ppv: float | None = None
    failed_episodes: int = 0
    failure: str = ""
    decided: tuple[str, ...] = ()
    bound: float | None = None
    estimate: float | None = None

    @property
    def score(self) -> float | None:
        """What the search is told: PRPV, of a trial that was cut off the estimate; None if it failed or is open."""
        return self.estimate if self.state == "cut" else self.prpv


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
