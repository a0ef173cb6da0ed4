"""PRPV, the proxy relative predictivity value: how many pairs of agents the proxy ranks unlike the target.

Who is ahead of whom in a column of scores, by sorting: what every pair would say at the cost of few comparisons.
PRPV, Kendall's τ and MMRV of many agents, as exact as pair by pair and in seconds instead of minutes.
Starts and their repeats: an episode labelled START/REPEAT is one of several from START, under other noise each.
The two sides of every usefulness measure, checked and put in the same order.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.errors import ScoresError
from proxytune.scores import ROUNDING, Metric, ScoreTable

FEW_AGENTS = 128
"""Up to so many agents each pair is compared, in many tables at once, which is quicker for them."""
BITS = 64
WORDS = 2**20
"""Most words of 64 bits that one set of agents per agent may take, 8 MiB: more agents go in several blocks."""

Indices = NDArray[np.int64]
Sets = NDArray[np.uint64]
"""One set of agents per row, one bit per agent."""


@dataclass(frozen=True)
class Standing:
    """Where each agent stands in one column.

    Attributes:
        order: Agents from the lowest score to the highest.
        below: How many agents each is ahead of; these come first in the order.
        reach: How many agents are not ahead of each; these come first in the order too.
    """

    order: Indices
    below: Indices
    reach: Indices

    def sets(self, block: slice) -> Sets:
        """The first 0, 1, … agents of the order as sets, shape (agents + 1, words): the bits of this block of words."""
        agents, words = len(self.order), block.stop - block.start
        word = self.order // BITS - block.start
        rows = np.flatnonzero((word >= 0) & (word < words))
        sets = np.zeros((agents + 1, words), dtype=np.uint64)
        sets[rows + 1, word[rows]] = np.uint64(1) << (self.order[rows] % BITS).astype(np.uint64)
        return np.bitwise_or.accumulate(sets, axis=0, out=sets)


def stand(scores: Floats, tie: float) -> Standing:
    """Sort a column.

    Args:
        scores: One per agent, finite.
        tie: The largest difference that is still a tie.
    """
    agents = len(scores)
    order = np.argsort(scores)
    ahead_of = _ahead_of(scores[order], tie)
    below, reach = np.empty((2, agents), dtype=np.int64)
    below[order] = ahead_of
    reach[order] = np.searchsorted(ahead_of, np.arange(agents), side="right")
    return Standing(order, below, reach)


def stand_by_rounding(scores: Floats) -> Standing:
    """Sort a column in which only rounding makes ties."""
    return stand(scores, ROUNDING * float(np.abs(scores).max()))


def blocks(agents: int) -> Iterator[slice]:
    """The words of a set of agents, as many at a time as memory is to take."""
    words, size = -(-agents // BITS), max(1, WORDS // (agents + 1))
    return (slice(start, min(start + size, words)) for start in range(0, words, size))


def count(sets: Sets) -> int:
    """How many agents all these sets hold together, each set's own."""
    return int(np.bitwise_count(sets).sum(dtype=np.int64))


def _ahead_of(ascending: Floats, tie: float) -> Indices:
    """How many of ascending scores each exceeds by more than a tie: those of which the difference as rounded does."""
    guess = np.searchsorted(ascending, ascending - tie)
    last, first = ascending[np.maximum(guess - 1, 0)], ascending[guess]
    if (((ascending - last > tie) | (guess == 0)) & ~(ascending - first > tie)).all():
        return np.asarray(guess, dtype=np.int64)
    low, high = np.zeros(len(ascending), dtype=np.int64), np.arange(len(ascending))
    while (low < high).any():
        middle = (low + high) // 2
        exceeds = ascending - ascending[middle] > tie
        low, high = np.where(exceeds, middle + 1, low), np.where(exceeds, high, middle)
    return low


