"""Trainings, lessons and examinations run code that is not ours: what it raises is named, and what hangs is ended."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from proxytune.domain import Demonstration, Episode, Policy
from proxytune.errors import EpisodeError, ProxytuneError
from proxytune.extensions import describe, is_users, place_of
from proxytune.running.limits import limited, was_ended_in
from proxytune.running.machine import check_machine

TOGETHER = " and the others beside it"
"""How it is named what several episodes do at once: which of them fails is not known then."""


@contextmanager
def watching(what: str, timeout_s: float | None = None) -> Iterator[None]:
    """Raise in one line what code that is not ours raises meanwhile, and end what takes longer than it may.

    Args:
        what: What is under way.
        timeout_s: How long it may take [s], where processes may be ended (`limited`).

    Raises:
        EpisodeError: With what was under way.
        RunError: If memory, disk or descriptors run out.
    """
    try:
        with limited(what, timeout_s):
            yield
    except BaseException as problem:
        if is_users(problem):
            raise
        check_machine(what, problem, "with more room")
        if isinstance(problem, ProxytuneError):
            raise
        raise EpisodeError(f"{what} raised {describe(problem)}{place_of(problem)}; correct it") from problem


@dataclass(frozen=True)
class Supervised:
    """A classroom of which each lesson and examination is named where it fails, and ended where it takes too long.

    Attributes:
        room: The classroom.
        domain: What it is, "proxy" or "target".
        timeout_s: How long an episode may take [s]; None for as long as it takes.
    """

    room: Any
    domain: str
    timeout_s: float | None

    def __getattr__(self, member: str) -> Any:
        """Any other member of the classroom."""
        if member.startswith("__") or member == "room":
            raise AttributeError(member)
        return getattr(self.room, member)

    def demonstrate(self, episode: Episode, seconds: float) -> tuple[Demonstration, int]:
        """As the classroom does."""
        with watching(self._named("the expert's lesson", episode), self.timeout_s):
            return self.room.demonstrate(episode, seconds)  # type: ignore[no-any-return]

    def guide(self, episode: Episode, policy: Policy, seconds: float) -> tuple[Demonstration, int]:
        """As the classroom does."""
        with watching(self._named("the learner's lesson", episode), self.timeout_s):
            return self.room.guide(episode, policy, seconds)  # type: ignore[no-any-return]

    def examine(self, episode: Episode, policy: Policy) -> float:
        """As the classroom does."""
        with watching(self._named("the learner's examination", episode), self.timeout_s):
            return self.room.examine(episode, policy)  # type: ignore[no-any-return]

    def examine_together(self, episodes: Sequence[Episode], policy: Policy) -> Sequence[float]:
        """As the classroom does, in so many times as long; where that ended a process, one after the other."""
        together = getattr(self.room, "examine_together", None)
        what = self._named("the learner's examination", episodes[0]) + TOGETHER
        if together is None or was_ended_in(what):
            return [self.examine(episode, policy) for episode in episodes]
        with watching(what, self.timeout_s and self.timeout_s * len(episodes)):
            return together(episodes, policy)  # type: ignore[no-any-return]

    def _named(self, what: str, episode: Episode) -> str:
        theta = "".join(f"{name} = {value:.3g}, " for name, value in episode.theta)
        return f"{what} in the {self.domain} at {theta}start {episode.start}"
