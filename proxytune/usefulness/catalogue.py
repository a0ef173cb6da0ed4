"""The measures of usefulness, each with all that is to be known of it."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from proxytune.scores import Array, Metric
from proxytune.usefulness.assessment import Assessment
from proxytune.usefulness.measure import ALL, Measure, Measured
from proxytune.usefulness.ppv import ppv_of_means, weights_of_spread
from proxytune.usefulness.prpv import prpv_of_means


def _prpv(assessment: Assessment) -> Mapping[str, Measured]:
    inner = assessment.prpv_interval
    ends = None if inner.low is None or inner.high is None else (inner.low, inner.high)
    return {ALL: Measured(assessment.prpv.value, ends)}


def _ppv(assessment: Assessment) -> Mapping[str, Measured]:
    return {ALL: Measured(assessment.ppv.value, assessment.intervals.ppv if assessment.intervals else None)}


def _ppv_of_means(proxy: Array, target: Array, metrics: Sequence[Metric]) -> Array:
    weights = weights_of_spread(target)
    return np.where((weights > 0.0).any(axis=-1), ppv_of_means(proxy, target, weights), np.nan)


def _held_as(name: str) -> Callable[[Assessment], Mapping[str, Measured]]:
    """Read a measure per metric from the attribute of this name, and its intervals from theirs."""

    def read(assessment: Assessment) -> Mapping[str, Measured]:
        values = getattr(assessment, name).value
        ends = getattr(assessment.intervals, name) if assessment.intervals else {}
        return {metric: Measured(value, ends.get(metric)) for metric, value in values.items()}

    return read


PRPV = Measure(
    key="prpv",
    name="PRPV",
    title="proxy relative predictivity value",
    better="lower",
    meaning="0 (same order)",
    digits=".0f",
    unit="ordered pairs",
    in_paper=True,
    on_means=prpv_of_means,
    read=_prpv,
)
PPV = Measure(
    key="ppv",
    name="PPV",
    title="proxy predictivity value",
    better="lower",
    meaning="weighted error of an agent's scores, from 0",
    digits=".3g",
    in_paper=True,
    on_means=_ppv_of_means,
    read=_ppv,
)
SRCC = Measure(
    key="srcc",
    name="SRCC",
    title="sim-to-real correlation coefficient",
    better="higher",
    meaning="Pearson, −1 to 1",
    digits=".2f",
    per_metric=True,
    in_paper=True,
    read=_held_as("srcc"),
)
KENDALL_TAU = Measure(
    key="kendall_tau",
    name="Kendall τ",
    title="Kendall's rank correlation, τ-b",
    better="higher",
    meaning="−1 to 1",
    digits=".2f",
    per_metric=True,
    read=_held_as("kendall_tau"),
)
MMRV = Measure(
    key="mmrv",
    name="MMRV",
    title="mean maximum rank violation",
    better="lower",
    meaning="in the metric's unit, from 0",
    digits=".3g",
    per_metric=True,
    read=_held_as("mmrv"),
)
POD_POSE = Measure(
    key="pod_pose",
    name="POD pose",
    title="proxy observation discrepancy of poses",
    better="lower",
    meaning="mean distance under the same commands, from 0",
    digits=".3g",
    unit="m",
    in_paper=True,
)
POD_IMAGE = Measure(
    key="pod_image",
    name="POD image",
    title="proxy observation discrepancy of images",
    better="lower",
    meaning="mean difference under the same commands, 0 to 1",
    digits=".3g",
    unit="of full scale",
    in_paper=True,
)

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
