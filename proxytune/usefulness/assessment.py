"""Every measure of one proxy at once, with its uncertainty."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.scores import Array, Metric, ScoreTable
from proxytune.usefulness.chance import Chance, chance
from proxytune.usefulness.comparison import Comparison, compare
from proxytune.usefulness.correlation import (
    Correlation,
    kendall_of_means,
    kendall_tau,
    pearson_of_means,
    srcc,
)
from proxytune.usefulness.mmrv import Mmrv, mmrv, mmrv_of_means
from proxytune.usefulness.noise import NoiseFloor, noise_floor
from proxytune.usefulness.ppv import Ppv, ppv, ppv_of_means
from proxytune.usefulness.prpv import Prpv, prpv
from proxytune.usefulness.resampling import (
    PrpvInterval,
    bootstrap_means,
    bootstrap_prpv,
    in_blocks,
    interval,
    why_not_repeated,
)

Ends = tuple[float, float]
FEW_EPISODES = 5
PAIRED = "the same label counts as the same start, which leaves few resamples; treat them as unpaired if it is not"
UNDEFINED_SHARE = 0.05
"""A measure undefined in more of the resamples than this gets no interval."""


@dataclass(frozen=True)
class Intervals:
    """Percentile bootstrap intervals of the measures beside PRPV; None where one is undefined."""

    ppv: Ends | None
    srcc: Mapping[str, Ends | None]
    kendall_tau: Mapping[str, Ends | None]
    mmrv: Mapping[str, Ends | None]


@dataclass(frozen=True)
class Assessment:
    """How useful one proxy is as a predictor of the target.

    Attributes:
        inputs: What was compared, with its sample sizes.
        prpv: How many pairs of agents the proxy ranks unlike the target.
        prpv_interval: The same for resampled episodes.
        ppv: How far the proxy's scores are off.
        srcc: Pearson's correlation per metric.
        kendall_tau: Kendall's correlation per metric.
        mmrv: Mean maximum rank violation per metric.
        intervals: Their bootstrap intervals; None where episodes are not repeated.
        noise_floor: PRPV of the target against itself.
        chance: PRPV of a proxy that knows nothing.
    """

    inputs: Comparison
    prpv: Prpv
    prpv_interval: PrpvInterval
    ppv: Ppv
    srcc: Correlation
    kendall_tau: Correlation
    mmrv: Mmrv
    intervals: Intervals | None
    noise_floor: NoiseFloor
    chance: Chance

    @property
    def at_noise_floor(self) -> bool | None:
        """Whether PRPV is within the target's noise, so that no better proxy could be told from this one."""
        return None if self.noise_floor.high is None else self.prpv.value <= self.noise_floor.high

    @property
    def notes(self) -> tuple[str, ...]:
        """What is undefined or to be taken with care, in one line each."""
        lines = [*self.ppv.notes, *self.srcc.notes, *self.kendall_tau.notes]
        if self.prpv_interval.reason:
            lines.append(f"no interval: {self.prpv_interval.reason}")
        if self.noise_floor.reason:
            lines.append(f"no noise floor: {self.noise_floor.reason}")
        return (*lines, *_caution(self))


def assess(
    *,
    proxy: ScoreTable,
    target: ScoreTable,
    metrics: Sequence[Metric],
    beta: Mapping[str, float] | None = None,
    resamples: int = 1000,
    seed: int = 0,
) -> Assessment:
    """Measure a proxy in every way that score tables allow.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
        InputError: If a weight of PPV is missing, unknown, negative or not finite.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    one, other = inputs.proxy, inputs.target
    error = ppv(proxy=one, target=other, metrics=metrics, beta=beta)
    return Assessment(
        inputs=inputs,
        prpv=prpv(proxy=one, target=other, metrics=metrics),
        prpv_interval=bootstrap_prpv(proxy=one, target=other, metrics=metrics, resamples=resamples, seed=seed),
        ppv=error,
        srcc=srcc(proxy=one, target=other, metrics=metrics),
        kendall_tau=kendall_tau(proxy=one, target=other, metrics=metrics),
        mmrv=mmrv(proxy=one, target=other, metrics=metrics),
        intervals=None if why_not_repeated(inputs) else _intervals(inputs, error, resamples, seed),
        noise_floor=noise_floor(target=other, metrics=metrics, seed=seed),
        chance=chance(proxy=one, target=other, metrics=metrics, permutations=resamples, seed=seed),
    )


def _intervals(inputs: Comparison, error: Ppv, resamples: int, seed: int) -> Intervals:
    means = bootstrap_means(inputs, resamples=resamples, seed=seed)
    weights = np.array([error.beta[metric.name] or 0.0 for metric in inputs.metrics])
    return Intervals(
        ppv=None if error.value is None else interval(ppv_of_means(*means, weights)),
        srcc=_per_metric(inputs.metrics, pearson_of_means(*means)),
        kendall_tau=_per_metric(inputs.metrics, in_blocks(kendall_of_means, *means)),
        mmrv=_per_metric(inputs.metrics, in_blocks(lambda p, t: mmrv_of_means(p, t, inputs.metrics), *means)),
    )


def _per_metric(metrics: Sequence[Metric], values: Array) -> dict[str, Ends | None]:
    """Intervals of values of shape (resamples, metrics)."""
    undefined = np.isnan(values).mean(axis=0)
    return {
        metric.name: interval(column[~np.isnan(column)]) if share <= UNDEFINED_SHARE else None
        for metric, column, share in zip(metrics, values.T, undefined, strict=True)
    }


def _caution(assessment: Assessment) -> list[str]:
    fewest = min(assessment.inputs.proxy_episodes[0], assessment.inputs.target_episodes[0])
    lines = []
    if assessment.intervals is not None and fewest < FEW_EPISODES:
        pairing = f", the more so as {PAIRED}" if assessment.inputs.paired else ""
        lines.append(f"{fewest} episodes per agent are few: intervals come out too narrow{pairing}")
    if assessment.at_noise_floor:
        lines.append("PRPV is within the target's own noise: this proxy cannot be told from a perfect one")
    return lines
