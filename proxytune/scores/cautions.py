"""What score tables say that is allowed and probably not meant, a sentence each; none of it changes a figure.

Two sides may differ in units, in the length of their episodes, or in how they spell a name, and are compared all the
same. What is told here is plain: a poor proxy, a short table or a coarse score draws no caution.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from proxytune.arrays import Floats
from proxytune.scores.table import Metric, ScoreTable, varies
from proxytune.settings import alike_caution

TIMES = re.compile(r"(^|_|\b)(time|seconds|duration|survival|lifetime|steps)(_|\b|$)", re.IGNORECASE)
NO_TIMES = re.compile(r"diff|delta|advantage|gain|margin|offset|error|log|reward|per_|rate", re.IGNORECASE)
"""What names of metrics say that count from zero, and of those that may be below."""
OTHER_UNIT = 8.0
"""A factor on which agents agree is told from here on: no proxy's physics is so far off."""
ANY_UNIT = 100.0
"""A factor on which they do not agree is told from here on."""
AGREED = 0.3
"""Agents agree on a factor: half of them within this many powers of ten."""
SAME_LENGTH = 1.05
CEILING = 0.1
"""A time limit is where at least this share of the episodes ends."""
FEWEST_AT_CEILING = 3
NAMED = ("agents", "episodes")
SAME = "the proxy has the target's scores to the last digit; give another table, unless one is a copy on purpose"
DISTINCT = 0.8
"""Copies of episodes are told from coarse scores, which agents share: so many rows belong to one agent alone."""


def score_cautions(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> tuple[str, ...]:
    """Sentences on what is probably not meant in two tables of the same agents, in the same order as the metrics."""
    sides = {"the proxy": proxy, "the target": target}
    alike = (alike_caution(what, chain(*(getattr(one, what) for one in sides.values()))) for what in NAMED)
    lines = [line for line in alike if line]
    for side, table in sides.items():
        lines += _negative_times(table, metrics, side)
        lines += _copies(table, side)
        lines += _tolerances(table, metrics, side)
    rows = proxy.values[proxy.driven]
    distinct = len(np.unique(rows, axis=0)) >= max(DISTINCT * len(rows), 4)
    lines += [SAME] if distinct and np.array_equal(proxy.values, target.values, equal_nan=True) else []
    lines += _signs(proxy, target, metrics)
    lengths = [*_lengths(proxy, target, metrics)]
    return (*lines, *lengths, *_units(proxy, target, metrics, alone=not lengths))


def _negative_times(table: ScoreTable, metrics: Sequence[Metric], side: str) -> Iterator[str]:
    for place, metric in enumerate(metrics):
        if _is_time(metric.name) and (table.values[..., place] < 0.0).any():
            agent, episode = np.argwhere(table.values[..., place] < 0.0)[0]
            where = f"as agent '{table.agents[agent]}' in episode '{table.episodes[episode]}'"
            value = table.values[agent, episode, place]
            yield f"{metric.name} of {side} is below zero, {where}: {value:g}; a time cannot be: check its sign"


def _is_time(name: str) -> bool:
    return bool(TIMES.search(name)) and not NO_TIMES.search(name)


def _copies(table: ScoreTable, side: str) -> Iterator[str]:
    """Most agents have every episode at least twice, to the last digit."""
    rows = [table.values[agent][table.driven[agent]] for agent in range(len(table.agents))]
    distinct = [np.unique(own, axis=0) for own in rows]
    repeated = [2 * len(few) <= len(own) for own, few in zip(rows, distinct, strict=True)]
    pooled = len(np.unique(np.concatenate(distinct), axis=0))
    kept = sum(map(len, distinct))
    if np.mean(repeated) >= 0.75 and pooled >= max(DISTINCT * kept, 4):
        few = f"of {table.counts.sum()} episodes of {side} only {kept} differ from one another"
        yield f"{few}: the others are copies to the last digit; give each once, or intervals come out too narrow"


def _signs(proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Iterator[str]:
    """Every agent has about its score of the other side, but for the sign."""
    for place, metric in enumerate(metrics):
        one, other = proxy.means[:, place], target.means[:, place]
        apart = (np.sign(one) == np.sign(one[0])).all() and (np.sign(one) == -np.sign(other)).all() and one[0] != 0.0
        if not apart or len(one) < 3 or _is_time(metric.name):
            continue
        if np.ptp(np.log10(np.abs(one)) - np.log10(np.abs(other))) < AGREED:
            below = "the proxy and above it on the target" if one[0] < 0.0 else "the target and above it in the proxy"
            yield f"scores of {metric.name} are below zero in {below}, of like size; give both with one sign"


def _tolerances(table: ScoreTable, metrics: Sequence[Metric], side: str) -> Iterator[str]:
    for place, metric in enumerate(metrics):
        merits, tie = metric.merits(table.means[:, place])
        if metric.tolerance and varies(table.means)[place] and np.ptp(merits) <= tie[0]:
            percent = " %" if metric.percent else ""
            given = f"the tolerance of {metric.name}, {metric.tolerance:g}{percent}"
            yield f"{given}, leaves no two agents of {side} apart: all tie; give a smaller one"


def _lengths(proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Iterator[str]:
    """Where a time limit ends episodes on one side, and others last longer on the other."""
    for place, metric in enumerate(metrics):
        if not _is_time(metric.name):
            continue
        both = [table.values[..., place][table.driven] for table in (proxy, target)]
        most, other = (float(times.max()) for times in both)
        # The shorter side's longest episodes were ended by a limit where others end with them.
        times, longest = (both[0], most) if most < other else (both[1], other)
        ended = int((times >= longest - 1e-3 * abs(longest)).sum())
        shorter = ended >= max(FEWEST_AT_CEILING, CEILING * len(times))
        factor = max(most, other) / min(most, other) if min(most, other) > 0.0 else 1.0
        other_unit = any(abs(factor / unit - 1.0) < 0.02 for unit in (60.0, 1e3, 1e6, 1e9))
        if shorter and factor > SAME_LENGTH and not other_unit:
            last = f"episodes last up to {most:.4g} in the proxy and up to {other:.4g} on the target by {metric.name}"
            yield f"{last}; give both sides one time limit, or scores that grow with time cannot be compared"


def _units(proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric], *, alone: bool) -> Iterator[str]:
    for place, metric in enumerate(metrics):
        ratio = _ratio(proxy.means[:, place], target.means[:, place])
        largest = [float(np.nanmax(np.abs(table.values[..., place]))) for table in (proxy, target)]
        if ratio is None or max(largest) <= 1.0 or not (alone or abs(np.log10(ratio)) > np.log10(ANY_UNIT)):
            continue
        factor, of = (ratio, "the proxy are") if ratio > 1.0 else (1.0 / ratio, "the target are")
        yield f"scores of {metric.name} in {of} {factor:.4g} times those of the other side; give both in one unit"


def _ratio(one: Floats, other: Floats) -> float | None:
    """The factor between two sides' means, where there is one that is more than a poor proxy's."""
    told = (one != 0.0) & (other != 0.0)
    if told.sum() < 3 or told.mean() < 0.5:
        return None
    logs = np.log10(np.abs(one[told])) - np.log10(np.abs(other[told]))
    low, middle, high = np.quantile(logs, (0.25, 0.5, 0.75)).tolist()
    least = np.log10(OTHER_UNIT if high - low < AGREED else ANY_UNIT)
    return float(10.0**middle) if abs(middle) >= least else None
