"""θ as people give it: values, a model.toml, the best that a study has found, or none."""

from pathlib import Path
from typing import NamedTuple

from proxytune.domain import DomainFamily
from proxytune.effects import SHIPPED, Catalogue, read_model
from proxytune.errors import InputError
from proxytune.space import Theta
from proxytune.storage import FILE_NAME as DATABASE
from proxytune.study import StudySettings, check_robot, family_catalogue, open_settings
from proxytune.sweep import best_theta, has_answer


class ChosenTheta(NamedTuple):
    """θ, and where it comes from: "best", "nominal" or "given"."""

    theta: Theta
    origin: str


def choose_theta(text: str | None, settings: StudySettings, family: DomainFamily, option: str) -> ChosenTheta:
    """θ as an option has it; without one the study's best, or the nominal one as long as no trial is finished.

    Raises:
        InputError: If the text is no θ, the model is of another robot, or the study has no best θ.
    """
    if text == "best" or (text is None and (settings.home / DATABASE).is_file()):
        study = open_settings(settings)
        if text == "best" or has_answer(study):
            return ChosenTheta(best_theta(study, option), "best")
    if text is not None and text.endswith(".toml"):
        check_robot(family, Path(text), option)
    own = getattr(family, "truth", None)
    if own is not None and text is not None and text.endswith(".toml"):
        # A family with parameters that are no effects reads them itself
        return ChosenTheta(own(Path(text)), "given")
    theta = read_theta(text, family_catalogue(family, settings), option)
    return ChosenTheta(theta, "nominal" if text in (None, "nominal") else "given")


def read_theta(text: str | None, catalogue: Catalogue = SHIPPED, option: str = "--at") -> Theta:
    """θ from NAME=VALUE pairs or a model.toml; none for `nominal`.

    Raises:
        InputError: If it is neither.
    """
    if text is None or text == "nominal":
        return {}
    if text.endswith(".toml"):
        return read_model(Path(text), catalogue).theta
    pairs = [pair.partition("=") for pair in text.split(",")]
    try:
        theta = {name.strip(): float(value) for name, _, value in pairs}
    except ValueError:
        raise InputError(f"{option} {text}: write NAME=VALUE,NAME=VALUE, best, nominal or a model.toml") from None
    if len(theta) < len(pairs):
        raise InputError(f"{option} {text}: names a parameter twice; give each once")
    return theta
