"""The two sides of every measure: a score table of the proxy and one of the target, with the same agents in one order.

Starts and their repeats are read off the episodes' labels: START/REPEAT is one of several episodes from START, each
under other noise.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.arrays import Floats, Whole
from proxytune.errors import ScoresError
from proxytune.scores import Metric, ScoreTable
from proxytune.settings import alike_caution


@dataclass(frozen=True)
class Comparison:
    """Two score tables, of the proxy and of the target, with the same agents and metrics in the same order."""

    proxy: ScoreTable
    target: ScoreTable
    metrics: tuple[Metric, ...]

    @property
    def agents(self) -> tuple[str, ...]:
        """Names in the order of both tables' rows."""
        return self.target.agents

    @property
    def paired(self) -> bool:
        """True if both domains have the same starts of every agent, so that these are paired across domains.

        Of one start alone, the same repeats are asked for.
        """
        if not (self.proxy.complete and self.target.complete):
            return False
        starts, others = (set(starts_of(side.episodes)) for side in (self.proxy, self.target))
        return self.proxy.episodes == self.target.episodes or (starts == others and len(starts) > 1)

    @property
    def means(self) -> tuple[Floats, Floats]:
        """Mean scores in the proxy and on the target, each of shape (agents, metrics)."""
        return self.proxy.means, self.target.means

    @property
    def episodes(self) -> tuple[tuple[int, int], ...]:
        """Fewest and most episodes of an agent, in the proxy and on the target."""
        return tuple((int(side.counts.min()), int(side.counts.max())) for side in (self.proxy, self.target))


def compare(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Comparison:
    """Put two tables in the same order.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown or twice.
    """
    names = [metric.name for metric in metrics]
    if not names:
        raise ScoresError("no metric is given; name at least one")
    if len(set(names)) < len(names):
        raise ScoresError(f"a metric is given twice: {', '.join(names)}")
    for present, where, absent, other in (
        (proxy, "the proxy", target, "the target"),
        (target, "the target", proxy, "the proxy"),
    ):
        known = set(absent.agents)
        if missing := [name for name in present.agents if name not in known]:
            remedy = "add or remove them, or compare the others alone (score --common)"
            remedy = alike_caution("agents", (*missing, *absent.agents)) or remedy
            raise ScoresError(f"{other} lacks scores of {', '.join(missing)}, which {where} has; {remedy}")
    if len(target.agents) < 2:
        raise ScoresError(f"only one agent ('{target.agents[0]}') is scored; comparing takes at least two")
    target = target.select(names)
    same = set(proxy.episodes) == set(target.episodes)
    proxy = proxy.select(names).arrange(agents=target.agents, episodes=target.episodes if same else None)
    return Comparison(proxy, target, tuple(metrics))


def in_common(tables: Mapping[str, ScoreTable]) -> tuple[dict[str, ScoreTable], tuple[str, ...]]:
    """The tables with only those agents that all have, in each its own order, and who is left out, in a line each."""
    shared = set.intersection(*(set(table.agents) for table in tables.values()))
    lines = [
        f"left out, since not all sides have them: {', '.join(sorted(beyond))} of {name}"
        for name, table in tables.items()
        if (beyond := set(table.agents) - shared)
    ]
    if len(shared) < 2:
        sides = "; ".join(f"{name} has {', '.join(table.agents)}" for name, table in tables.items())
        raise ScoresError(f"comparing takes at least two agents in common; {sides}")
    kept = {}
    for name, table in tables.items():
        rest = table.arrange(agents=[agent for agent in table.agents if agent in shared])
        driven = [label for column, label in enumerate(rest.episodes) if rest.driven[:, column].any()]
        kept[name] = rest.arrange(agents=rest.agents, episodes=driven)
    return kept, tuple(lines)


def start_of(label: str) -> str:
    """The start of an episode: what is before the label's last "/", or the whole label where there is none."""
    return label.rpartition("/")[0] or label


def starts_of(labels: Iterable[str]) -> tuple[str, ...]:
    """The starts of these episodes, each once, in their order."""
    return tuple(dict.fromkeys(map(start_of, labels)))


def start_places(table: ScoreTable) -> Whole:
    """The place of each episode's start among the table's starts."""
    places = {start: place for place, start in enumerate(starts_of(table.episodes))}
    return np.array([places[start_of(label)] for label in table.episodes], dtype=np.int64)


def repeats(table: ScoreTable) -> Whole:
    """Count the repeats that each agent drove of each start, shape (agents, starts)."""
    places = start_places(table)
    starts = int(places.max()) + 1
    return np.stack([np.bincount(places[driven], minlength=starts) for driven in table.driven])


def fewest_starts(inputs: Comparison) -> int:
    """The fewest starts of an agent on either side; where one has a single start, the fewest repeats."""
    starts = [int((repeats(side) > 0).sum(axis=1).min()) for side in (inputs.proxy, inputs.target)]
    episodes = [fewest for fewest, _ in inputs.episodes]
    return min(own if own > 1 else count for own, count in zip(starts, episodes, strict=True))


def by_start(table: ScoreTable) -> ScoreTable:
    """Average over the repeats of each start: the same scores with one episode per start."""
    places = start_places(table)
    if places.max() + 1 == len(places):
        return ScoreTable(table.agents, starts_of(table.episodes), table.metrics, table.values)
    members = (places[:, None] == np.arange(places.max() + 1)).astype(np.float64)  # (episodes, starts)
    counts = repeats(table)
    sums = np.einsum("aem,es->asm", np.nan_to_num(table.values), members)
    values = np.where(counts[..., None] > 0, sums / np.maximum(counts, 1)[..., None], np.nan)
    return ScoreTable(table.agents, starts_of(table.episodes), table.metrics, values)


def independence(table: ScoreTable, column: int) -> Floats:
    """The share of each agent's episodes that counts as independent, shape (agents,): repeats of a start are alike.

    With r repeats of a start it is 1/(1 + (r − 1) ICC), the intraclass correlation ICC being pooled over agents. Of
    one start alone repeats count in full; where nothing varies each start counts once.
    """
    counts, places = repeats(table), start_places(table)
    starts = (counts > 0).sum(axis=1)
    between, within = int((starts - 1).sum()), int((table.counts - starts).sum())
    if not between or not within:
        return np.ones(len(table.agents))
    means = by_start(table).values[..., column]
    spread = counts * (means - table.means[:, [column]]) ** 2
    outer = float(np.nansum(spread)) / between
    inner = float(np.nansum((table.values[..., column] - means[:, places]) ** 2)) / within
    alike = (counts**2).sum(axis=1) / table.counts
    usual = float(table.counts.sum() - alike.sum()) / between
    whole = outer + (usual - 1.0) * inner
    icc = min(max((outer - inner) / whole, 0.0), 1.0) if whole > 0.0 else 1.0
    return np.asarray(1.0 / (1.0 + (alike - 1.0) * icc), dtype=np.float64)
