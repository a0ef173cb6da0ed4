"""A domain instance as model.toml: robot, plant and effects with their values; and a stage's effects as one chain."""

import math
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.effects.catalogue import DRIVES, SHIPPED, Catalogue, effect_of, parameter_hint
from proxytune.effects.effect import Effect, FilterContext, Memory, Signal, Stage
from proxytune.effects.learnt import Learnt, is_learnt, learnt_text, read_learnt
from proxytune.errors import ExtensionError
from proxytune.settings import GEOMETRY, Section, nearest, read_settings
from proxytune.space import Parameter


@dataclass(frozen=True)
class Model:
    """Content of a model.toml."""

    robot: str  # name of the robot
    plant: str | None  # name of the plant, or None where the reader chooses
    theta: Mapping[str, float]  # values of the effects' parameters by their names in θ
    intervals: Mapping[str, tuple[float, float]]  # the interval of each value that has one
    # figures of a robot without a folder: wheel_radius, effective_baseline [m], full_speed [m/s]
    geometry: Mapping[str, float] = field(default_factory=dict)

    @property
    def cautions(self) -> tuple[str, ...]:
        """Sentences on what is probably not meant: an interval without the value that it is of."""
        return tuple(
            f"model of {self.robot}: the interval of {name}, {low:g} to {high:g}, does not hold its value {value:g}; "
            "correct the one that is wrong"
            for name, (low, high) in self.intervals.items()
            if (value := self.theta.get(name)) is not None and not low <= value <= high
        )


def read_model(path: Path, catalogue: Catalogue = SHIPPED) -> Model:
    """Read a model.toml, which may name effects of a catalogue; a SettingsError tells file, key and remedy."""
    settings = read_settings(path)
    settings.only(("format", "robot", "plant", "geometry", "effects"))
    settings.whole("format", 1, low=1, high=1)
    plant = settings.text("plant") if "plant" in settings.values else None
    theta, intervals = read_effects(settings.section("effects"), catalogue)
    stated = settings.section("geometry")
    stated.only(GEOMETRY)
    geometry = {figure: stated.number(key, low=0.0) for key, figure in GEOMETRY.items() if key in stated.values}
    return Model(settings.text("robot"), plant, theta, intervals, geometry)


def model_text(model: Model, comments: Iterable[str] = (), catalogue: Catalogue = SHIPPED) -> str:
    """A model.toml that reads back as this model."""
    lines = [f"# {comment}" for comment in comments]
    lines += ["format = 1", f'robot = "{model.robot}"']
    lines += [f'plant = "{model.plant}"'] if model.plant else []
    keys = {figure: key for key, figure in GEOMETRY.items()}
    lines += ["\n[geometry]"] if model.geometry else []
    lines += [f"{keys[figure]} = {value!r}" for figure, value in model.geometry.items()]
    return "\n".join(lines) + "\n" + effects_table(model.theta, model.intervals, catalogue)


