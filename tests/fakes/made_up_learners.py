"""Learners whose mean learning curves are known: by a formula, not by what the package takes for granted of them.

A learner stays on the road from a start with some chance, which rises with the samples it has; each repetition moves
that rise, for all learners and for each of its own, so scores are neither Gaussian nor equally noisy.
"""

import numpy as np

from proxytune.learning import LearningCurve

GRID = (0, 50, 100, 200, 400, 800, 1600, 3200)
STARTS, BEST, NONE, TOLERANCE = 10, 60.0, "none", 5.0
PROXIES = 4


class MadeUpLearners:
    """A learner without a proxy and four with one, each with a rise, a zero-shot score and perhaps a dip of its own."""

    def __init__(self, seed):
        generator = np.random.default_rng(seed)
        self.seed = seed
        self.names = [NONE, *(f"proxy {number}" for number in range(1, PROXIES + 1))]
        self.top = generator.uniform(0.72, 0.97)
        self.shapes = {name: self._shape(generator, name == NONE) for name in self.names}
        self.shared, self.own = generator.uniform(0.1, 0.6), generator.uniform(0.2, 0.7)

    def score(self, name, repetition, samples):
        """Of one examination; NaN where nothing has been learnt."""
        if name == NONE and not samples:
            return np.nan
        number = self.names.index(name)
        moved = self.shared * np.random.default_rng([self.seed, repetition]).normal()
        moved += self.own * np.random.default_rng([self.seed, repetition, number + 1]).normal()
        generator = np.random.default_rng([self.seed, repetition, number + 1, samples])
        stays = generator.random(STARTS) < self._chance(name, float(samples), moved)
        return float(np.where(stays, BEST, generator.uniform(0.0, BEST / 2.0, STARTS)).mean())

    def needed(self, name):
        """η, from the mean over endlessly many repetitions; infinite where it is not reached."""
        counts = np.concatenate(([0.0], np.geomspace(1.0, GRID[-1], 800)))
        mean = self._mean(name, counts)
        if name == NONE:
            mean[counts < GRID[1]] = -BEST
        below = np.flatnonzero(mean < self._mean(NONE, np.array([float(GRID[-1])]))[0] - TOLERANCE)
        after = below[-1] + 1 if len(below) else 0
        return counts[after] if after < len(counts) else np.inf

    def curves(self, repetitions):
        """All examinations of the grid."""
        return {
            name: LearningCurve(
                GRID, np.array([[self.score(name, row, n) for n in GRID] for row in range(repetitions)])
            )
            for name in self.names
        }

    def _mean(self, name, counts):
        moved = np.hypot(self.shared, self.own) * np.random.default_rng(0).normal(size=2000)
        chance = self._chance(name, counts, moved[:, None]).mean(axis=0)
        return BEST * (chance + (1.0 - chance) / 4.0)

    def _chance(self, name, samples, moved):
        rise, slope, zero, depth, dip = self.shapes[name]
        place = np.log2(np.maximum(samples, 1e-9))
        risen = 1.0 / (1.0 + np.exp(-(place - rise - moved) / slope))
        first = zero * self.top
        dipped = 2.0 * first * depth * np.exp(-0.5 * (place - dip - 0.5 * moved) ** 2)
        return np.clip(first + (self.top - first) * risen - dipped, 0.01, 0.995)

    @staticmethod
    def _shape(generator, alone):
        rise = generator.uniform(8.0 if alone else 5.5, 10.2)
        slope = generator.uniform(0.35, 0.9)
        zero = 0.02 if alone else generator.uniform(0.02, 0.85)
        depth = 0.0 if alone or generator.random() < 0.5 else generator.uniform(0.0, 0.35)
        return rise, slope, zero, depth, generator.uniform(5.0, 7.0)
