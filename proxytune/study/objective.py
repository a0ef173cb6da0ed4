"""What a study makes small or large: a measure of how far proxy and target agree on the agents."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from proxytune.errors import ExtensionError, InputError, ProxytuneError
from proxytune.extensions import describe, load, plugins
from proxytune.scores import Array, Metric, ScoreTable
from proxytune.settings import nearest
from proxytune.study.settings import LEARNING, StudySettings
from proxytune.usefulness import MEASURES, Measure, ppv, prpv
from proxytune.usefulness.prpv import prpv_of_means

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

    def cost(self, value: float | None) -> float | None:
        """The measure as something to be made small."""
        return value if value is None or not self.maximise else -value

    def value(self, cost: float) -> float:
        """The measure that has this cost."""
        return -cost if self.maximise else cost

    def measure(self, *, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> dict[str, float | None]:
        """PRPV, PPV and this measure of a proxy, by name; None where one is undefined.

        Raises:
            ScoresError: If an agent is missing on one side, or a metric is unknown.
        """
        ranking = prpv(proxy=proxy, target=target, metrics=metrics)
        predicting = ppv(proxy=proxy, target=target, metrics=metrics)
        own = float(self.of_means(*ranking.inputs.means, metrics))
        return {
            self.name: own if math.isfinite(own) else None,
            "prpv": float(ranking.value),
            "ppv": predicting.value,
        }


TRIED = (4, 3, 2)
"""Tables, agents and metrics that a user's own measure is tried on."""

PRPV = Objective("prpv", "PRPV", False, prpv_of_means)


def objective_of(settings: StudySettings) -> Objective:
    """The measure that the trials of a study are scored by; a study of learning value is narrowed by PRPV.

    Raises:
        SettingsError: If there is no such measure, or it is no single number of mean scores.
    """
    name = settings.objective
    if name in (PRPV.name, LEARNING):
        return PRPV
    shipped = {measure.key: measure for measure in MEASURES if measure.on_means and not measure.per_metric}
    try:
        if ":" not in name and name not in shipped and name not in plugins("measure", shipped):
            known = (*shipped, LEARNING)
            raise InputError(f"unknown measure '{name}' (your own is written module:attribute); {nearest(name, known)}")
        return _as_objective(name, shipped[name] if name in shipped else measure_of(name, settings.folder))
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
        try:
            values = np.asarray(self.on_means(proxy, target, metrics), dtype=float)
        except ProxytuneError:
            raise
        except Exception as problem:
            told = f"measure '{self.name}' raised {describe(problem)}"
            raise ExtensionError(f"{told} for means {proxy.shape} against {target.shape}; correct it") from problem
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
