"""What a study needs of a domain family, and nothing about how it simulates."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from proxytune.space import Parameter, Theta


@dataclass(frozen=True)
class Episode:
    """What determines one episode in a domain family.

    Attributes:
        theta: The domain instance's parameters, sorted by name; those not named are nominal.
        agent: Name of the agent that drives.
        start: Index of the starting condition.
        seed: Seed of everything random in the episode.
    """

    theta: tuple[tuple[str, float], ...]
    agent: str
    start: int
    seed: int


def make_episode(theta: Theta, *, agent: str, start: int, seed: int) -> Episode:
    """An episode with θ in its canonical order."""
    pairs = sorted((name, float(value)) for name, value in theta.items())
    return Episode(tuple(pairs), agent, start, seed)


class DomainFamily(Protocol):
    """A simulator with parameters: picklable, without global state, same episode, same result.

    Attributes:
        identity: A digest of all but the episode that determines a result: robot, plant, effects, code.
        metrics: Every metric that an episode yields, with its unit.
        parameters: Every parameter that θ may name, by the name it has in θ.
        starts: How many starting conditions there are.
    """

    @property
    def identity(self) -> str: ...  # noqa: D102 - described above
    @property
    def metrics(self) -> Mapping[str, str]: ...  # noqa: D102
    @property
    def parameters(self) -> Mapping[str, Parameter]: ...  # noqa: D102
    @property
    def starts(self) -> int: ...  # noqa: D102

    def check_agent(self, name: str) -> None:
        """Refuse an agent that this family cannot run.

        Raises:
            InputError: If there is no such agent.
        """
        ...

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Simulate one episode and score it: metric name to value.

        Raises:
            EpisodeError: If the agent raises or answers with something that is not a command; who runs the episode
                adds the agent's name.
        """
        ...
