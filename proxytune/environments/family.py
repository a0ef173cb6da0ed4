"""Any Gymnasium environment as a domain family: its own parameters and our effects are θ.

An agent is a function, what has `predict`, or one of two that need no code. One episode: it acts through effects until
the environment or the time ends it. `agent_of` goes the other way: a policy trained elsewhere drives our robot.
`played_environment` makes a function of θ, agent, start and seed of an environment that is at hand.
"""

import inspect
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import gymnasium
import numpy as np

from proxytune.domain import Episode, make_episode
from proxytune.driving import Command, Picture, Robot
from proxytune.effects import PARAMETERS, Catalogue, effects_from, is_learnt
from proxytune.environments.making import EnvironmentSettings, EpisodeMetric, make_environment, read_domain, read_values
from proxytune.environments.signals import Actuators, EnvironmentParameters, Sensors, Spaces, figures, look_at
from proxytune.errors import EpisodeError, ExtensionError, InputError, SettingsError
from proxytune.extensions import ask, describe, load
from proxytune.identity import digest, files_beside, meaning_of
from proxytune.lineage import code_name
from proxytune.seeds import acting_seed, course_generator, reset_seed
from proxytune.settings import Section, nearest
from proxytune.space import Space, Theta


class Predictor(Protocol):
    """Anything that has learnt to act, as stable-baselines3's algorithms and policies."""

    def predict(self, observation: Any, *, deterministic: bool) -> Any:
        """The action for an observation, or the action and a state, which it is given back as `state=`."""


def ask_policy(policy: Predictor, observation: Any, state: Any, *, deterministic: bool = True) -> tuple[Any, Any]:
    """A policy's action, and its state for the next observation, None where it has none."""
    known = {} if state is None else {"state": state}
    answer = policy.predict(observation, deterministic=deterministic, **known)
    return answer if isinstance(answer, tuple) and len(answer) == 2 else (answer, state)


@dataclass(frozen=True)
class PolicyAgent:
    """Does what a policy says to each picture."""

    policy: Predictor  # trained on pictures as the environment shows them, (rows, columns, 3)
    deterministic: bool = True  # takes its likeliest action; one that draws makes episodes differ at one seed

    def begin(self, robot: Robot) -> None:
        """No state yet."""

    def act(self, picture: Picture, memory: Any) -> tuple[Command, Any]:
        """The policy's duties, and its state for the next picture."""
        action, memory = ask_policy(self.policy, picture, memory, deterministic=self.deterministic)
        return np.clip(np.asarray(action, dtype=float), -1.0, 1.0), memory


def agent_of(policy: Predictor, *, deterministic: bool = True) -> PolicyAgent:
    """An agent for studies of anything with `predict(observation, deterministic=…) -> (action, state)`.

    Args:
        policy: As `stable_baselines3.PPO.load` gives it; trained on the environment's pictures as they are.
        deterministic: Whether it takes its likeliest action.

    Raises:
        ExtensionError: If it cannot predict.
    """
    if not callable(getattr(policy, "predict", None)):
        raise ExtensionError(f"a {type(policy).__name__} has no predict(observation, deterministic=…); add it")
    return PolicyAgent(policy, deterministic)


Act = Callable[[Any], Any]
"""From an observation to an action."""


def _random(space: Any, seed: int) -> Act:
    space.seed(seed)
    return lambda observation: space.sample()


def _zero(space: Any, seed: int) -> Act:
    rest = np.clip(0, getattr(space, "low", 0), getattr(space, "high", 0)) if hasattr(space, "low") else 0
    whole = int(getattr(space, "start", 0)) if space.shape == () else np.zeros(space.shape, dtype=space.dtype)
    action = np.asarray(rest, dtype=space.dtype) if hasattr(space, "low") else whole
    return lambda observation: action


BUILT_IN: Mapping[str, Callable[[Any, int], Act]] = MappingProxyType({"random": _random, "zero": _zero})


@dataclass
class Predicting:
    """Anything with `predict`, as the policies of stable-baselines3 do; a state that it answers with is handed back."""

    policy: Any
    state: Any = None

    def __call__(self, observation: Any) -> Any:
        """The action of its deterministic policy."""
        action, self.state = ask_policy(self.policy, observation, self.state)
        return action


