"""A domain family that is a formula and can replay commands: it drives as commanded, bent by trim."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from walled import Walled
from wobbly import Wobbly, wobbly

from proxytune.domain import Episode
from proxytune.errors import EpisodeError
from proxytune.settings import Section

SHORT = 3
"""From start 2 the agent lasts only so many commands."""


class Driven(NamedTuple):
    """What the agent issued."""

    commands: np.ndarray


class Seen(NamedTuple):
    """What commands led to."""

    poses: np.ndarray
    pictures: np.ndarray


@dataclass(frozen=True)
class Echo(Walled):
    """A wobbly family, wrapped; it drives and replays."""

    inner: Wobbly

    def drive(self, episode: Episode) -> Driven:
        if any(fault.startswith(f"{episode.agent}:{episode.start}:") for fault in self.inner.faults):
            raise EpisodeError("raised ValueError at 1.20 s: it lost its way")
        steps = SHORT if episode.start == 2 else 150
        return Driven(np.random.default_rng(episode.seed).uniform(0, 1, (steps, 2)))

    def replay(self, episode: Episode, commands: np.ndarray) -> Seen:
        trim = {**dict(self.inner.theta), **dict(episode.theta)}.get("trim", 0.0)
        turned = np.cumsum(commands[:, 1] - commands[:, 0] + 0.2 * trim)
        moved = np.cumsum(0.02 * np.stack([np.cos(turned), np.sin(turned)], axis=1), axis=0)
        poses = np.vstack([np.full((1, 3), float(episode.start)), np.column_stack([moved, turned])])
        # A robot that pulls hard hits something, and its record ends there.
        lasts = 50 if trim >= 0.3 else len(commands)
        return Seen(poses[: lasts + 1], np.full((lasts, 2, 3, 3), round(100 + 100 * trim), dtype=np.uint8))


def echo(section: Section, *, model: Path | None) -> Echo:
    """The family that a [domain] table describes."""
    return Echo(wobbly(section, model=model))
