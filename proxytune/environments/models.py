"""What a model.toml gives an environment."""

from pathlib import Path

from proxytune.effects import Catalogue, read_effects
from proxytune.environments.settings import OwnParameter
from proxytune.settings import nearest, read_settings


def read_values(path: Path, own: tuple[OwnParameter, ...], folder: Path) -> dict[str, float]:
    """What a model.toml gives an environment: its effects, and in [parameters] values of the environment's own.

    A model that `diagnose` wrote names a robot too, which says nothing of an environment.

    Raises:
        SettingsError: With file, key and remedy.
    """
    settings = read_settings(path)
    settings.only(("format", "robot", "plant", "geometry", "parameters", "effects"))
    settings.whole("format", 1, low=1, high=1)
    known = {one.parameter.name: one.parameter for one in own}
    given = settings.section("parameters")
    for name in given:
        if name not in known:
            hint = nearest(name, known) if known else "study.toml has no [domain.parameters]"
            raise given.error(name, f"is no parameter of the environment; {hint}")
    values = {name: given.number(name, low=known[name].low, high=known[name].high) for name in given}
    effects, _ = read_effects(settings.section("effects"), Catalogue(folder))
    return {**values, **effects}
