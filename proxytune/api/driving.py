"""One episode of a study's domain family, to look at."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from proxytune.domain import DomainFamily, Episode, Recording, make_episode
from proxytune.errors import EpisodeError, InputError, ProxytuneError
from proxytune.extensions import describe
from proxytune.running.episodes import run_episode
from proxytune.seeds import episode_seed
from proxytune.settings import nearest
from proxytune.space import Theta
from proxytune.study.evaluation import failure_of
from proxytune.study.family import load_family
from proxytune.study.settings import read_study_settings


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
    _check(family, agent, theta or {}, start)
    if seed is not None and seed < 0:
        raise InputError(f"seed must be at least 0, got {seed}")
    own = episode_seed(settings.seed if seed is None else seed, start)
    return _drive(family, make_episode(theta or {}, agent=agent, start=start, seed=own))


def _check(family: DomainFamily, agent: str, theta: Theta, start: int) -> None:
    """Refuse what the family does not have."""
    try:
        family.check_agent(agent)
    except ProxytuneError:
        raise
    except Exception as problem:
        raise InputError(f"agent '{agent}': check_agent of the domain family raised {describe(problem)}") from problem
    if not 0 <= start < family.starts:
        raise InputError(f"start {start}: the family has {family.starts}; give 0 to {family.starts - 1}")
    for name, value in theta.items():
        known = family.parameters.get(name)
        if known is None:
            raise InputError(f"θ: unknown parameter '{name}'; {nearest(name, family.parameters)}")
        if not known.low <= value <= known.high:
            raise InputError(f"θ: {name} must lie within [{known.low:g}, {known.high:g}], got {value:g}")


def _drive(family: DomainFamily, episode: Episode) -> DrivenEpisode:
    recorder: Any = _RecordingFamily(family)
    outcome = run_episode(recorder, episode)
    if outcome.metrics is None:
        raise EpisodeError(failure_of(outcome))
    poses, commands = (pd.DataFrame(dict(columns)) if columns else None for columns in recorder.recording[1:])
    return DrivenEpisode(dict(outcome.metrics), poses, commands)


class _RecordingFamily:
    """What running an episode asks of a family, answered by one that records it if it can."""

    def __init__(self, family: Any) -> None:
        self._family = family
        self.metrics: Mapping[str, str] = family.metrics
        self.recording = Recording({}, {}, {})

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Run the episode, and keep its recording."""
        records = hasattr(self._family, "record")
        self.recording = self._family.record(episode) if records else Recording(self._family.run(episode), {}, {})
        return self.recording.metrics