def by_table(measure: Callable[[Floats, Floats], float | Floats], proxy: Floats, target: Floats) -> Floats:
    """Measure many pairs of tables one by one.

    Args:
        measure: Of two arrays of shape (agents, metrics).
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.

    Returns:
        Shape (…), followed by that of what is measured.
    """
    proxy, target = np.broadcast_arrays(proxy, target)
    leading, table = proxy.shape[:-2], proxy.shape[-2:]
    tables = zip(proxy.reshape(-1, *table), target.reshape(-1, *table), strict=True)
    values = np.array([measure(one, other) for one, other in tables], dtype=np.float64)
    return values.reshape((*leading, *values.shape[1:]))


def prpv_of_table(proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> float:
    """PRPV of mean scores, each of shape (agents, metrics)."""
    sides = [_standings(means, metrics) for means in (proxy, target)]
    value = 0
    for block in blocks(len(proxy)):
        one, other = (_dominated(standings, block) for standings in sides)
        # A pair costs 1 where one side alone has an order, 2 where both have one and it is not the same.
        value += count(one) + count(other) - 2 * count(one & other)
    return float(value)


def kendall_of_table(proxy: Floats, target: Floats) -> Floats:
    """Kendall's τ-b of mean scores, each of shape (agents, metrics): shape (metrics,), NaN where undefined."""
    return np.array([_kendall(one, other) for one, other in zip(proxy.T, target.T, strict=True)])


def violations_of_table(proxy: Floats, target: Floats) -> Floats:
    """The largest violation of each agent in each metric, more being better: arrays of shape (agents, metrics)."""
    return np.stack([_violations(one, other) for one, other in zip(proxy.T, target.T, strict=True)], axis=-1)


def _kendall(proxy: Floats, target: Floats) -> float:
    """Kendall's τ-b of one metric's mean scores, each of shape (agents,); NaN where all are alike on a side."""
    one, other = stand_by_rounding(proxy), stand_by_rounding(target)
    concordant = 0
    for block in blocks(len(proxy)):
        below, sets = one.sets(block)[one.below], other.sets(block)
        discordant = below & ~sets[other.reach]
        concordant += 2 * (count(below & sets[other.below]) - count(discordant))
    pairs = 2.0 * one.below.sum() * 2.0 * other.below.sum()
    return float(concordant / np.sqrt(pairs)) if pairs else np.nan


def _violations(proxy: Floats, target: Floats) -> Floats:
    """The largest violation of each agent in one metric, more being better: arrays of shape (agents,)."""
    one, other = stand_by_rounding(proxy), stand_by_rounding(target)
    along, tie = target[one.order], ROUNDING * float(np.abs(target).max())
    best_beaten = np.append(-np.inf, np.maximum.accumulate(along))[one.below]
    worst_unbeaten = np.minimum.accumulate(along[::-1])[::-1][one.below]
    invented = np.where(target - best_beaten > tie, 0.0, np.abs(target - best_beaten))
    missed = np.where(target - worst_unbeaten > tie, target - worst_unbeaten, 0.0)
    # Two scores that are not equal but tie cost their difference, which the best of those beaten may not show.
    near = (target > target[other.order][other.below]) & (np.abs(target - best_beaten) < tie)
    for agent in np.flatnonzero(near):
        costs = np.abs(target[agent] - along[: one.below[agent]])
        invented[agent] = costs[target[agent] - along[: one.below[agent]] <= tie].max(initial=0.0)
    return np.maximum(invented, missed)


def _standings(means: Floats, metrics: Sequence[Metric]) -> list[Standing]:
    """Where the agents stand in each metric, more being better."""
    merits = (metric.merits(means[:, column]) for column, metric in enumerate(metrics))
    return [stand(scores, float(tie[0])) for scores, tie in merits]


def _dominated(standings: Sequence[Standing], block: slice) -> Sets:
    """The agents that each dominates: ahead of them in one metric, none of them ahead in another."""
    first, *rest = standings
    sets = first.sets(block)
    ahead, not_behind = sets[first.below], sets[first.reach]
    for standing in rest:
        sets = standing.sets(block)
        ahead |= sets[standing.below]
        not_behind &= sets[standing.reach]
    return np.bitwise_and(ahead, not_behind, out=ahead)


Counts = NDArray[np.int64]
Choice = NDArray[np.bool_]


def start_of(label: str) -> str:
    """The start of an episode: what is before the label's last "/", or the whole label where there is none."""
    return label.rpartition("/")[0] or label


def starts_of(labels: Iterable[str]) -> tuple[str, ...]:
    """The starts of these episodes, each once, in their order."""
    return tuple(dict.fromkeys(map(start_of, labels)))


def start_places(table: ScoreTable) -> Counts:
    """The place of each episode's start among the table's starts."""
    places = {start: place for place, start in enumerate(starts_of(table.episodes))}
    return np.array([places[start_of(label)] for label in table.episodes], dtype=np.int64)


def repeats(table: ScoreTable) -> Counts:
    """How many repeats each agent drove of each start, shape (agents, starts)."""
    places = start_places(table)
    order = np.argsort(places, kind="stable")
    firsts = np.searchsorted(places[order], np.arange(places.max() + 1))
    return np.add.reduceat(table.driven[:, order].astype(np.int64), firsts, axis=1)


def is_repeated(table: ScoreTable) -> bool:
    """Whether every start has at least two repeats, so that a domain can be compared with itself from the same starts.

    Every agent must have driven some start twice. A start that one agent alone drove is no start but a label of that
    agent's own.
    """
    labels, driven = np.bincount(start_places(table)), repeats(table)
    shared = (driven > 0).sum(axis=0) >= 2
    return bool(labels.min() >= 2 and shared.all() and (driven >= 2).any(axis=1).all())


def split_repeats(driven: Choice, places: Counts, keys: NDArray[np.float64]) -> tuple[Choice, Choice]:
    """Which episodes fall into either of two sets that hold the same starts, each as often.

    Where an agent has an odd number of repeats of a start, one is left out. Agents split the same repeats alike.

    Args:
        driven: Which agent drove which episode, shape (agents, episodes).
        places: The place of each episode's start.
        keys: Random numbers, shape (splits, episodes); the lower half of a start's repeats is the first set's.

    Returns:
        Two arrays of shape (agents, splits, episodes).
    """
    first, second = np.zeros((2, len(driven), *keys.shape), dtype=np.bool_)
    for place in range(places.max() + 1):
        columns = np.flatnonzero(places == place)
        own = driven[:, None, columns]
        rank = np.where(own, keys[:, columns], np.inf).argsort(axis=-1).argsort(axis=-1)
        size = own.sum(axis=-1, keepdims=True) // 2
        first[..., columns] = rank < size
        second[..., columns] = (rank >= size) & (rank < 2 * size)
    return first, second


def by_start(table: ScoreTable) -> ScoreTable:
    """The same scores with one episode per start: the mean over its repeats."""
    members, counts = _membership(table).astype(np.float64), repeats(table)
    sums = np.einsum("aem,es->asm", np.nan_to_num(table.values), members)
    values = np.where(counts[..., None] > 0, sums / np.maximum(counts, 1)[..., None], np.nan)
    return ScoreTable(table.agents, starts_of(table.episodes), table.metrics, values)


def _membership(table: ScoreTable) -> NDArray[np.bool_]:
    """Which episode is a repeat of which start, shape (episodes, starts)."""
    places = start_places(table)
    return np.asarray(places[:, None] == np.arange(places.max() + 1), dtype=np.bool_)


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
    def means(self) -> tuple[Floats, Floats]:
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


Flip = Literal["reversed", "lost", "invented"]


@dataclass(frozen=True)
class FlippedPair:
    """Two agents that the proxy ranks unlike the target.

    Attributes:
        better: The one that dominates on the target, or in the proxy where the target has no order.
        worse: The other.
        flip: "reversed" if the proxy says the opposite, "lost" if it sees no order where the target has one,
            "invented" if it sees one where the target has none.
    """

    better: str
    worse: str
    flip: Flip


@dataclass(frozen=True)
class Prpv:
    """A proxy relative predictivity value.

    Attributes:
        value: Sum over ordered pairs of agents, 0 (same order) to K(K−1) (every pair reversed) for K agents.
        inputs: What was compared, with its sample sizes.
    """

    value: int
    inputs: Comparison
    better: ClassVar[str] = "lower"

    @property
    def range(self) -> tuple[int, int]:
        """Smallest and largest possible value."""
        agents = len(self.inputs.agents)
        return 0, agents * (agents - 1)

    @property
    def normalised(self) -> float:
        """The value as a fraction of its largest possible one."""
        return self.value / self.range[1]

    @cached_property
    def pairs(self) -> tuple[FlippedPair, ...]:
        """Every pair that the proxy ranks unlike the target; a reversed one costs 2, others 1."""
        proxy, target = (dominance(means, self.inputs.metrics) for means in self.inputs.means)
        agents = self.inputs.agents
        better, worse = np.nonzero((proxy != target) & ((target == 1.0) | ((target == 0.5) & (proxy == 1.0))))
        sides = zip(target[better, worse].tolist(), proxy[better, worse].tolist(), strict=True)
        pairs = zip(better.tolist(), worse.tolist(), sides, strict=True)
        return tuple(FlippedPair(agents[i], agents[j], FLIPS[flip]) for i, j, flip in pairs)


FLIPS: dict[tuple[float, float], Flip] = {(1.0, 0.0): "reversed", (1.0, 0.5): "lost", (0.5, 1.0): "invented"}


def dominance(means: Floats, metrics: Sequence[Metric]) -> Floats:
    """α, eq. (3): who dominates whom.

    Args:
        means: Mean scores, shape (…, agents, metrics).
        metrics: How each of the metrics compares.

    Returns:
        Shape (…, agents, agents): 1 where row dominates column (better beyond tolerance on one metric, worse on
        none), 0 where column dominates row, 0.5 where they are incomparable or tied.
    """
    first, second = np.triu_indices(means.shape[-2], 1)
    signs = 0.5 * _signs(means, metrics)
    alpha = np.full((*means.shape[:-1], means.shape[-2]), 0.5)
    alpha[..., first, second] += signs
    alpha[..., second, first] -= signs
    return alpha


def prpv_of_means(proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> Floats:
    """PRPV, eq. (4), of many pairs of tables at once.

    Args:
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.
        metrics: How each of the metrics compares.

    Returns:
        Shape (…).
    """
    if proxy.shape[-2] > FEW_AGENTS:
        return by_table(lambda one, other: prpv_of_table(one, other, metrics), proxy, target)
    # Each pair counts half in either order.
    difference = np.abs(_signs(proxy, metrics) - _signs(target, metrics))
    return np.asarray(difference.sum(axis=-1), dtype=np.float64)


def _signs(means: Floats, metrics: Sequence[Metric]) -> NDArray[np.int8]:
    """2α − 1 of every pair of agents (…, pairs), the first of them before the second."""
    first, second = np.triu_indices(means.shape[-2], 1)
    better, worse = (np.zeros((*means.shape[:-2], len(first)), dtype=np.int8) for _ in range(2))
    for column, metric in enumerate(metrics):
        merits, tie = metric.merits(means[..., column])
        ahead = merits[..., first] - merits[..., second]
        better |= ahead > tie
        worse |= ahead < -tie
    return better - worse


def prpv(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Prpv:
    """Count how unlike the target the proxy ranks the agents, eqs. (3) and (4) of the paper.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    return Prpv(round(float(prpv_of_means(*inputs.means, inputs.metrics))), inputs)
