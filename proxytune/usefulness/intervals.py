"""Bootstrap intervals of the measures beside PRPV."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.scores import Array, Metric
from proxytune.usefulness.comparison import Comparison
from proxytune.usefulness.correlation import kendall_of_means, pearson_of_means
from proxytune.usefulness.mmrv import mmrv_of_means
from proxytune.usefulness.ppv import Ppv, ppv_of_means
from proxytune.usefulness.resampling import Means, in_blocks, interval

Ends = tuple[float, float]
UNDEFINED_SHARE = 0.05
"""A measure undefined in more of the resamples than this gets no interval."""


@dataclass(frozen=True)
class Intervals:
    """Percentile bootstrap intervals of the measures beside PRPV; None where one is undefined."""

    ppv: Ends | None
    srcc: Mapping[str, Ends | None]
    kendall_tau: Mapping[str, Ends | None]
    mmrv: Mapping[str, Ends | None]


def intervals(*, inputs: Comparison, error: Ppv, means: Means | None) -> Intervals | None:
    """The interval of every measure at once; None where episodes are not repeated.

    Args:
        inputs: What is compared.
        error: PPV, with the weights that it has.
        means: Mean scores of resampled episodes, None where there are none.
    """
    if means is None:
        return None
    weights = np.array([error.beta[metric.name] or 0.0 for metric in inputs.metrics])
    each = inputs.target.means.size
    return Intervals(
        ppv=None
        if error.value is None
        else interval(in_blocks(lambda p, t: ppv_of_means(p, t, weights), *means, numbers=each)),
        srcc=_per_metric(inputs.metrics, in_blocks(pearson_of_means, *means, numbers=each)),
        kendall_tau=_per_metric(inputs.metrics, in_blocks(kendall_of_means, *means)),
        mmrv=_per_metric(inputs.metrics, in_blocks(lambda p, t: mmrv_of_means(p, t, inputs.metrics), *means)),
    )


def _per_metric(metrics: Sequence[Metric], values: Array) -> dict[str, Ends | None]:
    """Intervals of values of shape (resamples, metrics)."""
    return {metric.name: interval_where_defined(column) for metric, column in zip(metrics, values.T, strict=True)}


def interval_where_defined(values: Array) -> Ends | None:
    """The interval of values of resamples, the undefined ones left out; None if these are too many."""
    undefined = np.isnan(values)
    return interval(values[~undefined]) if undefined.mean() <= UNDEFINED_SHARE else None
