"""The two sides of every usefulness measure, checked and put in the same order."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from proxytune.errors import ScoresError
from proxytune.scores import Array, Metric, ScoreTable
from proxytune.usefulness.repeats import repeats, starts_of


@dataclass(frozen=True)
class Comparison:
    """The same agents scored in a proxy and on the target, in the same order and metrics.

    Attributes:
        proxy: Scores in the proxy.
        target: Scores on the target.
        metrics: How agents are compared, in the order of both tables' columns.
    """

    proxy: ScoreTable
    target: ScoreTable
    metrics: tuple[Metric, ...]

    @property
    def agents(self) -> tuple[str, ...]:
        """Names in the order of both tables' rows."""
        return self.target.agents

    @property
    def paired(self) -> bool:
        """Whether both domains have the same starts of every agent, so that these are paired across domains.

        Of one start alone, the same repeats are asked for.
        """
        if not (self.proxy.complete and self.target.complete):
            return False
        starts, others = (set(starts_of(side.episodes)) for side in (self.proxy, self.target))
        return self.proxy.episodes == self.target.episodes or (starts == others and len(starts) > 1)

    @property
    def means(self) -> tuple[Array, Array]:
        """Mean scores in the proxy and on the target, each of shape (agents, metrics)."""
        return self.proxy.means, self.target.means

    @property
    def fewest_starts(self) -> int:
        """How many starts an agent drove on either side, the fewest; repeats of a start count once."""
        return int(min((repeats(side) > 0).sum(axis=1).min() for side in (self.proxy, self.target)))

    @property
    def proxy_episodes(self) -> tuple[int, int]:
        """Fewest and most episodes of an agent in the proxy."""
        return int(self.proxy.counts.min()), int(self.proxy.counts.max())

    @property
    def target_episodes(self) -> tuple[int, int]:
        """Fewest and most episodes of an agent on the target."""
        return int(self.target.counts.min()), int(self.target.counts.max())


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
    _check_agents(proxy, "the proxy", target, "the target")
    _check_agents(target, "the target", proxy, "the proxy")
    if len(target.agents) < 2:
        raise ScoresError(f"only one agent ('{target.agents[0]}') is scored; comparing takes at least two")
    target = target.select(names)
    same = set(proxy.episodes) == set(target.episodes)
    proxy = proxy.select(names).arrange(agents=target.agents, episodes=target.episodes if same else None)
    return Comparison(proxy, target, tuple(metrics))


def _check_agents(present: ScoreTable, where: str, absent: ScoreTable, other: str) -> None:
    known = set(absent.agents)
    missing = [name for name in present.agents if name not in known]
    if missing:
        remedy = "add or remove them, or compare the others alone (score --common)"
        raise ScoresError(f"{other} lacks scores of {', '.join(missing)}, which {where} has; {remedy}")


def in_common(tables: Mapping[str, ScoreTable]) -> tuple[dict[str, ScoreTable], tuple[str, ...]]:
    """The tables with only those agents that all have, in each its own order, and who is left out, in a line each.

    Raises:
        ScoresError: If they have fewer than two in common.
    """
    shared = set.intersection(*(set(table.agents) for table in tables.values()))
    lines = [
        f"left out, since not all sides have them: {', '.join(sorted(beyond))} of {name}"
        for name, table in tables.items()
        if (beyond := set(table.agents) - shared)
    ]
    if len(shared) < 2:
        sides = "; ".join(f"{name} has {', '.join(table.agents)}" for name, table in tables.items())
        raise ScoresError(f"comparing takes at least two agents in common; {sides}")
    kept = {name: _only(table, shared) for name, table in tables.items()}
    return kept, tuple(lines)


def _only(table: ScoreTable, agents: Collection[str]) -> ScoreTable:
    """The table of these agents and of the episodes that they drove."""
    rest = table.arrange(agents=[agent for agent in table.agents if agent in agents])
    driven = [label for column, label in enumerate(rest.episodes) if rest.driven[:, column].any()]
    return rest.arrange(agents=rest.agents, episodes=driven)
