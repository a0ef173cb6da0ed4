"""Functions through what a simulator gave at 48 θ: the courses that the stand-in `calibrated` has between them.

`tests/benchmarks/make_calibrated.py` makes the table beside this module from a study.
"""

import csv
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from proxytune.arrays import Floats
from proxytune.comparison.analytic import BOX
from proxytune.search import to_unit

TABLE = Path(__file__).with_name("calibrated.csv")
FEATURES = 512
SHRINKAGE = 0.2
"""Share of independent outputs in their correlation, which 48 points do not tell to the last digit."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """What was simulated, and how it changes between.

    Attributes:
        agents: Their names.
        points: The θ in the unit cube, shape (n, parameters).
        means: The outputs there, shape (n, outputs): every agent's mean metrics.
        scales: Length scale of each parameter, in widths of the box.
        smooth: Variance of each output's smooth course.
        rough: Variance of each output round that, from θ to θ.
        placements: What another placement of the robot changed at other θ, shape (m, outputs).
    """

    agents: tuple[str, ...]
    points: Floats
    means: Floats
    scales: Floats
    smooth: Floats
    rough: Floats
    placements: Floats

    @property
    def roughness(self) -> float:
        """Variance round the smooth course, as a share of its own; outputs have it in common."""
        return float(self.rough.sum() / self.smooth.sum())

    @cached_property
    def standardised(self) -> Floats:
        """The outputs as the smooth course's standard deviations from their mean."""
        deviation = np.sqrt(np.where(self.smooth > 0.0, self.smooth, 1.0))  # an output that never changes stays 0
        return np.asarray((self.means - self.means.mean(axis=0)) / deviation)

    @cached_property
    def lower(self) -> Floats:
        """Lower root of the points' covariance, roughness included; all outputs share it."""
        return lower_root(self.covariance(self.points) + self.roughness * np.eye(len(self.points)))

    @cached_property
    def mixing(self) -> Floats:
        """Lower root of the outputs' correlation, from what is left when the points' nearness is accounted for."""
        left = np.linalg.solve(self.lower, self.standardised)
        unit = left / np.maximum(np.linalg.norm(left, axis=0), 1e-12)
        correlation = (1.0 - SHRINKAGE) * unit.T @ unit + SHRINKAGE * np.eye(unit.shape[1])
        return lower_root(correlation)

    def covariance(self, points: Floats) -> Floats:
        """Matérn 5/2 between points (m, parameters) and those simulated, shape (m, n)."""
        away = np.sqrt(5.0) * np.linalg.norm((points[:, None] - self.points) / self.scales, axis=-1)
        return np.asarray((1.0 + away + away**2 / 3.0) * np.exp(-away))


def lower_root(matrix: Floats) -> Floats:
    """L of a symmetric positive matrix L Lᵀ."""
    return np.asarray(np.linalg.cholesky(matrix), dtype=float)


@cache
def simulated() -> Simulated:
    """The table."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    count = len(BOX.intervals)
    by_kind: dict[str, list[list[str]]] = {}
    for kind, *cells in rows:
        by_kind.setdefault(kind, []).append(cells)
    means = np.array(by_kind["mean"], dtype=float)
    smooth, rough = (np.array(by_kind[kind][0][count:], dtype=float) for kind in ("smooth", "rough"))
    placements = np.array([cells[count:] for cells in by_kind["placement"]], dtype=float)
    points = np.array([to_unit(BOX, tuple(row)) for row in means[:, :count]])
    agents = tuple(dict.fromkeys(name.partition(":")[0] for name in head[count + 1 :]))
    scales = np.array(by_kind["smooth"][0][:count], dtype=float)
    return Simulated(agents, points, means[:, count:], scales, smooth, rough, placements)


@dataclass(frozen=True, eq=False)
class Course:
    """One function through what was simulated: every output over the box, drawn from the Gaussian processes.

    Attributes:
        frequencies: Of the waves it is made of, shape (parameters, waves).
        phases: Their phases.
        heights: Their heights in each output, shape (waves, outputs).
        weights: What draws it through the points, shape (n, outputs).
    """

    frequencies: Floats
    phases: Floats
    heights: Floats
    weights: Floats

    def __call__(self, unit: Floats) -> Floats:
        """Every output at a point of the unit cube, in standard deviations from its mean."""
        return np.asarray(self._waves(unit[None])[0] + (simulated().covariance(unit[None]) @ self.weights)[0])

    def _waves(self, points: Floats) -> Floats:
        return waves(points, self.frequencies, self.phases) @ self.heights


def waves(points: Floats, frequencies: Floats, phases: Floats) -> Floats:
    """Cosines (points, waves) whose sum with normal heights is a draw of the Gaussian process, all but exactly."""
    return np.asarray(np.sqrt(2.0 / len(phases)) * np.cos(points @ frequencies + phases))


@cache
def course(seed: int) -> Course:
    """The seed's functions, by Matheron's rule: a draw without data, plus what its miss at the points asks for."""
    known, generator = simulated(), np.random.default_rng([seed, 2])
    # The spectrum of Matérn 5/2 is Student's with 5 degrees of freedom.
    normal = generator.standard_normal((len(known.scales), FEATURES))
    frequencies = normal / np.sqrt(generator.chisquare(5.0, FEATURES) / 5.0) / known.scales[:, None]
    phases = generator.uniform(0.0, 2.0 * np.pi, FEATURES)
    heights = generator.standard_normal((FEATURES, len(known.smooth))) @ known.mixing.T
    round_it = np.sqrt(known.roughness) * generator.standard_normal(known.means.shape) @ known.mixing.T
    missed = known.standardised - waves(known.points, frequencies, phases) @ heights - round_it
    weights = np.linalg.solve(known.lower @ known.lower.T, missed)
    return Course(frequencies, phases, heights, np.asarray(weights, dtype=float))