def load_agent(name: Any, folder: Path, space: Any, seed: int) -> Act:
    """An agent ready for one episode, whose actions are of this space; refused where there is none.

    It is "random", which draws by the seed, "zero", or `module:attribute`: a function, an object with `predict`, or a
    class of either, made anew for each episode; or one of these itself.
    """
    if isinstance(name, str) and name in BUILT_IN:
        if name == "zero" and (space.shape is None or space.dtype is None):
            raise InputError(f"agent 'zero': the actions are {space}, which have no zero; take another")
        return BUILT_IN[name](space, seed)
    found = load(name, kind="agent", beside=folder, shipped=BUILT_IN) if isinstance(name, str) else name
    if inspect.isclass(found):
        found = ask(f"agent '{name}'", found)
    if hasattr(found, "predict"):
        return Predicting(found)
    if callable(found):
        act: Act = found
        return act
    raise ExtensionError(f"agent '{name}' is a {type(found).__name__}; give a function, or what has predict")


def ask_agent(act: Act, observation: Any, space: Any, step: int) -> Any:
    """An agent's next action, checked."""
    try:
        answer = act(observation)
    except Exception as problem:
        raise EpisodeError(f"raised {describe(problem)} at step {step}") from problem
    if hasattr(space, "low"):
        return _in_box(answer, space, step)
    action = np.asarray(answer).item() if np.ndim(answer) == 0 else answer
    if not space.contains(action):
        raise EpisodeError(f"answered {answer!r} at step {step}, which is not in {space}")
    return action


def _in_box(answer: Any, space: Any, step: int) -> Any:
    """A Box action in its type; beyond its bounds it is cut off."""
    try:
        action = np.asarray(answer, dtype=space.dtype)
        whole = action.reshape(space.shape) if action.size == np.prod(space.shape) else None
    except (TypeError, ValueError):
        raise EpisodeError(f"answered {answer!r} at step {step}, which is no array of numbers") from None
    if whole is None or not np.isfinite(whole).all():
        raise EpisodeError(f"answered {answer!r} at step {step}; an action is {space.shape} finite numbers")
    return np.clip(whole, space.low, space.high)


Infos = list[Mapping[str, Any]]
FOLDS: Mapping[str, Any] = {"sum": np.sum, "mean": np.mean, "max": np.max, "min": np.min}


class WrappedEnvironment:
    """An environment behind effects, in the midst of an episode."""

    def __init__(self, environment: Any, actuators: Actuators, sensors: Sensors) -> None:
        self._environment, self._actuators, self._sensors = environment, actuators, sensors
        self.rewards: list[float] = []
        self.infos: Infos = []

    def reset(self, seed: int, later: np.random.Generator) -> Any:
        """Begin from the state that the seed gives; what is drawn later in the episode comes from `later`."""
        try:
            observation, _ = self._environment.reset(seed=seed)
        except Exception as problem:
            raise EpisodeError(f"the environment's reset raised {describe(problem)}") from problem
        self._environment.unwrapped.np_random = later
        return self._sensors.show(observation)

    def step(self, action: Any) -> tuple[Any, bool]:
        """The next observation, and whether the episode is over."""
        try:
            seen, reward, terminated, truncated, info = self._environment.step(self._actuators.pass_on(action))
        except Exception as problem:
            raise EpisodeError(f"the environment raised {describe(problem)} at step {len(self.rewards)}") from problem
        self.rewards.append(float(reward))
        self.infos.append(dict(info))
        return self._sensors.show(seen), bool(terminated or truncated)


def play(wrapped: WrappedEnvironment, act: Act, first: Any, space: Any, steps: int) -> None:
    """Let an agent act from its first observation on, for so many steps at most."""
    observation = first
    for step in range(steps):
        observation, over = wrapped.step(ask_agent(act, observation, space, step))
        if over:
            return


