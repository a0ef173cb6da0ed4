"""One episode of a study's domain family, to look at."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from proxytune.domain import make_episode
from proxytune.errors import InputError
from proxytune.report import frame_html
from proxytune.seeds import episode_seed
from proxytune.space import Theta
from proxytune.study import check_episode, load_family, read_study_settings, record_episode


@dataclass(frozen=True)
class DrivenEpisode:
    """What became of one episode.

    Attributes:
        scores: Its metrics, by name.
        poses: Columns time [s] and, of lane following, x, y [m] and heading [rad], 60 rows a second; None where the
            family keeps no poses.
        commands: Columns time [s] and, of lane following, the duties left and right, one row per command; None
            likewise.
    """

    scores: Mapping[str, float]
    poses: pd.DataFrame | None
    commands: pd.DataFrame | None

    def _repr_html_(self) -> str:
        scores = ", ".join(f"{name} {value:.4g}" for name, value in self.scores.items())
        table = pd.DataFrame([self.scores]) if self.poses is None else self.poses
        return frame_html(f"One episode: {scores}.", table)


def drive(
    study: str | Path, agent: str, theta: Theta | None = None, *, start: int = 0, seed: int | None = None
) -> DrivenEpisode:
    """Let an agent drive once in the proxy of a study.

    It is the very episode that a trial at this θ drives; the target's scores are not needed.

    Args:
        study: The study's folder, or its study.toml.
        agent: Its name, one of `python -m proxytune list agents`, or your own as "module:attribute".
        theta: Parameters of the domain instance; those not named are nominal.
        start: Which of the family's starting conditions, from 0.
        seed: Seed of everything random, as in study.toml; the study's own if not given.

    Raises:
        InputError: If there is no such study, agent, parameter or start.
        EpisodeError: If the agent or the domain fails.
    """
    settings = read_study_settings(Path(study))
    family = load_family(settings, settings.proxy)
    check_episode(family, agent, theta or {}, start)
    if seed is not None and seed < 0:
        raise InputError(f"seed must be at least 0, got {seed}")
    own = episode_seed(settings.seed if seed is None else seed, start)
    kept = record_episode(family, make_episode(theta or {}, agent=agent, start=start, seed=own))
    poses, commands = (pd.DataFrame(dict(columns)) if columns else None for columns in (kept.poses, kept.commands))
    return DrivenEpisode(dict(kept.metrics), poses, commands)
