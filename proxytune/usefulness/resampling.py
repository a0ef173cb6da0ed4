"""Bootstrap over episodes: what the measures would be, had the same agents driven other episodes.

Starts are drawn with replacement, each with all its repeats. Where all agents drove the same episodes they share the
draws; where both domains have the same starts, so do these. A draw has the episodes' own noise and that of drawing: it
breaks more orders than other episodes would, above all of many agents. So the interval lies about the value, which is
unbiased:

    value + √(n/(n − 1)) (central 95 % of the draws − their mean),    n the fewest starts

√(n/(n − 1)) is what a bootstrap of n starts lacks. The interval ends where the scale does, and holds the value.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.arrays import Flags, Floats, Whole
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, fewest_starts, start_of, start_places
from proxytune.usefulness.pairs import prpv_of_means
from proxytune.usefulness.predictivity import Ppv, kendall_of_means, mmrv_of_means, pearson_of_means, ppv_of_means

CONFIDENCE = 0.95
BLOCK = 4_000_000
"""Most numbers held at once by a measure over many resamples."""
Means = tuple[Floats, Floats]
"""Mean scores of resampled episodes, in the proxy and on the target, each of shape (resamples, agents, metrics)."""


@dataclass(frozen=True)
class PrpvInterval:
    """A bootstrap interval of the expected PRPV.

    What it covers is the mean PRPV of many repeats of the whole experiment with as many episodes as this one had.
    Noise flips pairs, so this lies above the PRPV of endlessly many episodes; compare it with the noise floor.
    """

    value: int  # PRPV of the episodes as they are
    low: float | None  # lower end, at most the value; None if there is no interval
    high: float | None  # upper end, at least the value; None if there is no interval
    resamples: int  # how many were drawn
    reason: str = ""  # why there is no interval, empty if there is one

    @property
    def expected(self) -> float | None:
        """The mean PRPV that the interval covers: the value is its unbiased estimate; None if there is no interval."""
        return None if self.low is None else float(self.value)


def why_not_repeated(inputs: Comparison) -> str:
    """The reason for which these tables bear no bootstrap, empty if they do."""
    return too_few(inputs.proxy, "in the proxy") or too_few(inputs.target, "on the target")


def too_few(table: ScoreTable, name: str) -> str:
    """The reason for which a table shows no noise, empty if every agent has at least two episodes."""
    single = [agent for agent, count in zip(table.agents, table.counts, strict=True) if count < 2]
    if not single:
        return ""
    who = "each agent" if len(single) == len(table.agents) else f"agent '{single[0]}'"
    return (
        f"{who} has one episode {name}, or a mean of an unknown number, which says nothing about noise; "
        "score at least two, or state the number (of a success rate: a column n)"
    )


def bootstrap_means(inputs: Comparison, *, resamples: int, seed: int) -> Means:
    """Mean scores of resampled episodes, in the proxy and on the target: (resamples, agents, metrics) each."""
    rng = np.random.default_rng(seed)
    if inputs.paired:
        counts = draw_counts(inputs.target, rng, resamples)
        labels = inputs.target.episodes
        columns = {start_of(label): column for column, label in enumerate(labels)}
        columns |= {label: column for column, label in enumerate(labels)}
        # The proxy's episodes are drawn with the target's of the same label or, of other repeats, of the same start.
        alike = counts[..., [columns.get(label, columns[start_of(label)]) for label in inputs.proxy.episodes]]
        return counted_means(inputs.proxy.values, alike), counted_means(inputs.target.values, counts)
    on_target = _means_of_draws(inputs.target, rng, resamples)
    return _means_of_draws(inputs.proxy, rng, resamples), on_target


def _means_of_draws(table: ScoreTable, rng: np.random.Generator, resamples: int) -> Floats:
    if table.complete:
        return counted_means(table.values, draw_counts(table, rng, resamples))
    blocks = agent_blocks(table, resamples)
    means = [counted_means(table.values[rows], _draw_own(driven, rng, resamples)) for rows, driven in blocks]
    return np.concatenate(means, axis=1)


def agent_blocks(table: ScoreTable, draws: int) -> Iterator[tuple[slice, Flags]]:
    """Agents drawn together, and what they drove: all, by one row, if that is alike, else as many as memory takes."""
    if table.complete:
        yield slice(None), table.driven[:1]
        return
    size = max(1, BLOCK // (draws * len(table.episodes)))
    for start in range(0, len(table.agents), size):
        yield slice(start, start + size), table.driven[start : start + size]


def draw_counts(table: ScoreTable, rng: np.random.Generator, resamples: int) -> Whole:
    """Count how often each episode is drawn: shape (agents, or 1 if all share the draw; resamples, episodes).

    Starts are drawn, and with a start all its repeats: these are no new starts. Of one start alone, repeats are drawn.
    """
    if table.complete:
        places = start_places(table)
        places = places if places.any() else np.arange(len(places))
        starts = int(places.max()) + 1
        return rng.multinomial(starts, np.full(starts, 1 / starts), size=(1, resamples))[..., places]
    return _draw_own(table.driven, rng, resamples)


def _draw_own(driven: Flags, rng: np.random.Generator, resamples: int) -> Whole:
    """Count how often each agent's each episode is drawn of its own, shape (agents, resamples, episodes)."""
    episodes, counts = driven.shape[1], []
    for own in driven:
        # One by one and counted, since a multinomial draws a binomial for every episode, which takes ten times as long
        places = np.flatnonzero(own)
        drawn = places[rng.integers(len(places), size=(resamples, len(places)), dtype=np.uint32)]
        drawn += episodes * np.arange(resamples)[:, None]
        counts.append(np.bincount(drawn.ravel(), minlength=resamples * episodes).reshape(resamples, episodes))
    return np.stack(counts)


