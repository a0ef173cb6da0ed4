"""A stand-in with agents, metrics and episodes, without a simulator: to bootstrap PRPV and to model metrics."""

from dataclasses import dataclass

import numpy as np

from proxytune.scores import Metric, ScoreTable
from proxytune.search.analytic import BOX
from proxytune.search.design import from_unit, to_unit
from proxytune.space import Space
from proxytune.usefulness import compare
from proxytune.usefulness.prpv import prpv_of_means
from proxytune.usefulness.resampling import bootstrap_means

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

    def optimum(self, seed):
        """The true θ on the unit cube: each parameter from the middle 60 % of its interval."""
        return np.random.default_rng([seed, 1]).uniform(0.2, 0.8, len(self.space.intervals))

    def means(self, values, seed):
        """Mean scores without noise, shape (agents, metrics)."""
        generator = np.random.default_rng([seed, 2])
        best = generator.uniform(0.4, 1.0, (AGENTS, 2))
        weights = WEIGHTS * generator.lognormal(0.0, 0.7, (AGENTS, 2, len(WEIGHTS)))
        liked = generator.normal(0.0, 0.15, (AGENTS, 1, len(WEIGHTS)))
        away = to_unit(self.space, values) - self.optimum(seed)
        return best * np.exp(-np.linalg.norm(weights * (away - liked), axis=-1))

    def table(self, values, seed):
        """The episodes that a study would drive at a θ, drawn from seed and θ alone."""
        bits = np.frombuffer(np.array(values, dtype=float).tobytes(), dtype=np.uint32)
        return _episodes(self.means(values, seed), np.random.default_rng([seed, 3, *bits.tolist()]))

    def target(self, seed):
        """The target's episodes, measured once."""
        return _episodes(self._true(seed), np.random.default_rng([seed, 4]))

    def score(self, values, seed):
        """PRPV of the episodes."""
        return float(prpv_of_means(self.table(values, seed).means, self.target(seed).means, METRICS))

    def regret(self, values, seed):
        """PRPV without noise on either side."""
        return float(prpv_of_means(self.means(values, seed), self._true(seed), METRICS))

    def variance(self, values, seed):
        """Of PRPV, from 200 bootstraps of the proxy's episodes; the target's are the same at every θ."""
        inputs = compare(proxy=self.table(values, seed), target=self.target(seed), metrics=METRICS)
        proxy, _ = bootstrap_means(inputs, resamples=200, seed=0)
        return float(prpv_of_means(proxy, inputs.target.means, METRICS).var())

    def _true(self, seed):
        return self.means(from_unit(self.space, self.optimum(seed)), seed)


def _episodes(means, generator):
    values = means[:, None, :] + generator.normal(0.0, SPREAD, (AGENTS, EPISODES, len(METRICS)))
    agents, episodes = (tuple(f"{i:02}" for i in range(count)) for count in (AGENTS, EPISODES))
    return ScoreTable(agents, episodes, tuple(metric.name for metric in METRICS), values)
