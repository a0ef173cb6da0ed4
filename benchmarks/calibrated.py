"""A stand-in for a study whose agents' metrics are a simulator's: nothing of it is made up but courses between 48 θ.

`python benchmarks/calibrated.py STUDY OUTPUT.csv` makes its table again: 48 Sobol θ of the study are simulated under
its seed, and 24 more under its seed and under a target's: 96 × agents × starts episodes, for benchmarks/truths about
ten minutes of two idle cores. The table has the 48 θ with every agent's mean of the metrics that the stand-in has, the
kernel that fits them, and what another placement changed at the 24.
"""

import csv
import hashlib
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from problems import BOX
from scipy.stats import qmc

from proxytune.arrays import Floats
from proxytune.running import running
from proxytune.scores import Metric, ScoreTable
from proxytune.search import Goal, Trial, Values, from_unit, to_unit
from proxytune.search.likelihood import fit_outputs
from proxytune.seeds import TARGET_OFFSET
from proxytune.space import Space
from proxytune.study import Study, open_study, plan_episodes
from proxytune.usefulness import prpv_of_means

Array = NDArray[np.float64]

TABLE = Path(__file__).with_name("calibrated.csv")
FEATURES = 512
SHRINKAGE = 0.2
"""Share of independent outputs in their correlation, which 48 points do not tell to the last digit."""


METRICS = ("distance", "survival_time", "early_distance", "early_offset")
COMPARED = (Metric("distance"), Metric("survival_time"))
LONGEST, ALMOST = 20.0, 18.5
"""An agent that is not stopped drives for so long [s], and is tied with all that do. If one start of four ends early,
the mean is lower by seconds; so whoever is above the second is taken for one that is not stopped."""
FRESH_DRAWS = 64


@dataclass(frozen=True, eq=False)
class Simulated:
    """What was simulated, and how it changes between."""

    agents: tuple[str, ...]  # their names
    points: Floats  # the θ in the unit cube, shape (n, parameters)
    means: Floats  # the outputs there, shape (n, outputs): every agent's mean metrics
    scales: Floats  # length scale of each parameter, in widths of the box
    smooth: Floats  # variance of each output's smooth course
    rough: Floats  # variance of each output round that, from θ to θ
    placements: Floats  # what another placement of the robot changed at other θ, shape (m, outputs)

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
    """One function through what was simulated: every output over the box, drawn from the Gaussian processes."""

    frequencies: Floats  # of the waves it is made of, shape (parameters, waves)
    phases: Floats  # their phases
    heights: Floats  # their heights in each output, shape (waves, outputs)
    weights: Floats  # what draws it through the points, shape (n, outputs)

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


POINTS, PAIRS = 48, 24


def sobol(dimensions: int, count: int, seed: int) -> Array:
    """The first points of a scrambled Sobol sequence, shape (count, dimensions)."""
    return qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed)).random(64)[:count]


def simulated_means(study: Study, values: Values, seed: int) -> Array:
    """Every agent's mean metrics at a θ, shape (agents × metrics,)."""
    planned = plan_episodes(study.settings, study.settings.space.theta(values), seed)
    with running(study.family, planned, study.settings.jobs) as fleets:
        found = {(o.episode.agent, o.episode.start): o.metrics for fleet in fleets for o in fleet if o.metrics}
    table = ScoreTable.from_episodes({(e.agent, e.start): found[e.agent, e.start] for e in planned})
    return table.select(METRICS).means.ravel()


def table_of(
    space: Space, agents: Sequence[str], points: Sequence[Values], means: Array, pairs: Array
) -> list[list[str]]:
    """The rows of the table.

    Args:
        space: The box.
        agents: Their names.
        points: The θ, in the box.
        means: Shape (points, outputs).
        pairs: Means at other θ under two placements, shape (θ, 2, outputs).
    """
    model = fit_outputs(space, [Trial(values, None, tuple(row)) for values, row in zip(points, means, strict=True)])
    scales, amplitude = model.kernel.k1.k2.length_scale, model.kernel.k1.k1.constant_value
    rough = np.nan_to_num(model.rough)  # an output that never changes is not modelled
    smooth = rough / model.roughness * amplitude
    outputs = [f"{agent}:{metric}" for agent in agents for metric in METRICS]
    blank = [""] * len(space.names)
    rows = [["row", *space.names, *outputs]]
    rows += [["mean", *told(values, 6), *told(row, 5)] for values, row in zip(points, means, strict=True)]
    rows += [["smooth", *told(scales, 4), *told(smooth, 4)], ["rough", *blank, *told(rough, 4)]]
    return [*rows, *(["placement", *blank, *told(row, 3)] for row in pairs[:, 1] - pairs[:, 0])]


def told(values: Iterable[float], digits: int) -> list[str]:
    """Numbers with so many digits."""
    return [f"{value:.{digits}g}" for value in values]


def main(folder: str, output: str) -> None:
    """Simulate, and write the table."""
    study = open_study(Path(folder))
    space, seed = study.settings.space, study.settings.seed
    points = [from_unit(space, unit) for unit in sobol(len(space.names), POINTS, 5)]
    others = [from_unit(space, 0.1 + 0.8 * unit) for unit in sobol(len(space.names), PAIRS, 77)]
    means = np.array([simulated_means(study, values, seed) for values in points])
    pairs = np.array([[simulated_means(study, values, s) for s in (seed, seed + TARGET_OFFSET)] for values in others])
    with Path(output).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table_of(space, study.settings.agents, points, means, pairs))


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    main(*sys.argv[1:])
