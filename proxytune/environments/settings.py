"""What a study's [domain] table says of a Gymnasium environment, read strictly."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proxytune.effects import PARAMETERS, Catalogue, read_effects
from proxytune.errors import SettingsError
from proxytune.settings import Section
from proxytune.space import Parameter

KEYS = ("environment", "steps", "rate_hz", "arguments", "parameters", "metrics", "state", "effects")
FOLDS = ("last", "sum", "mean", "max", "min")
"""How an entry of info, one value a step, becomes a metric."""
OF_THE_EPISODE = {"return": "", "length": "steps"}
"""Metrics that every environment has, with their units."""
POSE = ("x", "y", "heading")
_STEP = r"[A-Za-z_]\w*(\[\d+(,\s*\d+)*\])?"
ATTRIBUTE = re.compile(rf"{_STEP}(\.{_STEP})*")
"""`unwrapped.model.opt.gravity[2]`: names by points, each with an index where it is an array."""


@dataclass(frozen=True)
class OwnParameter:
    """A parameter of the environment's own.

    Attributes:
        parameter: Its name in θ, unit, bounds and neutral value.
        argument: The constructor's argument that it is, or empty.
        attribute: The attribute of the finished environment that it is, or empty.
    """

    parameter: Parameter
    argument: str
    attribute: str


@dataclass(frozen=True)
class EpisodeMetric:
    """How an episode is scored.

    Attributes:
        name: What the metric is called.
        source: "return", "length", or "info".
        entry: Which entry of info.
        fold: One of FOLDS.
        unit: Its unit, empty where it has none.
    """

    name: str
    source: str
    entry: str
    fold: str
    unit: str


@dataclass(frozen=True)
class EnvironmentSettings:
    """A [domain] table.

    Attributes:
        environment: A registered name, "module:Name-v0", or "module:attribute" of what makes one.
        steps: Longest episode; None where the environment's own limit holds.
        rate_hz: Steps per second of the simulated world; None where the environment is asked.
        arguments: Fixed arguments of the constructor, sorted by name.
        own: The environment's own parameters, in the order of the table.
        metrics: What episodes are scored by.
        state: Which entries of the observation are x, y and heading, if any.
        effects: Values of effects that every instance has, sorted by name in θ.
        folder: Where a user's modules lie.
    """

    environment: str
    steps: int | None
    rate_hz: float | None
    arguments: tuple[tuple[str, Any], ...]
    own: tuple[OwnParameter, ...]
    metrics: tuple[EpisodeMetric, ...]
    state: tuple[int, ...] | None
    effects: tuple[tuple[str, float], ...]
    folder: Path


def read_domain(section: Section) -> EnvironmentSettings:
    """Read a [domain] table.

    Raises:
        SettingsError: With file, key and remedy.
    """
    section.only(KEYS)
    folder = section.path.resolve().parent
    effects, _ = read_effects(section.section("effects"), Catalogue(folder))
    return EnvironmentSettings(
        environment=section.text("environment"),
        steps=section.whole("steps", low=1) if "steps" in section else None,
        rate_hz=section.number("rate_hz", low=1e-3, high=1e6) if "rate_hz" in section else None,
        arguments=tuple(sorted(section.section("arguments").items())),
        own=_read_parameters(section),
        metrics=_read_metrics(section.section("metrics")),
        state=_read_state(section.section("state")) if "state" in section else None,
        effects=tuple(sorted(effects.items())),
        folder=folder,
    )


def _read_parameters(section: Section) -> tuple[OwnParameter, ...]:
    tables, fixed = section.section("parameters"), section.section("arguments")
    own = tuple(_read_parameter(tables, name) for name in tables)
    for one in own:
        if one.argument in fixed:
            name = one.parameter.name
            raise tables.error(name, f"argument '{one.argument}' is fixed in [domain.arguments]; take it out of one")
    return own


def _read_parameter(tables: Section, name: str) -> OwnParameter:
    table = tables.section(name)
    table.only(("argument", "attribute", "low", "high", "neutral", "unit"))
    if name in PARAMETERS or ":" in name:
        raise tables.error(name, "is the name of an effect's parameter; choose another")
    if ("argument" in table) == ("attribute" in table):
        raise tables.error(name, "give either argument, the constructor's, or attribute, the finished environment's")
    argument, attribute = table.text("argument", ""), table.text("attribute", "")
    if not argument and not ATTRIBUTE.fullmatch(attribute):
        raise table.error("attribute", f"'{attribute}' must be written unwrapped.m or unwrapped.model.body_mass[1]")
    low, high = table.number("low"), table.number("high")
    if low >= high:
        raise table.error("low", f"must be below high, got {low:g} and {high:g}")
    neutral = table.number("neutral", low=low, high=high)
    return OwnParameter(
        Parameter(name=name, unit=table.text("unit", ""), low=low, high=high, neutral=neutral), argument, attribute
    )


def _read_metrics(section: Section) -> tuple[EpisodeMetric, ...]:
    if not section:
        return tuple(EpisodeMetric(name, name, "", "", unit) for name, unit in OF_THE_EPISODE.items())
    return tuple(_read_metric(section, name) for name in section)


def _read_metric(section: Section, name: str) -> EpisodeMetric:
    if isinstance(section[name], str):
        source = section.text(name, choices=OF_THE_EPISODE)
        return EpisodeMetric(name, source, "", "", OF_THE_EPISODE[source])
    if not isinstance(section[name], dict):
        raise section.error(name, f'must be "return", "length" or {{ info = "…", as = "mean" }}, got {section[name]!r}')
    table = section.section(name)
    table.only(("info", "as", "unit"))
    return EpisodeMetric(name, "info", table.text("info"), table.text("as", choices=FOLDS), table.text("unit", ""))


def _read_state(section: Section) -> tuple[int, ...]:
    section.only(POSE)
    places = tuple(section.whole(name) for name in POSE)
    if len(set(places)) < len(places):
        raise SettingsError(f"{section.path}: {section.name.rstrip('.')}: names an entry of the observation twice")
    return places
