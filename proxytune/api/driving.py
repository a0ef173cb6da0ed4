"""One episode of a study's domain family, to look at, and θ as people give it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from proxytune import study as studies
from proxytune.domain import DomainFamily, make_episode
from proxytune.effects import SHIPPED, Catalogue, read_model
from proxytune.errors import InputError
from proxytune.report import frame_html
from proxytune.seeds import episode_seed
from proxytune.settings import check_whole, numbers_in
from proxytune.space import Theta
from proxytune.storage import FILE_NAME as DATABASE
from proxytune.sweep import best_theta, has_answer


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
        return frame_html(f"One episode: {scores}.", pd.DataFrame([self.scores]) if self.poses is None else self.poses)


def drive(
    study: str | Path, agent: str, theta: Theta | str | None = None, *, start: int = 0, seed: int | None = None
) -> DrivenEpisode:
    """Let an agent drive once in the proxy of a study.

    It is the very episode that a trial at this θ drives; the target's scores are not needed.

    Args:
        study: The study's folder, or its study.toml.
        agent: Its name, one of `python -m proxytune list agents`, or your own as "module:attribute".
        theta: Parameters of the domain instance, those not named are nominal; or "best", "nominal" or a model.toml.
        start: Which of the family's starting conditions, from 0.
        seed: Seed of everything random, as in study.toml; the study's own if not given.

    Raises:
        InputError: If there is no such study, agent, parameter or start.
        EpisodeError: If the agent or the domain fails.
    """
    settings = studies.read_study_settings(Path(study))
    family = studies.load_family(settings, settings.proxy)
    values = choose_theta(theta, settings, family, "theta")[0] if isinstance(theta, str) else theta or {}
    study_seed = settings.seed if seed is None else seed
    if not isinstance(agent, str):
        raise InputError(f"agent must be a name, as in 'steady', got {agent!r}")
    check_whole("start", start)
    check_whole("seed", study_seed)
    studies.check_episode(family, agent, values, start)
    own = episode_seed(study_seed, start)
    kept = studies.record_episode(family, make_episode(values, agent=agent, start=start, seed=own))
    poses, commands = (pd.DataFrame(dict(columns)) if columns else None for columns in (kept.poses, kept.commands))
    return DrivenEpisode(dict(kept.metrics), poses, commands)


def choose_theta(
    text: str | None, settings: studies.StudySettings, family: DomainFamily, option: str
) -> tuple[Theta, str]:
    """θ as an option has it, and where from: "best", "nominal" or "given".

    Without an option it is the study's best, or the nominal one as long as no trial is finished. An InputError if the
    text is no θ, the model is of another robot, or the study has no best θ.
    """
    if text == "best" or (text is None and (settings.home / DATABASE).is_file()):
        study = studies.open_settings(settings)
        if text == "best" or has_answer(study):
            return best_theta(study, option), "best"
    return given_theta(text, settings, family, option), "nominal" if text in (None, "nominal") else "given"


def given_theta(text: str | None, settings: studies.StudySettings, family: DomainFamily, option: str) -> Theta:
    """θ from NAME=VALUE pairs or a model.toml of the family's robot, else an InputError; none for `nominal`."""
    if text is not None and text.endswith(".toml"):
        studies.check_robot(family, Path(text), option)
        return studies.theta_of_model(family, settings, Path(text), f"{option} {text}")
    return read_theta(text, studies.family_catalogue(family, settings), option)


def read_theta(text: str | None, catalogue: Catalogue = SHIPPED, option: str = "--at") -> Theta:
    """θ from NAME=VALUE pairs or a model.toml, else an InputError; none for `nominal`."""
    if text is None or text == "nominal":
        return {}
    if text.endswith(".toml"):
        return read_model(Path(text), catalogue).theta
    return numbers_in(option, text, "NAME=VALUE,NAME=VALUE, best, nominal or a model.toml")
