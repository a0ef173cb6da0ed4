"""One episode of a study's domain family, to look at."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from proxytune.domain import make_episode
from proxytune.errors import InputError
from proxytune.seeds import episode_seed
from proxytune.space import Theta
from proxytune.study.study import open_study


@dataclass(frozen=True)
class DrivenEpisode:
    """What became of one episode.

    Attributes:
        scores: Its metrics, by name.
        poses: Columns time [s], x, y [m], heading [rad], one row per tick; None where the family keeps no poses.
        commands: Columns left and right, or whatever channels the family has, one row per control step; None likewise.
    """

    scores: Mapping[str, float]
    poses: pd.DataFrame | None
    commands: pd.DataFrame | None


def drive(
    study: str | Path, agent: str, theta: Theta | None = None, *, start: int = 0, seed: int | None = None
) -> DrivenEpisode:
    """Let an agent drive once in the proxy of a study.

    Args:
        study: The study's folder.
        agent: Its name, one of `python -m proxytune list agents` or your own.
        theta: Parameters of the domain instance; those not named are nominal.
        start: Which of the family's starting conditions.
        seed: Seed of everything random; the study's own if not given.

    Raises:
        InputError: If there is no such study, agent, parameter or start.
        EpisodeError: If the agent fails.
    """
    opened = open_study(Path(study))
    family: Any = opened.family
    family.check_agent(agent)
    if not 0 <= start < family.starts:
        raise InputError(f"start {start}: the family has {family.starts}; give 0 to {family.starts - 1}")
    own = episode_seed(opened.settings.seed if seed is None else seed, start)
    episode = make_episode(theta or {}, agent=agent, start=start, seed=own)
    scores = dict(family.run(episode))
    if not hasattr(family, "drive"):
        return DrivenEpisode(scores, None, None)
    driven = family.drive(episode)
    return DrivenEpisode(scores, _poses(driven.poses), pd.DataFrame(np.asarray(driven.commands)))


def _poses(poses: Any) -> pd.DataFrame:
    return pd.DataFrame(np.asarray(poses), columns=["x", "y", "heading"])
