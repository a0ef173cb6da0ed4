"""What a study needs of a domain family, and nothing about how it simulates."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import EpisodeError
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


Instance = tuple[tuple[str, float], ...]
"""A domain instance: θ as an episode names it."""


def instance_of(theta: Theta) -> Instance:
    """θ in its canonical order."""
    return tuple(sorted((name, float(value)) for name, value in theta.items()))


def make_episode(theta: Theta, *, agent: str, start: int, seed: int) -> Episode:
    """An episode with θ in its canonical order."""
    return Episode(instance_of(theta), agent, start, seed)


@dataclass(frozen=True)
class Outcome:
    """What became of one episode."""

    episode: Episode  # which one
    metrics: Mapping[str, float] | None  # its scores, None if it failed
    failure: str  # why it failed, empty if it did not
    seconds: float  # how long it took


class DomainFamily(Protocol):
    """A simulator with parameters: picklable, without global state, same episode, same result.

    A study's key `family` names a factory, `module:factory`, that makes one:

        def factory(domain: Section, *, model: Path | None) -> DomainFamily

    Args of the factory:
        domain: The study's [domain] table. It reads like a mapping, `domain["gain"]` or `dict(domain)`; its methods
            check as they read: `domain.only(("gain",))`, `domain.number("gain", 1.0, low=0.0)`. The study's folder is
            `domain.path.parent`.
        model: A model.toml that the instance is to follow: what `measure --model` and a study's `proxy` name. A family
            that cannot follow one raises an InputError where it is not None.

    Attributes:
        identity: A digest of all but the episode that determines a result: robot, plant, effects, code.
        metrics: Every metric that an episode yields, with its unit.
        parameters: Every parameter that θ may name, by the name it has in θ.
        starts: How many starting conditions there are.

    It may have `nominal` too, from names in θ to values: the simulator as it is, which a study drives beside its
    answer; empty, none is driven. Without it these are the neutral values of its parameters, unless the study's
    `proxy` holds others. And it may have `truth(model)`: θ of a model.toml, as a study's key `truth` and `drive
    --theta` name one. Without it such a file holds effects of proxytune alone.
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


class FleetFamily(DomainFamily, Protocol):
    """A domain family that can run several episodes at once, faster than one after the other."""

    def run_many(self, episodes: Sequence[Episode], /) -> Sequence[Mapping[str, float] | EpisodeError]:
        """Simulate episodes of any agents, starts and θ side by side; each to the bit as `run` does.

        Returns:
            What each came to: its scores, or the EpisodeError that `run` raises. Whatever this raises or ends instead,
            its process included, has the episodes run one by one.
        """
        ...


class Recording(NamedTuple):
    """One episode to look at.

    Attributes:
        metrics: Its scores, as `run` gives them.
        poses: Columns by name: `time` [s], and where the robot was then, as in x, y [m] and heading [rad].
        commands: Columns by name: `time` [s] at which a command was issued, and its channels, as in left and right.
    """

    metrics: Mapping[str, float]
    poses: Mapping[str, NDArray[np.float64]]
    commands: Mapping[str, NDArray[np.float64]]


class Recorder(DomainFamily, Protocol):
    """A domain family whose episodes can be looked at: `proxytune.drive` shows more of it than scores.

    It may say what commands are given in, `command_unit`, and where robots drive on one of proxytune's roads name that,
    `road_to_draw`: a figure then draws their ways on it.
    """

    def record(self, episode: Episode) -> Recording:
        """Simulate one episode as `run` does, and keep poses and commands.

        Raises:
            EpisodeError: As in `run`.
        """
        ...


class Demonstration(NamedTuple):
    """What an expert has shown: samples to imitate."""

    observations: NDArray[Any]  # what an agent would have seen before each command, (samples, …)
    commands: NDArray[np.float64]  # what the expert would do, (samples, channels)


Policy = Callable[[NDArray[Any]], NDArray[np.float64]]
"""What has been learnt: from one observation to one command, whatever was asked before.

It may have `act_many(observations)` too: commands (n, channels) for observations (n, …), each as for that one, to the
bit.
"""


class Classroom(DomainFamily, Protocol):
    """A domain family that can also teach: it has an expert to imitate, and a score for who has learnt.

    It may have `examine_together(episodes, policy)` too: what `examine` gives for each episode, faster than one by one.

    Attributes:
        best_score: What a flawless episode scores.
    """

    @property
    def best_score(self) -> float: ...  # noqa: D102 - described above

    def demonstrate(self, episode: Episode, seconds: float) -> tuple[Demonstration, int]:
        """Let the expert drive in place of the episode's agent for some time [s].

        Returns:
            The samples worth imitating, in the order of time; and how many there would be had it kept to the road.

        Raises:
            EpisodeError: If the domain fails.
        """
        ...

    def examine(self, episode: Episode, policy: Policy) -> float:
        """The score of a policy that drives in place of the episode's agent.

        Raises:
            EpisodeError: If the policy raises or answers with something that is not a command.
        """
        ...


class OnPolicyClassroom(Classroom, Protocol):
    """A domain family whose expert also tells what it would do where a learner has driven to."""

    def guide(self, episode: Episode, policy: Policy, seconds: float) -> tuple[Demonstration, int]:
        """Let a policy drive in place of the episode's agent for some time [s], and the expert label what it visits.

        Returns:
            What was seen, and what the expert would have done, wherever it has an answer worth imitating, in the order
            of time; and how many samples there would be had it one throughout.

        Raises:
            EpisodeError: If the domain or the policy fails.
        """
        ...
