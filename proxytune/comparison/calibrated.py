"""A stand-in for a study whose agents' metrics are a simulator's: nothing of it is made up but courses between 48 θ."""

import hashlib
import math
from dataclasses import dataclass

import numpy as np

from proxytune.arrays import Floats
from proxytune.comparison.analytic import BOX
from proxytune.comparison.courses import TABLE, course, simulated
from proxytune.scores import Metric
from proxytune.search import Goal, Values, from_unit, to_unit
from proxytune.space import Space
from proxytune.usefulness import prpv_of_means

METRICS = ("distance", "survival_time", "early_distance", "early_offset")
COMPARED = (Metric("distance"), Metric("survival_time"))
LONGEST, ALMOST = 20.0, 18.5
"""An agent that is not stopped drives for so long [s], and is tied with all that do. If one start of four ends early,
the mean is lower by seconds; so whoever is above the second is taken for one that is not stopped."""
FRESH_DRAWS = 64


@dataclass(frozen=True)
class Calibrated:
    """PRPV of a simulator's twelve agents over the paper's box, against a target that was measured once.

    Per seed a draw of all agents' mean metrics given those simulated at 48 θ, with the roughness that was found round
    them; the truth is drawn from the middle 80 % of the box, and its outputs, with the noise of another placement, are
    the target. Regret is PRPV above the truth's, both the mean over 64 fresh placements; the floor is a pair reversed.
    """

    name: str = "calibrated"
    space: Space = BOX
    tolerance: float = 2.0

    @property
    def identity(self) -> str:
        """What determines its figures: the table is part of it."""
        return f"calibrated 1 {hashlib.sha256(TABLE.read_bytes()).hexdigest()[:12]}"

    def truth(self, seed: int) -> Values:
        """The true θ: each parameter drawn from the middle 80 % of its interval."""
        return from_unit(self.space, np.random.default_rng([seed, 1]).uniform(0.1, 0.9, len(self.space.intervals)))

    def means(self, values: Values, seed: int) -> Floats:
        """Every agent's mean metrics under the study's placement, shape (outputs,)."""
        known = simulated()
        rough = known.mixing @ _generator(values, seed, 3).standard_normal(len(known.rough))
        standardised = course(seed)(to_unit(self.space, values))
        return _possible(known.means.mean(axis=0) + np.sqrt(known.smooth) * standardised + np.sqrt(known.rough) * rough)

    def score(self, values: Values, seed: int) -> float:
        """PRPV of these."""
        return float(_prpv(self.means(values, seed), self.target(seed)))

    def failure(self, values: Values, seed: int) -> str:
        """None of them fails."""
        return ""

    def outcome(self, values: Values, seed: int) -> Values:
        """Every agent's mean metrics."""
        return tuple(self.means(values, seed).tolist())

    def target(self, seed: int) -> Floats:
        """The truth's outputs under another placement."""
        truth = self.truth(seed)
        return np.asarray(replaced(self.means(truth, seed), 1, _generator(truth, seed, 4))[0])

    def goal(self, seed: int) -> Goal:
        """The target's mean metrics, and PRPV of such."""
        target, agents = self.target(seed), simulated().agents
        outputs = tuple((agent, metric) for agent in agents for metric in METRICS)
        noise = (simulated().placements ** 2).mean(axis=0)
        return Goal(outputs, target, noise, lambda outcomes: _prpv(outcomes, target))

    def fresh_score(self, values: Values, seed: int) -> float:
        """Mean PRPV over fresh placements."""
        fresh = replaced(self.means(values, seed), FRESH_DRAWS, _generator(values, seed, 5))
        return float(_prpv(fresh, self.target(seed)).mean())

    def regret(self, values: Values, seed: int, lowest: float = math.inf) -> float:
        """That above the truth's."""
        return self.fresh_score(values, seed) - self.fresh_score(self.truth(seed), seed)

    def fresh_regret(self, values: Values, seed: int) -> float:
        """The same: the placement that the engine has seen is not among them."""
        return self.regret(values, seed)

    def error(self, values: Values, seed: int) -> float:
        """Mean distance of the parameters from the true ones, in widths of the box."""
        return float(np.abs(to_unit(self.space, values) - to_unit(self.space, self.truth(seed))).mean())


def replaced(means: Floats, count: int, generator: np.random.Generator) -> Floats:
    """The outputs under so many other placements, shape (count, outputs).

    Each agent changes as it did in one of the placements that were simulated: if it is not stopped, in one of those
    that left its survival as it was, otherwise in one of those that did not.
    """
    by_agent = means.reshape(-1, len(METRICS))
    changes = simulated().placements.reshape(-1, *by_agent.shape)
    fresh = np.empty((count, *by_agent.shape))
    for row, metrics in enumerate(by_agent):
        alike = np.flatnonzero((changes[:, row, 1] == 0.0) == (metrics[1] >= LONGEST))
        chosen = generator.choice(alike if alike.size else len(changes), count)
        fresh[:, row] = metrics + changes[chosen, row]
    return _possible(fresh.reshape(count, -1))


def _generator(values: Values, seed: int, which: int) -> np.random.Generator:
    """Of what seed and θ determine."""
    bits = np.frombuffer(np.array(values, dtype=float).tobytes(), dtype=np.uint32)
    return np.random.default_rng([seed, which, *bits.tolist()])


def _possible(outputs: Floats) -> Floats:
    """Distances and times not below 0, and who almost survives does."""
    by_metric = outputs.reshape(*outputs.shape[:-1], -1, len(METRICS)).copy()
    by_metric[..., :3] = np.maximum(0.0, by_metric[..., :3])
    by_metric[..., 1] = np.where(by_metric[..., 1] > ALMOST, LONGEST, by_metric[..., 1])
    return np.asarray(by_metric.reshape(outputs.shape))


def _prpv(outputs: Floats, target: Floats) -> Floats:
    one, other = (means.reshape(*means.shape[:-1], -1, len(METRICS))[..., :2] for means in (outputs, target))
    return prpv_of_means(one, other, COMPARED)
