"""Any Gymnasium environment as a domain family: its own parameters and our effects are θ."""

import hashlib
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from proxytune.domain import Episode
from proxytune.effects import Catalogue, Effect, effects_from
from proxytune.effects.learnt.table import is_learnt
from proxytune.environments.agents import load_agent
from proxytune.environments.episode import play, score, wrap
from proxytune.environments.identity import code_meaning, folder_meaning
from proxytune.environments.making import make_environment
from proxytune.environments.models import read_values
from proxytune.environments.parameters import EnvironmentParameters
from proxytune.environments.settings import EnvironmentSettings, read_domain
from proxytune.environments.signals import figures
from proxytune.environments.spaces import Spaces, look_at
from proxytune.errors import EpisodeError, InputError, SettingsError
from proxytune.seeds import acting_seed, course_generator, reset_seed
from proxytune.settings import Section
from proxytune.space import Theta

STARTS = 1000
"""Each is an initial state of the environment, by a seed of its own."""


@dataclass(frozen=True)
class GymnasiumFamily:
    """S_Θ of an environment.

    A start is a state to begin from, the same in every instance and under every seed of a study; the episode's seed is
    for what the environment draws later, for effects, and for the agent "random".

    Attributes:
        settings: The [domain] table.
        spaces: What the environment is.
        held: Values that every instance has, sorted by name in θ.
    """

    settings: EnvironmentSettings
    spaces: Spaces
    held: tuple[tuple[str, float], ...]

    @property
    def identity(self) -> str:
        """A digest of settings, of what our code and the user's files mean, and of versions."""
        table = [getattr(self.settings, name) for name in self.settings.__dataclass_fields__ if name != "folder"]
        parts = (table, self.spaces, self.held, code_meaning(), folder_meaning(self.settings.folder))
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]

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
    def starts(self) -> int:
        """How many initial states are numbered."""
        return STARTS

    def truth(self, model: Path) -> Theta:
        """θ of the model.toml that made a target."""
        return read_values(model, self.settings.own, self.settings.folder)

    def check_agent(self, name: str) -> None:
        """Load the agent once.

        Raises:
            InputError: If there is no such agent.
        """
        with closing(make_environment(self.settings, dict(self.held))) as environment:
            load_agent(name, self.settings.folder, environment.action_space, 0)

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Play one episode and score it.

        Raises:
            EpisodeError: If the agent or the environment fails.
        """
        theta = {**dict(self.held), **dict(episode.theta)}
        effects, folder, seed = self._effects(theta), self.settings.folder, acting_seed(episode.seed, episode.start)
        try:
            environment = make_environment(self.settings, theta)
        except InputError as problem:
            raise EpisodeError(str(problem)) from problem
        with closing(environment):
            wrapped = wrap(environment, effects, self.spaces, self.settings.state, episode.seed)
            act = load_agent(episode.agent, folder, environment.action_space, seed)
            first = wrapped.reset(reset_seed(episode.start), course_generator(episode.seed, episode.start))
            play(wrapped, act, first, environment.action_space, self.spaces.steps)
            return score(wrapped, self.settings.metrics)

    def _effects(self, theta: Theta) -> tuple[Effect, ...]:
        own = {one.parameter.name for one in self.settings.own}
        named = {name: value for name, value in theta.items() if name not in own}
        return effects_from(named, figures(self.spaces), Catalogue(self.settings.folder))


def gymnasium_family(section: Section, *, model: Path | None) -> GymnasiumFamily:
    """The family that a study's `[domain]` table describes.

    Args:
        section: Keys environment, steps, rate_hz, and tables arguments, parameters, metrics, state, effects.
        model: A model.toml: effects, and in its table [parameters] values of the environment's own.

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
    return GymnasiumFamily(settings, spaces, tuple(sorted(held.items())))


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
