"""Our effects round an environment: on actions on their way in, on observations on their way out.

`look_at` finds out what an environment is. `Actuators` and `Sensors` filter its signals, and `EnvironmentParameters`
names what θ may tune of it: its own parameters, and those of every effect that can wrap it. The name and fields of
`Spaces` count in a family's identity.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from proxytune.effects import (
    CATALOGUE,
    Catalogue,
    Chain,
    Effect,
    FilterContext,
    Signal,
    Stage,
    effect_of,
    is_learnt,
    stage_chain,
)
from proxytune.environments.making import POSE, EnvironmentSettings, OwnParameter, make_environment
from proxytune.errors import ExtensionError, SettingsError
from proxytune.identity import versions_of
from proxytune.space import Parameter

PICTURE = "uint8 pictures of shape (rows, columns, 3)"


@dataclass(frozen=True)
class Spaces:
    """Facts about an environment; a text says why something is not to be had."""

    low: tuple[float, ...]  # smallest actions
    high: tuple[float, ...]  # largest actions; as many as there are actions
    no_actions: str  # why there are no Box actions that effects could bend, or empty
    picture: tuple[int, int] | None  # rows and columns of the observed picture, or None
    no_picture: str  # why there is none, or empty
    no_state: str  # why no entries of the observation are known to be x, y and heading, or empty
    rate_hz: float | None  # steps per second; None where nobody says
    steps: int  # longest episode
    packages: tuple[tuple[str, str], ...]  # versions of what simulates, by package


def look_at(settings: EnvironmentSettings) -> Spaces:
    """Make the environment once and see what it is; refused if its settings do not fit it."""
    environment = make_environment(settings, {})
    try:
        box = gymnasium.spaces.Box
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


WHEELS = 2
"""Effects on commands are written for a left and a right wheel."""


def figures(spaces: Spaces) -> dict[str, float]:
    """The nominal figures that effects ask for: commands come at every step, and nothing lags."""
    known = {"control_rate": spaces.rate_hz or 1.0, "motor_time_constant": 0.0}
    if spaces.picture is not None:
        known |= {"camera_rows": float(spaces.picture[0]), "camera_columns": float(spaces.picture[1])}
    return known


def rest_of(stage: Stage, spaces: Spaces) -> Signal:
    """The signal of a stage before time zero, as far as the spaces tell it."""
    if stage is Stage.IMAGE and spaces.picture is not None:
        return np.zeros(3 * spaces.picture[0] * spaces.picture[1], dtype=np.float32)
    if stage is Stage.MEASUREMENT:
        return np.zeros(3)
    return np.zeros(WHEELS if len(spaces.low) == WHEELS else (len(spaces.low), WHEELS))


def context_of(spaces: Spaces, rest: Signal, seed: int) -> FilterContext:
    """Context of a chain before its first sample; where the rate is not known, no effect asks for it."""
    return FilterContext(spaces.rate_hz or 1.0, rest, figures(spaces), seed)


class Actuators:
    """Command and actuation effects on Box actions, as shares of the largest one; zero stays zero.

    Of two actions, the first is the left wheel's and the second the right one's. Of any other number, each is filtered
    by itself, as a robot's two wheels that are commanded alike.
    """

    def __init__(self, effects: Iterable[Effect], spaces: Spaces, seed: int) -> None:
        chosen = tuple(effects)
        self._chains = [stage_chain(chosen, stage) for stage in (Stage.COMMAND, Stage.ACTUATION)]
        self._idle = not any(chain.effects for chain in self._chains)
        context = context_of(spaces, rest_of(Stage.COMMAND, spaces), seed)
        self._memories: list[Any] = [chain.begin(context) for chain in self._chains]
        self._low, self._high = np.array(spaces.low), np.array(spaces.high)
        self._largest = np.maximum(np.abs(self._low), np.abs(self._high))
        self._largest[self._largest == 0.0] = 1.0

    def pass_on(self, action: Any) -> Any:
        """Action that reaches the environment of the next action; whole numbers are rounded to the nearest ones."""
        if self._idle:
            return action
        shares = np.asarray(action, dtype=float) / self._largest
        signal = shares[None] if len(shares) == WHEELS else np.repeat(shares[:, None, None], WHEELS, axis=-1)
        for number, chain in enumerate(self._chains):
            signal, self._memories[number] = chain.apply(np.clip(signal, -1.0, 1.0), self._memories[number])
        bent = signal[0] if len(shares) == WHEELS else signal[:, 0, 0]
        given = np.clip(bent * self._largest, self._low, self._high)
        kind = np.asarray(action).dtype
        return (np.rint(given) if np.issubdtype(kind, np.integer) else given).astype(kind)


class Sensors:
    """Image effects on pictures, or measurement effects on a pose within the observation."""

    def __init__(self, effects: Iterable[Effect], spaces: Spaces, state: tuple[int, ...] | None, seed: int) -> None:
        chosen = tuple(effects)
        self._spaces, self._seed = spaces, seed
        self._image = stage_chain(chosen, Stage.IMAGE)
        self._measurement = stage_chain(chosen, Stage.MEASUREMENT)
        self._places = list(state or ())
        self._memory: Any = None

    def show(self, observation: Any) -> Any:
        """Observation as the agent sees it."""
        if self._image.effects:
            signal = np.asarray(observation).reshape(1, -1)
            developed = self._filtered(self._image, signal.astype(np.float32))
            return np.clip(np.rint(developed), 0, 255).astype(np.uint8).reshape(np.shape(observation))
        if self._measurement.effects:
            measured = np.array(observation)
            measured[self._places] = self._filtered(self._measurement, measured[None, self._places].astype(float))[0]
            return measured
        return observation

    def _filtered(self, chain: Chain, signal: Signal) -> NDArray[Any]:
        if self._memory is None:
            self._memory = chain.begin(context_of(self._spaces, signal[0], self._seed))
        bent, self._memory = chain.apply(signal, self._memory)
        return bent


ON_COMMANDS = (Stage.COMMAND, Stage.ACTUATION)
TWO_WHEELS = ("trim", "wheel_gain", "battery_sag")
"""Effects that set one of two wheels against the other, or sum over both."""
IMBALANCE = "imbalance"
TIMES = {"s", "min", "Hz"}
"""Units that only a rate makes sense of."""


@dataclass(frozen=True)
class EnvironmentParameters(Mapping[str, Parameter]):
    """Parameters by their names in θ; a user's own effects answer where they are asked for by name.

    Raises:
        ExtensionError: If an effect that is asked for cannot wrap the environment, with the reason.
    """

    own: tuple[OwnParameter, ...]  # of the environment
    catalogue: Catalogue  # the effects that there are
    spaces: Spaces  # what they would wrap

    def __getitem__(self, name: str) -> Parameter:
        for one in self.own:
            if one.parameter.name == name:
                return one.parameter
        if is_learnt(name):
            raise ExtensionError(f"'{name}' bends the motion of a robot's body; an environment moves by itself")
        parameter = self.catalogue.parameters[name]
        if reason := self._refusal(effect_of(name), parameter):
            raise ExtensionError(f"effect '{effect_of(name)}' cannot wrap this environment: {reason}")
        return parameter

    def __iter__(self) -> Iterator[str]:
        yield from (one.parameter.name for one in self.own)
        for effect in self.catalogue.names:
            kind = self.catalogue.effect(effect)
            for name, parameter in zip(self.catalogue.theta_names(effect), kind.parameters, strict=True):
                if not self._refusal(effect, parameter):
                    yield name

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _refusal(self, name: str, parameter: Parameter) -> str:
        kind, spaces = self.catalogue.effect(name), self.spaces
        return _of_stage(kind, spaces) or _of_wheels(name, kind, parameter, spaces) or _of_needs(kind, spaces)


def _of_stage(kind: type[Effect], spaces: Spaces) -> str:
    """Reason why nothing of this stage can be bent, or empty."""
    if kind.stage is Stage.MOTION:
        return "it bends the motion of a robot's body; vary the environment's own physics in [domain.parameters]"
    if kind.stage is Stage.CAMERA:
        return "it mounts the camera that proxytune draws; the environment draws its own pictures"
    if kind.stage is Stage.MEASUREMENT:
        return spaces.no_state
    return spaces.no_actions if kind.stage in ON_COMMANDS else spaces.no_picture


def _of_wheels(name: str, kind: type[Effect], parameter: Parameter, spaces: Spaces) -> str:
    """Reason why it needs two wheels where there are not two actions, or empty."""
    count = len(spaces.low)
    if kind.stage not in ON_COMMANDS or count == 2:
        return ""
    if name in TWO_WHEELS or name not in CATALOGUE:
        return f"it is made for two actions, a left and a right wheel; here are {count}"
    if parameter.name == IMBALANCE:
        return f"{IMBALANCE} shares an effect out between two wheels; here are {count} actions, all alike"
    return ""


def _of_needs(kind: type[Effect], spaces: Spaces) -> str:
    """Something that it would have to know of the robot and nobody says, or empty."""
    units = {part for one in kind.parameters for part in re.split(r"[^A-Za-z]+", one.unit)}
    if spaces.rate_hz is None and units & TIMES:
        return "it needs the time that a step takes; add rate_hz to [domain], steps per second"
    known = figures(spaces)
    try:
        values = [one.neutral_value(known) for one in kind.parameters]
        kind(*values).begin(FilterContext(spaces.rate_hz or 1.0, rest_of(kind.stage, spaces), known))
    except KeyError as figure:
        return f"it needs a robot's {str(figure).strip(chr(39))}, which an environment does not state"
    return ""