def counted_means(values: Floats, counts: Whole | Flags) -> Floats:
    """Mean scores (agents, episodes, metrics) when episodes count as often as drawn: (resamples, agents, metrics)."""
    sums = counts.astype(np.float64) @ np.nan_to_num(values)
    return np.asarray(np.swapaxes(sums / counts.sum(axis=-1)[..., None], 0, 1), dtype=np.float64)


def in_blocks(
    measure: Callable[[Floats, Floats], Floats], proxy: Floats, target: Floats, *, numbers: int | None = None
) -> Floats:
    """Apply a measure to many pairs of tables (tables, agents, metrics) without holding at once all that it takes.

    Of one table the measure holds so many numbers; by default one for each pair of agents.
    """
    size = max(1, BLOCK // (numbers or proxy.shape[-2] ** 2))
    starts = range(0, len(proxy), size)
    return np.concatenate([measure(proxy[start : start + size], target[start : start + size]) for start in starts])


def prpv_in_blocks(proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> Floats:
    """PRPV of many pairs of tables, (tables, agents, metrics) each."""
    return in_blocks(lambda one, other: prpv_of_means(one, other, metrics), proxy, target)


def interval(values: Floats) -> tuple[float, float]:
    """The central interval that holds 95 % of the values."""
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(values, [tail, 1 - tail])
    return float(low), float(high)


def prpv_interval(inputs: Comparison, means: Means | None) -> PrpvInterval:
    """The interval of PRPV from mean scores of resampled episodes; without one where there are none."""
    value = round(float(prpv_of_means(*inputs.means, inputs.metrics)))
    if means is None:
        return PrpvInterval(value, None, None, 0, why_not_repeated(inputs))
    values, agents = prpv_in_blocks(*means, inputs.metrics), len(inputs.agents)
    ends = interval_around(value, values, fewest_starts(inputs), (0.0, agents * (agents - 1.0)))
    # A bound in whole pairs, rounded outwards.
    low, high = (float(np.floor(ends[0])), float(np.ceil(ends[1]))) if ends else (None, None)
    return PrpvInterval(value, low, high, len(values))


Ends = tuple[float, float]
ERROR, CORRELATION = (0.0, np.inf), (-1.0, 1.0)
"""Scales of measures."""
UNDEFINED_SHARE = 0.05
"""A measure undefined in more of the resamples than this gets no interval."""


@dataclass(frozen=True)
class Intervals:
    """Bootstrap intervals of the measures beside PRPV, each holding its value; None where one is undefined.

    Like PRPV's they are of what such tables score: noise adds errors and wrong orders that endless episodes had not.
    """

    ppv: Ends | None
    srcc: Mapping[str, Ends | None]
    kendall_tau: Mapping[str, Ends | None]
    mmrv: Mapping[str, Ends | None]


def intervals(*, inputs: Comparison, error: Ppv, means: Means | None) -> Intervals | None:
    """The interval of every measure, PPV with its weights, from resampled means; None without repeated episodes."""
    if means is None:
        return None
    weights = np.array([error.beta[metric.name] or 0.0 for metric in inputs.metrics])
    each, starts, ppv = inputs.target.means.size, fewest_starts(inputs), None
    if error.value is not None:
        values = in_blocks(lambda p, t: ppv_of_means(p, t, weights), *means, numbers=each)
        ppv = interval_around(error.value, values, starts, ERROR)

    def per_metric(
        measure: Callable[[Floats, Floats], Floats], scale: Ends, numbers: int | None = None
    ) -> dict[str, Ends | None]:
        resampled = in_blocks(measure, *means, numbers=numbers).T
        rows = zip(inputs.metrics, measure(*inputs.means), resampled, strict=True)
        return {metric.name: interval_around(float(value), values, starts, scale) for metric, value, values in rows}

    return Intervals(
        ppv=ppv,
        srcc=per_metric(pearson_of_means, CORRELATION, each),
        kendall_tau=per_metric(kendall_of_means, CORRELATION),
        mmrv=per_metric(lambda p, t: mmrv_of_means(p, t, inputs.metrics), ERROR),
    )


def interval_around(value: float, resampled: Floats, starts: int, scale: Ends = (-np.inf, np.inf)) -> Ends | None:
    """The interval of resamples of so many starts, the undefined left out, about a value on this scale.

    None if the value is undefined, or too many resamples are.
    """
    undefined = np.isnan(resampled)
    if np.isnan(value) or undefined.mean() > UNDEFINED_SHARE:
        return None
    known, wider = resampled[~undefined], np.sqrt(starts / (starts - 1))
    low, high = np.clip(value + wider * (np.array(interval(known)) - known.mean()), *scale)
    return min(float(low), value), max(float(high), value)
