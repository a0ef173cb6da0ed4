"""The measures of usefulness, each with all that is to be known of it: nothing that reports one knows it from another.

A Measure has its names, direction, unit and format, and either a function of mean scores (`on_means`), from which its
interval follows by the bootstrap, or a reader of an Assessment that holds both (`read`). MEASURES are all those of
score tables.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from proxytune.arrays import Floats
from proxytune.errors import InputError
from proxytune.scores import Metric
from proxytune.usefulness.assessment import Assessment
from proxytune.usefulness.comparison import fewest_starts
from proxytune.usefulness.pairs import prpv_of_means
from proxytune.usefulness.predictivity import ppv_of_means, weights_of_spread
from proxytune.usefulness.resampling import Ends, bootstrap_means, in_blocks, interval_around

ALL = ""
"""Stands in for the metric's name where a measure has one value for all metrics."""


class Measured(NamedTuple):
    """A measure's value and its 95 % interval; None where it is undefined or has no interval."""

    value: float | None
    interval: Ends | None


OnMeans = Callable[[Floats, Floats, Sequence[Metric]], Floats]
"""Of mean scores in the proxy and on the target, both (…, agents, metrics): values (…), or (…, metrics) of a measure
per metric; NaN where it is undefined."""


@dataclass(frozen=True)
class Measure:
    """A measure of usefulness with all that is to be known of it.

    It needs one of `read` and `on_means`, unless it is not measured on score tables, as POD is not.

    Attributes:
        key: Its name in files; of a measure per metric, followed by the metric's.
        name: Its name for people.
        title: That name spelt out.
        better: Which direction is better.
        meaning: Its range and unit in a few words.
        digits: How a value is formatted where there is little room.
        unit: Its unit; empty if it has none, or that of its metric.
        per_metric: Whether each metric has a value of its own.
        in_paper: Whether the paper has it: those come first where there is little room.
        on_means: The measure of mean scores alone; None if it takes more than these.
        read: Where an assessment holds it, by metric; None if `on_means` is all there is to it.
    """

    key: str
    name: str
    title: str
    better: Literal["lower", "higher"]
    meaning: str
    digits: str
    unit: str = ""
    per_metric: bool = False
    in_paper: bool = False
    on_means: OnMeans | None = None
    read: Callable[[Assessment], Mapping[str, Measured]] | None = None

    @property
    def lower_is_better(self) -> bool:
        """True if a search would make it small."""
        return self.better == "lower"

    def key_for(self, metric: str) -> str:
        """The name in files for a metric, or for ALL."""
        return "_".join(filter(None, (self.key, metric)))

    def name_for(self, metric: str) -> str:
        """The name for people for a metric, or for ALL."""
        return " ".join(filter(None, (self.name, metric)))

    def measured(self, assessment: Assessment) -> Mapping[str, Measured]:
        """Value and interval by metric; by ALL if there is one for all metrics."""
        if self.read is not None:
            return self.read(assessment)
        if self.on_means is None:
            raise InputError(f"{self.name} is not measured on score tables")
        inputs, on_means = assessment.inputs, self.on_means

        def by_metric(proxy: Floats, target: Floats) -> Floats:
            """Values (…, metrics or 1) of means (…, agents, metrics)."""
            values = on_means(proxy, target, inputs.metrics)
            return values if self.per_metric else values[..., None]

        names = [metric.name for metric in inputs.metrics] if self.per_metric else [ALL]
        found, ends = by_metric(*inputs.means), list[Ends | None]([None] * len(names))
        if assessment.intervals is not None:
            means = bootstrap_means(inputs, resamples=assessment.prpv_interval.resamples, seed=assessment.seed)
            resampled = in_blocks(by_metric, *means).T
            starts, (_, on_target), sign = fewest_starts(inputs), inputs.means, 1 if self.lower_is_better else -1
            # None is better than a proxy that scores as the target does.
            scales = [sorted((float(best), sign * np.inf)) for best in by_metric(on_target, on_target)]
            rows = zip(found, resampled, scales, strict=True)
            ends = [interval_around(float(value), one, starts, (low, high)) for value, one, (low, high) in rows]
        values = [None if np.isnan(value) else float(value) for value in found]
        return dict(zip(names, map(Measured, values, ends), strict=True))

    def of_means(self, *, proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> float:
        """Measure mean scores (agents, metrics) alone, as an objective of a search does; NaN where that is undefined.

        Raises:
            InputError: If the measure has no single value of mean scores.
        """
        if self.per_metric or self.on_means is None:
            raise InputError(f"{self.name} is no single number of mean scores; take a measure that is, as PRPV")
        return float(self.on_means(proxy, target, metrics))


def _prpv(assessment: Assessment) -> Mapping[str, Measured]:
    inner = assessment.prpv_interval
    ends = None if inner.low is None or inner.high is None else (inner.low, inner.high)
    return {ALL: Measured(assessment.prpv.value, ends)}


def _ppv_of_means(proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> Floats:
    weights = weights_of_spread(target)
    return np.where((weights > 0.0).any(axis=-1), ppv_of_means(proxy, target, weights), np.nan)


def _held_as(name: str) -> Callable[[Assessment], Mapping[str, Measured]]:
    """Read a measure from the attribute of this name, and its intervals from theirs: by metric, or one for ALL."""

    def read(assessment: Assessment) -> Mapping[str, Measured]:
        values, ends = getattr(assessment, name).value, getattr(assessment.intervals, name, None)
        if not isinstance(values, Mapping):
            return {ALL: Measured(values, ends)}
        return {metric: Measured(value, ends and ends.get(metric)) for metric, value in values.items()}

    return read


PRPV = Measure(
    "prpv", "PRPV", "proxy relative predictivity value", "lower", "0 (same order)", ".0f", "ordered pairs",
    in_paper=True, on_means=prpv_of_means, read=_prpv,
)  # fmt: skip
PPV = Measure(
    "ppv", "PPV", "proxy predictivity value", "lower", "weighted error of an agent's scores, from 0", ".3g",
    in_paper=True, on_means=_ppv_of_means, read=_held_as("ppv"),
)  # fmt: skip
SRCC = Measure(
    "srcc", "SRCC", "sim-to-real correlation coefficient", "higher", "Pearson, −1 to 1", ".2f",
    per_metric=True, in_paper=True, read=_held_as("srcc"),
)  # fmt: skip
KENDALL_TAU = Measure(
    "kendall_tau", "Kendall τ", "Kendall's rank correlation, τ-b", "higher", "−1 to 1", ".2f",
    per_metric=True, read=_held_as("kendall_tau"),
)  # fmt: skip
MMRV = Measure(
    "mmrv", "MMRV", "mean maximum rank violation", "lower", "in the metric's unit, from 0", ".3g",
    per_metric=True, read=_held_as("mmrv"),
)  # fmt: skip
POD_POSE = Measure(
    "pod_pose", "POD pose", "proxy observation discrepancy of poses", "lower",
    "mean distance under the same commands, from 0", ".3g", "m", in_paper=True,
)  # fmt: skip
POD_IMAGE = Measure(
    "pod_image", "POD image", "proxy observation discrepancy of images", "lower",
    "mean difference under the same commands, 0 to 1", ".3g", "of full scale", in_paper=True,
)  # fmt: skip

MEASURES: tuple[Measure, ...] = (
    PRPV,
    PPV,
    SRCC,
    KENDALL_TAU,
    MMRV,
)
"""Those of score tables, in the order in which they are reported; a new one is a module of its own and a line here."""
PODS = (POD_POSE, POD_IMAGE)
"""Those of the same commands in both domains, which a sweep replays."""