def read_effects(
    section: Section, catalogue: Catalogue = SHIPPED
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Values and intervals from `[effects.NAME]` tables: a parameter is a number, or a table with `value`.

    A user's own effect is a quoted key, `[effects."yaw_drift:YawDrift"]`. A SettingsError tells file, key and remedy.
    """
    theta: dict[str, float] = {}
    intervals: dict[str, tuple[float, float]] = {}
    for effect in section.values:
        if effect == Learnt.name:
            theta |= read_learnt(section.section(effect))
            continue
        known = _parameters(section, effect, catalogue)
        table = section.section(effect)
        table.only([parameter.name for parameter in known.values()])
        for name, parameter in known.items():
            key, low, high = parameter.name, parameter.low, parameter.high
            if not isinstance(table.get(key), dict):
                theta |= {name: table.number(key, low=low, high=high)} if key in table else {}
                continue
            detail = table.section(key)
            detail.only(("value", "interval", "unit", "source"))
            theta[name] = detail.number("value", low=low, high=high)
            if "interval" in detail:
                intervals[name] = detail.bounds("interval")
            if (unit := detail.text("unit", parameter.unit)) != parameter.unit:
                raise detail.error("unit", f"must be '{parameter.unit}', got '{unit}'")
    return theta, intervals


def _parameters(section: Section, effect: str, catalogue: Catalogue) -> dict[str, Parameter]:
    """The parameters of an effect by their names in θ."""
    if not catalogue.knows(effect):
        hint = nearest(effect, (*catalogue.names, Learnt.name))
        if any(effect in effects for effects in DRIVES.values()):
            hint = parameter_hint(effect, catalogue.parameters)
        raise section.error(effect, f"no such effect; {hint} (your own is written module:Attribute)")
    try:
        return dict(zip(catalogue.theta_names(effect), catalogue.effect(effect).parameters, strict=True))
    except ExtensionError as problem:
        raise section.error(effect, str(problem)) from None


def effects_table(
    theta: Mapping[str, float], intervals: Mapping[str, tuple[float, float]], catalogue: Catalogue = SHIPPED
) -> str:
    """The `[effects.NAME]` tables that read back as these values and intervals."""
    lines: list[str] = []
    outside = {effect_of(name) for name in theta if not is_learnt(name)} - catalogue.shipped.keys()
    for effect in (*catalogue.shipped, *sorted(outside)):
        pairs = list(zip(catalogue.theta_names(effect), catalogue.effect(effect).parameters, strict=True))
        named = [(name, parameter) for name, parameter in pairs if name in theta]
        # A key of TOML is in quotes where it needs them
        key = effect if effect.replace("-", "_").isidentifier() and effect.isascii() else f'"{effect}"'
        lines += [f"\n[effects.{key}]"] if named else []
        for name, parameter in named:
            interval = intervals.get(name)
            finite = interval is not None and interval[0] < interval[1] and all(map(math.isfinite, interval))
            bounds = f", interval = [{interval[0]!r}, {interval[1]!r}]" if interval and finite else ""
            lines.append(f'{parameter.name} = {{ value = {theta[name]!r}{bounds}, unit = "{parameter.unit}" }}')
    return "\n".join(lines) + "\n" + learnt_text(theta)


@dataclass(frozen=True)
class Chain:
    """The effects of one stage, applied in order; itself a causal filter."""

    effects: tuple[Effect, ...]

    def begin(self, context: FilterContext) -> tuple[Memory, ...]:
        """Every effect's memory, each with a seed of its own."""
        return tuple(effect.begin(own) for effect, own in self._with_seeds(context))

    def _with_seeds(self, context: FilterContext) -> list[tuple[Any, FilterContext]]:
        return [
            (effect, replace(context, seed=zlib.crc32(effect.name.encode(), context.seed))) for effect in self.effects
        ]

    def begin_amid(
        self, context: FilterContext, whole: FilterContext, signal: Signal, row: Signal, sample: Signal
    ) -> Memory:
        """The memories of windows (W, …) that begin at a sample (W,) of a row (W,) of longer signals.

        What came before, in those signals (rows, time, channels) of the context `whole`, counts: an effect recalls it,
        or begins at rest with what it made of the sample before.
        """
        memories = []
        for (effect, ahead), (_, driven) in zip(self._with_seeds(context), self._with_seeds(whole), strict=True):
            made, _ = effect.apply(signal, effect.begin(driven))
            if hasattr(effect, "recall"):
                memories.append(effect.recall(ahead, driven, signal, row, sample))
            else:
                before = np.where((sample > 0)[:, None], made[row, sample - 1], driven.rest[row])
                memories.append(effect.begin(replace(ahead, rest=before)))
            signal = made
        return tuple(memories)

    def apply(self, signal: Signal, memories: tuple[Memory, ...]) -> tuple[Signal, tuple[Memory, ...]]:
        """Filter the next chunk through every effect."""
        after = []
        for effect, memory in zip(self.effects, memories, strict=True):
            signal, kept = effect.apply(signal, memory)
            after.append(kept)
        return signal, tuple(after)

    def parted(self) -> tuple["Chain", "Chain"]:
        """The effects that mix samples with those before, and the last ones, which can `skip` samples."""
        first = len(self.effects)
        while first and hasattr(self.effects[first - 1], "skip"):
            first -= 1
        return Chain(self.effects[:first]), Chain(self.effects[first:])

    def skip(self, memories: tuple[Memory, ...], samples: int) -> tuple[Memory, ...]:
        """The memories after samples that nobody looks at; all effects have to do each sample by itself."""
        kept: Any = zip(self.effects, memories, strict=True)
        return tuple(effect.skip(memory, samples) for effect, memory in kept)

    def mean_weights(self, rate_hz: float) -> Signal | None:
        """The weights of the last samples, the newest last, if all that the effects make is a mean of these.

        Another mean than `apply`'s may be rounded otherwise, unless samples are whole numbers of 8 bits.
        """
        if not self.effects:
            return np.ones(1, dtype=np.float32)
        own: Callable[[float], Signal] | None = getattr(self.effects[0], "mean_weights", None)
        return own(rate_hz) if own and len(self.effects) == 1 else None


def stage_chain(effects: Iterable[Effect], stage: Stage) -> Chain:
    """The effects of one stage, in the order given."""
    return Chain(tuple(effect for effect in effects if effect.stage is stage))