def score(wrapped: WrappedEnvironment, metrics: tuple[EpisodeMetric, ...]) -> dict[str, float]:
    """The metrics of an episode that is over."""
    whole = {"return": float(np.sum(wrapped.rewards)), "length": float(len(wrapped.rewards))}
    return {one.name: whole[one.source] if one.source in whole else _of_info(wrapped.infos, one) for one in metrics}


def _of_info(infos: Infos, metric: EpisodeMetric) -> float:
    steps = infos[-1:] if metric.fold == "last" else infos
    try:
        values = [float(info[metric.entry]) for info in steps]
    except KeyError:
        known = sorted({key for info in steps for key in info})
        hint = nearest(metric.entry, known) if known else "info is empty"
        raise EpisodeError(f"metric '{metric.name}': info has no '{metric.entry}' at every step; {hint}") from None
    except (TypeError, ValueError):
        raise EpisodeError(f"metric '{metric.name}': '{metric.entry}' of info is no number; name another") from None
    return values[-1] if metric.fold == "last" else float(FOLDS[metric.fold](values))


STARTS = 1000
"""Each is an initial state of the environment, by a seed of its own."""
READ_BY_CODE = (".py", ".xml", ".urdf", ".sdf", ".zip", ".npz", ".pt", ".onnx")
"""Modules, bodies and policies: what a study makes itself, as tables and figures, is none of them."""


