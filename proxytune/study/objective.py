"""What a study makes small or large: a measure of how far proxy and target agree on the agents."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from proxytune.errors import ExtensionError, InputError
from proxytune.extensions import ask, load, plugins
from proxytune.scores import Array, Metric, ScoreTable
from proxytune.settings import nearest
from proxytune.study.settings import LEARNING, StudySettings
from proxytune.usefulness import MEASURES, Measure, compare

OfMeans = Callable[[Array, Array, Sequence[Metric]], Array]
"""A measure of mean scores in the proxy (…, agents, metrics) and on the target (agents, metrics): shape (…)."""


@dataclass(frozen=True)
class Objective:
    """A measure as the objective of a study.

    Attributes:
        name: What study.toml calls it.
        label: What people call it.
        maximise: Whether more of it is better.
        of_means: The measure.
    """

    name: str
    label: str
    maximise: bool
    of_means: OfMeans

    @property
    def sign(self) -> float:
        """What turns the measure into something to be made small, and back."""
        return -1.0 if self.maximise else 1.0

    def measure(self, *, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> dict[str, float | None]:
        """PRPV, PPV and this measure of a proxy, by name; None where one is undefined.

        Raises:
            ScoresError: If an agent is missing on one side, or a metric is unknown.
        """
        means = compare(proxy=proxy, target=target, metrics=metrics).means
        kept = {self.name: self.of_means, **{name: one.of_means for name, one in KEPT.items()}}
        values = {name: float(of_means(*means, metrics)) for name, of_means in kept.items()}
        return {name: value if math.isfinite(value) else None for name, value in values.items()}


TRIED = (4, 3, 2)
"""Tables, agents and metrics that a user's own measure is tried on."""


def objective_of(settings: StudySettings) -> Objective:
    """The measure that the trials of a study are scored by; a study of learning value is narrowed by PRPV.

    Raises:
        SettingsError: If there is no such measure, or it is no single number of mean scores.
    """
    name = settings.objective
    if name == LEARNING:
        return PRPV
    if name in KEPT:
        return KEPT[name]
    try:
        if ":" not in name and name not in plugins("measure", KEPT):
            known = (*KEPT, LEARNING)
            raise InputError(f"unknown measure '{name}' (your own is written module:attribute); {nearest(name, known)}")
        return _as_objective(name, measure_of(name, settings.folder))
    except InputError as problem:
        raise settings.error("objective", str(problem)) from None


def measure_of(name: str, beside: Path | None = None) -> Measure:
    """The measure that is not shipped: `module:attribute`, or the name of a plug-in.

    Args:
        name: Of the measure.
        beside: The folder whose modules come before the installed ones.

    Raises:
        ExtensionError: If there is none.
    """
    measure = load(name, kind="measure", beside=beside)
    if not isinstance(measure, Measure):
        raise ExtensionError(f"measure '{name}' is a {type(measure).__name__}; make it a proxytune.Measure")
    return measure


def _as_objective(name: str, measure: Measure) -> Objective:
    if measure.on_means is None or measure.per_metric:
        raise ExtensionError(
            f"measure '{name}' is no single number of mean scores: it needs on_means, without per_metric"
        )
    of_means = measure.on_means if measure in MEASURES else _outside(name, measure.on_means)
    return Objective(name, measure.name, not measure.lower_is_better, of_means)


@dataclass(frozen=True)
class _Outside:
    """A measure of mean scores that is not ours: what it does wrong is told in one line."""

    name: str
    on_means: OfMeans

    def __call__(self, proxy: Array, target: Array, metrics: Sequence[Metric]) -> Array:
        where = f" for means {proxy.shape} against {target.shape}"
        values = ask(
            f"measure '{self.name}'", lambda: np.asarray(self.on_means(proxy, target, metrics), dtype=float), where
        )
        if values.shape != proxy.shape[:-2]:
            told = f"measure '{self.name}' gives values {values.shape} of means {proxy.shape}"
            raise ExtensionError(f"{told}; give one for each table, {proxy.shape[:-2]}")
        return values


def _outside(name: str, on_means: OfMeans) -> OfMeans:
    """The measure, tried as a search calls it: several proxies against one target, before any episode is run."""
    checked = _Outside(name, on_means)
    means = np.random.default_rng(0).uniform(1.0, 2.0, TRIED)
    checked(means, means[0], [Metric("one"), Metric("other", "min")])
    return checked


KEPT = {one.key: _as_objective(one.key, one) for one in MEASURES if one.on_means is not None and not one.per_metric}
"""PRPV and PPV: what may be an objective by name, and is kept with every trial."""
PRPV = KEPT["prpv"]
