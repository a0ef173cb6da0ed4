"""What proxytune has to know of an environment: its actions, observations and rate."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from proxytune.environments.making import gymnasium, make_environment
from proxytune.environments.settings import POSE, EnvironmentSettings
from proxytune.errors import SettingsError
from proxytune.versions import versions_of

PICTURE = "uint8 pictures of shape (rows, columns, 3)"


@dataclass(frozen=True)
class Spaces:
    """Facts about an environment; a text says why something is not to be had.

    Attributes:
        low: Smallest actions.
        high: Largest actions; as many as there are actions.
        no_actions: Why there are no Box actions that effects could bend, or empty.
        picture: Rows and columns of the observed picture, or None.
        no_picture: Why there is none, or empty.
        no_state: Why no entries of the observation are known to be x, y and heading, or empty.
        rate_hz: Steps per second; None where nobody says.
        steps: Longest episode.
        packages: Versions of what simulates, by package.
    """

    low: tuple[float, ...]
    high: tuple[float, ...]
    no_actions: str
    picture: tuple[int, int] | None
    no_picture: str
    no_state: str
    rate_hz: float | None
    steps: int
    packages: tuple[tuple[str, str], ...]


def look_at(settings: EnvironmentSettings) -> Spaces:
    """Make the environment once and see what it is.

    Raises:
        InputError: If it cannot be made.
        SettingsError: If its settings do not fit it.
    """
    environment = make_environment(settings, {})
    try:
        box = gymnasium().spaces.Box
        low, high, no_actions = _actions(environment.action_space, box)
        picture, no_picture = _picture(environment.observation_space, box)
        no_state = _check_state(settings, environment.observation_space, box)
        rate = settings.rate_hz or _rate(environment)
        steps, packages = _steps(settings, environment), tuple(sorted(_packages(environment).items()))
        return Spaces(low, high, no_actions, picture, no_picture, no_state, rate, steps, packages)
    finally:
        environment.close()


def _actions(space: Any, box: Any) -> tuple[tuple[float, ...], tuple[float, ...], str]:
    take = "these effects take Box actions of shape (n,) with finite bounds"
    if not isinstance(space, box) or len(space.shape) != 1:
        return (), (), f"the actions are {space}; {take}"
    if not (np.isfinite(space.low).all() and np.isfinite(space.high).all()):
        return (), (), f"the actions have no bounds; {take}"
    return tuple(space.low.tolist()), tuple(space.high.tolist()), ""


def _picture(space: Any, box: Any) -> tuple[tuple[int, int] | None, str]:
    if isinstance(space, box) and space.dtype == np.uint8 and len(space.shape) == 3 and space.shape[2] == 3:
        return (space.shape[0], space.shape[1]), ""
    return None, f"the observations are {' '.join(str(space).split())}; effects on images take {PICTURE}"


def _check_state(settings: EnvironmentSettings, space: Any, box: Any) -> str:
    if settings.state is None:
        places = ", ".join(f"{name} = {place}" for place, name in enumerate(POSE))
        return f"which entries of the observation are the pose is not stated; add [domain.state] {places}"
    if not isinstance(space, box) or len(space.shape) != 1 or not np.issubdtype(space.dtype, np.floating):
        raise SettingsError(f"domain.state: the observations are {space}, no Box of numbers of shape (n,); take it out")
    last = space.shape[0] - 1
    for name, place in zip(POSE, settings.state, strict=True):
        if place > last:
            raise SettingsError(f"domain.state.{name}: the observation has entries 0 to {last}, got {place}")
    return ""


def _rate(environment: Any) -> float | None:
    """By the time that a step takes; `render_fps` says how it is to be shown, not how it is simulated."""
    step_s = getattr(environment.unwrapped, "dt", None)
    number = float(step_s) if isinstance(step_s, int | float | np.floating) else 0.0
    return 1.0 / number if np.isfinite(number) and number > 0.0 else None


def _steps(settings: EnvironmentSettings, environment: Any) -> int:
    limit = settings.steps or (environment.spec.max_episode_steps if environment.spec else None)
    if limit is None:
        raise SettingsError("domain.steps: is missing, and the environment states no limit; add it")
    return int(limit)


def _packages(environment: Any) -> dict[str, str]:
    """Versions of Gymnasium, NumPy, and whatever packages the environment and its parts come from."""
    inside = environment.unwrapped
    kinds = [*type(inside).__mro__, *(type(part) for part in vars(inside).values())]
    names = {"gymnasium", "numpy", *(kind.__module__.partition(".")[0] for kind in kinds)}
    return {name: version for name, version in versions_of(names).items() if version != "unknown"}
