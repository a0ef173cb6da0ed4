"""Makes the table of the stand-in `calibrated` again: `python tests/benchmarks/make_calibrated.py STUDY OUTPUT.csv`.

48 Sobol θ of the study are simulated under its seed, and 24 more under its seed and under a target's: 96 × agents ×
starts episodes, for studies/truths about ten minutes of two idle cores. What is written: the 48 θ with every agent's
mean of the metrics that the stand-in has, the kernel that fits them, and what another placement changed at the 24.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from proxytune.comparison.calibrated import METRICS
from proxytune.running import running
from proxytune.scores import ScoreTable
from proxytune.search import Trial, from_unit
from proxytune.search.likelihood import fit_outputs
from proxytune.seeds import TARGET_OFFSET
from proxytune.study import open_study, plan

POINTS, PAIRS = 48, 24


def sobol(dimensions, count, seed):
    return qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed)).random(64)[:count]


def simulated(study, values, seed):
    """Every agent's mean metrics at a θ, shape (agents × metrics,)."""
    planned = plan(study.settings, study.settings.space.theta(values), seed)
    with running(study.family, planned, study.settings.jobs) as outcomes:
        found = {(o.episode.agent, o.episode.start): o.metrics for o in outcomes}
    table = ScoreTable.from_episodes({(e.agent, e.start): found[e.agent, e.start] for e in planned})
    return table.select(METRICS).means.ravel()


def table_of(space, agents, points, means, pairs):
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


def told(values, digits):
    return [f"{value:.{digits}g}" for value in values]


def main(folder, output):
    study = open_study(Path(folder))
    space, seed = study.settings.space, study.settings.seed
    points = [from_unit(space, unit) for unit in sobol(len(space.names), POINTS, 5)]
    others = [from_unit(space, 0.1 + 0.8 * unit) for unit in sobol(len(space.names), PAIRS, 77)]
    means = np.array([simulated(study, values, seed) for values in points])
    pairs = np.array([[simulated(study, values, s) for s in (seed, seed + TARGET_OFFSET)] for values in others])
    with Path(output).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table_of(space, study.settings.agents, points, means, pairs))


if __name__ == "__main__":
    main(*sys.argv[1:])
