"""POD as a domain family of its own: the same commands in proxy and target, and how unlike the two answer."""

import functools
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from proxytune.domain import DomainFamily, Episode
from proxytune.errors import InputError
from proxytune.meaning import meaning_of
from proxytune.space import Parameter
from proxytune.study.family import load_family
from proxytune.study.study import Study
from proxytune.usefulness import pod_of_images, pod_of_poses

COMMANDS = 100
"""At most so many commands are replayed, 5 s at 20 Hz: later, two domains are far apart whatever their difference."""

METRICS = {"pod_pose": "m", "pod_image": "of full scale"}


class Observed(Protocol):
    """What commands lead to: poses (ticks + 1, 3), the start first; pictures (steps, rows, columns, channels)."""

    @property
    def poses(self) -> Any: ...  # noqa: D102 - described above
    @property
    def pictures(self) -> Any: ...  # noqa: D102


class Replayable(DomainFamily, Protocol):
    """A domain family that can also repeat commands, and be a key of a cache."""

    def __hash__(self) -> int: ...

    def drive(self, episode: Episode) -> Any:
        """Drive an episode; the answer's `commands` (control steps, …) are what the agent issued."""
        ...

    def replay(self, episode: Episode, commands: Any) -> Observed:
        """Drive commands in place of the episode's agent, from the episode's start and with its seed."""
        ...


@dataclass(frozen=True)
class Discrepancy:
    """A domain family whose episodes are replays in two others, and whose metrics are their discrepancies.

    Attributes:
        proxy: Where θ holds.
        target: Fixed; the agent of the episode drives here, and what it issued is replayed in both.
    """

    proxy: Replayable
    target: Replayable

    @property
    def identity(self) -> str:
        """A digest of both families and of how they are compared."""
        parts = [self.proxy.identity, self.target.identity, meaning_of([Path(__file__)], Path(__file__).parent)]
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]

    @property
    def metrics(self) -> Mapping[str, str]:
        """POD of poses and of images, with their units."""
        return METRICS

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Those of the proxy."""
        return self.proxy.parameters

    @property
    def starts(self) -> int:
        """Those of the proxy."""
        return self.proxy.starts

    def check_agent(self, name: str) -> None:
        """Refuse an agent that the target cannot run.

        Raises:
            InputError: If there is no such agent.
        """
        self.target.check_agent(name)

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Replay in both domains and compare, eq. (1), over the time until the first of them ends.

        Raises:
            EpisodeError: If the agent fails on the target.
        """
        commands, there = _on_target(self.target, replace(episode, theta=()))
        here = self.proxy.replay(episode, commands)
        poses, pictures = (min(map(len, both)) for both in ((here.poses, there.poses), (here.pictures, there.pictures)))
        # The start is the same by construction, so it is no observation.
        pose = pod_of_poses(proxy=here.poses[1:poses], target=there.poses[1:poses])
        image = pod_of_images(proxy=here.pictures[:pictures], target=there.pictures[:pictures])
        return {"pod_pose": pose.value, "pod_image": image.value}


@functools.lru_cache(maxsize=64)
def _on_target(target: Replayable, episode: Episode) -> tuple[Any, Observed]:
    """What the agent issued and what it led to; the same at every point of a sweep."""
    commands = np.asarray(target.drive(episode).commands)[:COMMANDS]
    return commands, target.replay(episode, commands)


def discrepancy_study(study: Study, model: Path) -> Study:
    """The study whose episodes are replays of its first agent's commands on the target that a model describes.

    Raises:
        InputError: If there is no such model, or the study's domain family cannot replay commands.
    """
    if not model.is_file():
        raise InputError(f"--target-model {model}: no such file; check the path")
    proxy: Any = study.family
    if not (hasattr(proxy, "drive") and hasattr(proxy, "replay")):
        raise InputError(
            f"--target-model: family {study.settings.family} has no `drive` and `replay`, without which there is"
            " no POD; leave the option out"
        )
    target: Any = load_family(study.settings, model)
    both = Discrepancy(proxy, target)
    settings = replace(study.settings, agents=study.settings.agents[:1])
    return Study(settings, both, study.target, both.identity)
