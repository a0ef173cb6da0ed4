"""A stand-in for a study with agents, metrics and episodes: slower than the analytic one, nearer to what PRPV is."""

import math
from dataclasses import dataclass

import numpy as np

from proxytune.arrays import Floats
from proxytune.comparison.analytic import BOX
from proxytune.scores import Metric, ScoreTable
from proxytune.search import Goal, Values, from_unit, to_unit
from proxytune.space import Space
from proxytune.usefulness import prpv_of_means

AGENTS, EPISODES = 12, 10
METRICS = (Metric("distance"), Metric("survival_time"))
SPREAD = 0.15
"""Standard deviation of an episode's score; the agents' own best scores lie between 0.4 and 1."""

WEIGHTS = np.array([0.3, 1.5, 2.0, 3.0])
"""How hard blur, camera pitch, delay and trim hit an agent, typically, per width of the box."""


@dataclass(frozen=True)
class Ranking:
    """PRPV of made-up agents over the paper's box, against a target that was measured once.

    Agent a's mean on a metric is its best score times exp(−|w_a (u − u_a)|), where u is the distance from the seed's
    own optimum in widths of the box, w_a how sensitive it is to each parameter and u_a, on average 0, what it likes.
    Ten episodes with normal noise are averaged in the proxy and on the target. Regret is PRPV of the means without
    noise, which is 0 at the optimum; the floor of 14 is about what the optimum itself scores on ten episodes.
    """

    name: str = "ranking"
    space: Space = BOX
    tolerance: float = 14.0
    identity: str = "ranking 1"

    def truth(self, seed: int) -> Values:
        """The true θ: each parameter drawn from the middle 60 % of its interval."""
        unit = np.random.default_rng([seed, 1]).uniform(0.2, 0.8, len(self.space.intervals))
        return from_unit(self.space, unit)

    def means(self, values: Values, seed: int) -> Floats:
        """Mean scores without noise, shape (agents, metrics)."""
        generator = np.random.default_rng([seed, 2])
        best = generator.uniform(0.4, 1.0, (AGENTS, len(METRICS)))
        weights = WEIGHTS * generator.lognormal(0.0, 0.7, (AGENTS, len(METRICS), len(WEIGHTS)))
        liked = generator.normal(0.0, 0.15, (AGENTS, 1, len(WEIGHTS)))
        away = to_unit(self.space, values) - to_unit(self.space, self.truth(seed))
        decay: Floats = np.exp(-np.linalg.norm(weights * (away - liked), axis=-1))
        return best * decay

    def table(self, values: Values, seed: int) -> ScoreTable:
        """The episodes that a study would drive at a θ, drawn from seed and θ alone."""
        bits = np.frombuffer(np.array(values, dtype=float).tobytes(), dtype=np.uint32)
        return _episodes(self.means(values, seed), np.random.default_rng([seed, 3, *bits.tolist()]))

    def target(self, seed: int) -> ScoreTable:
        """The target's episodes, measured once."""
        return _episodes(self.means(self.truth(seed), seed), np.random.default_rng([seed, 4]))

    def score(self, values: Values, seed: int) -> float:
        """PRPV of the episodes."""
        return float(prpv_of_means(self.table(values, seed).means, self.target(seed).means, METRICS))

    def failure(self, values: Values, seed: int) -> str:
        """None of them fails."""
        return ""

    def outcome(self, values: Values, seed: int) -> Values:
        """Every agent's mean metrics."""
        return tuple(self.table(values, seed).means.ravel().tolist())

    def goal(self, seed: int) -> Goal:
        """The target's mean metrics, and PRPV of such."""
        table = self.target(seed)
        names = tuple((agent, metric) for agent in table.agents for metric in table.metrics)
        noise = np.full(len(names), 2.0 * SPREAD**2 / EPISODES)
        return Goal(names, table.means.ravel(), noise, lambda outcomes: _composed(outcomes, table.means))

    def regret(self, values: Values, seed: int, lowest: float = math.inf) -> float:
        """PRPV without noise on either side."""
        return float(prpv_of_means(self.means(values, seed), self.means(self.truth(seed), seed), METRICS))

    def fresh_score(self, values: Values, seed: int) -> float:
        """PRPV without noise."""
        return self.regret(values, seed)

    def fresh_regret(self, values: Values, seed: int) -> float:
        """The same: it has no noise."""
        return self.regret(values, seed)

    def error(self, values: Values, seed: int) -> float:
        """Mean distance of the parameters from the true ones, in widths of the box."""
        return float(np.abs(to_unit(self.space, values) - to_unit(self.space, self.truth(seed))).mean())


def _composed(outcomes: Floats, target: Floats) -> Floats:
    return prpv_of_means(outcomes.reshape(*outcomes.shape[:-1], *target.shape), target, METRICS)


def _episodes(means: Floats, generator: np.random.Generator) -> ScoreTable:
    values = means[:, None, :] + generator.normal(0.0, SPREAD, (AGENTS, EPISODES, len(METRICS)))
    agents, episodes = (tuple(f"{i:02}" for i in range(count)) for count in (AGENTS, EPISODES))
    return ScoreTable(agents, episodes, tuple(metric.name for metric in METRICS), values)