@dataclass(frozen=True)
class GymnasiumFamily:
    """S_Θ of an environment.

    A start is a state to begin from, the same in every instance and under every seed of a study; the episode's seed is
    for what the environment draws later, for effects, and for the agent "random".
    """

    settings: EnvironmentSettings  # the [domain] table
    spaces: Spaces  # what the environment is
    held: tuple[tuple[str, float], ...]  # values that every instance has, sorted by name in θ
    policies: Mapping[str, Any] = field(default_factory=dict)  # agents at hand, by name; no part of the identity

    @property
    def identity(self) -> str:
        """A digest of settings, of what our code and the user's files mean, and of versions.

        The `repr` of settings and spaces counts: their classes and attributes cannot be renamed without giving every
        episode another name.
        """
        folder = self.settings.folder
        own = meaning_of((path for path in files_beside(folder) if path.suffix in READ_BY_CODE), folder)
        table = [getattr(self.settings, name) for name in self.settings.__dataclass_fields__ if name != "folder"]
        return digest(table, self.spaces, self.held, code_name("environments"), own)

    @property
    def versions(self) -> Mapping[str, str]:
        """Versions of the packages that simulate."""
        return dict(self.spaces.packages)

    @property
    def metrics(self) -> Mapping[str, str]:
        """Those of [domain.metrics], with their units."""
        return {one.name: one.unit for one in self.settings.metrics}

    @property
    def parameters(self) -> EnvironmentParameters:
        """The environment's own, and those of effects that can wrap it."""
        return EnvironmentParameters(self.settings.own, Catalogue(self.settings.folder), self.spaces)

    @property
    def nominal(self) -> Mapping[str, float]:
        """Values of an instance that names no θ: those that every instance has, and else neutral ones."""
        neutral = {name: one.neutral for name, one in self.parameters.items() if not isinstance(one.neutral, str)}
        return neutral | dict(self.held)

    @property
    def starts(self) -> int:
        """Number of initial states."""
        return STARTS

    def truth(self, model: Path) -> Theta:
        """θ of the model.toml that made a target."""
        return read_values(model, self.settings.own, self.settings.folder)

    def check_agent(self, name: str) -> None:
        """Load the agent once."""
        with closing(make_environment(self.settings, dict(self.held))) as environment:
            load_agent(self.policies.get(name, name), self.settings.folder, environment.action_space, 0)

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Play one episode and score it."""
        theta = {**dict(self.held), **dict(episode.theta)}
        own, folder = {one.parameter.name for one in self.settings.own}, self.settings.folder
        named = {name: value for name, value in theta.items() if name not in own}
        effects = effects_from(named, figures(self.spaces), Catalogue(folder))
        seed = acting_seed(episode.seed, episode.start)
        try:
            environment = make_environment(self.settings, theta)
        except InputError as problem:
            raise EpisodeError(str(problem)) from problem
        with closing(environment):
            sensors = Sensors(effects, self.spaces, self.settings.state, episode.seed)
            wrapped = WrappedEnvironment(environment, Actuators(effects, self.spaces, episode.seed), sensors)
            agent = self.policies.get(episode.agent, episode.agent)
            act = load_agent(agent, folder, environment.action_space, seed)
            first = wrapped.reset(reset_seed(episode.start), course_generator(episode.seed, episode.start))
            play(wrapped, act, first, environment.action_space, self.spaces.steps)
            return score(wrapped, self.settings.metrics)


def gymnasium_family(
    section: Section, *, model: Path | None, policies: Mapping[str, Any] = MappingProxyType({})
) -> GymnasiumFamily:
    """The family that a study's `[domain]` table describes.

    Args:
        section: Keys environment, steps, rate_hz, and tables arguments, parameters, metrics, state, effects.
        model: A model.toml: effects, and in its table [parameters] values of the environment's own.
        policies: Agents that are at hand, by name.

    Raises:
        InputError: In one line, with file, key and remedy.
    """
    settings = read_domain(section)
    try:
        spaces = look_at(settings)
    except SettingsError as problem:
        raise SettingsError(f"{section.path}: {problem}") from None
    except InputError as problem:
        raise section.error("environment", str(problem)) from None
    held = dict(settings.effects)
    _check(section.section("effects"), held, settings, spaces)
    if model is not None:
        given = read_values(model, settings.own, settings.folder)
        _check(Section(model, "", {}), given, settings, spaces)
        held |= given
    return GymnasiumFamily(settings, spaces, tuple(sorted(held.items())), dict(policies))


def _check(table: Section, values: Theta, settings: EnvironmentSettings, spaces: Spaces) -> None:
    """Refuse values of effects that cannot wrap the environment."""
    catalogue = Catalogue(settings.folder)
    known = EnvironmentParameters(settings.own, catalogue, spaces)
    for name, value in values.items():
        try:
            known[name]
        except InputError as problem:
            # What vanishes does no harm: a model of two wheels alike states an imbalance of 0
            if is_learnt(name) or catalogue.parameters[name].neutral != value:
                raise table.error(name, str(problem)) from None


@dataclass(frozen=True)
class PlayedEnvironment:
    """An environment as a function: its family plays it, and what has no registered name is made by `make`."""

    family: GymnasiumFamily
    name: str
    make: Callable[..., Any] | None

    def __call__(self, theta: Theta, agent: str, start: int, seed: int) -> Mapping[str, float]:
        """The metrics of one episode."""
        _register(self.name, self.make)
        return self.family.run(make_episode(theta, agent=agent, start=start, seed=seed))


def played_environment(
    given: Any, space: Space, policies: Mapping[str, Any], domain: Mapping[str, Any], path: Path
) -> PlayedEnvironment:
    """The function that plays episodes of an environment, given as a registered name or as what makes it.

    In its space are effects by name, attributes with a point, else arguments of the constructor; `domain` has other
    keys of a `[domain]` table, and complaints name the path.

    Raises:
        InputError: If the environment, a parameter or a policy cannot be used.
    """
    make = None if isinstance(given, str) else given
    name = given if make is None else f"proxytune_tune/{getattr(make, '__name__', type(make).__name__).strip('<>')}-v0"
    _register(name, make)
    own = {
        one.name: {
            "attribute" if "." in one.name else "argument": one.name,
            "low": one.low,
            "high": one.high,
            "neutral": 0.5 * (one.low + one.high),
        }
        for one in space.intervals
        if one.name not in PARAMETERS
    }
    section = Section(path, "domain.", {"environment": name, "parameters": own, **domain})
    return PlayedEnvironment(gymnasium_family(section, model=None, policies=policies), name, make)


def _register(name: str, make: Callable[..., Any] | None) -> None:
    """Have Gymnasium know what makes an environment, in this process; once is enough."""
    known = gymnasium.registry.get(name)
    if make is not None and (known is None or known.entry_point is not make):
        gymnasium.registry.pop(name, None)
        gymnasium.register(name, entry_point=make)
