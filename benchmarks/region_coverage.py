"""Does the 95 % region hold the truth? `python benchmarks/region_coverage.py OUTPUT [--truths 40] [--trials 24]`.

The trials are a quasi-random design of benchmarks/truths, shared by all truths, so each truth costs one evaluation: its
target, measured under other placement noise. Nothing is searched. Then the same for targets with an effect that the
proxy lacks, in turn those of the study's folder. Episodes are kept in OUTPUT/study.db, so it may be stopped and run on.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from study_problems import MIDDLE, lacking_families

from proxytune.running import Bars
from proxytune.search import Trial, from_unit, learn_theta, unit_points
from proxytune.seeds import TARGET_OFFSET
from proxytune.storage import Store
from proxytune.study import StudyRun, goal_of, open_study, outputs_of, plan_episodes, run_preflight, score_table

STUDY = Path(__file__).resolve().parent / "truths"
DESIGN_SEED, TRUTH_SEED = 5, 77


def driven(study, store, watcher, values, seed):
    """The episodes of a θ under a seed."""
    planned = plan_episodes(study.settings, study.settings.space.theta(values), seed)
    StudyRun(study, store, watcher).outcomes(planned, f"seed {seed}")
    return list(StudyRun(study, store).known(planned).values())


def known_of(study, store, watcher, trials, values, family, seed):
    """What the trials say of a target that is measured at a θ."""
    there = replace(study, family=family, identity=family.identity)
    target = score_table(driven(there, store, watcher, values, seed)).select(study.target.metrics)
    return learn_theta(study.settings.space, trials, goal_of(StudyRun(replace(study, target=target), store)), seed)


def told(name, found, truths):
    """One line of coverage, volume and misfit."""
    holds = [one.holds(values) for one, values in zip(found, truths, strict=True)]
    shares = [one.posterior.share for one in found]
    print(f"{name}: the 95 % region holds the truth in {sum(holds)} of {len(holds)}; median share of the box", end=" ")
    print(f"{100 * np.median(shares):.2f} %; misfit said in {sum(one.misfit.fits is False for one in found)}")
    for column, parameter in enumerate(found[0].space.names):
        pairs = zip(found, truths, strict=True)
        inside = sum(one.intervals[parameter][0] <= v[column] <= one.intervals[parameter][1] for one, v in pairs)
        widths = [np.diff(one.posterior.intervals[column])[0] for one in found]
        print(f"  {parameter}: interval holds it in {inside}; median width {np.median(widths):.2f} of the range")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("output", type=Path)
    parser.add_argument("--truths", type=int, default=40)
    parser.add_argument("--trials", type=int, default=24)
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    study = open_study(STUDY)
    space, models = study.settings.space, sorted(STUDY.glob("lacks_*.toml"))
    points = [from_unit(space, unit) for unit in unit_points(len(space.intervals), given.trials, DESIGN_SEED)]
    low, high = MIDDLE
    cloud = low + (high - low) * unit_points(len(space.intervals), given.truths, TRUTH_SEED)
    truths = [from_unit(space, unit) for unit in cloud]
    total = (given.trials + given.truths + 2 * len(models) + 8) * len(study.settings.agents) * study.settings.starts
    with Store.open(given.output) as store, Bars(total) as bars:
        study_run = StudyRun(study, store, bars)
        run_preflight(study_run)
        seed = study.settings.seed
        trials = [Trial(v, 0.0, outputs_of(study, driven(study, store, bars, v, seed))) for v in points]
        seeds = range(TARGET_OFFSET + 1, TARGET_OFFSET + 1 + given.truths)
        found = [
            known_of(study, store, bars, trials, values, study.family, number)
            for values, number in zip(truths, seeds, strict=True)
        ]
        told(f"{given.truths} truths, {given.trials} trials", found, truths)
        for name, family in zip(models, lacking_families(study, models), strict=True):
            both = truths[:2]
            lacking = [
                known_of(study, store, bars, trials, v, family, TARGET_OFFSET + 1 + n) for n, v in enumerate(both)
            ]
            p_values = ", ".join(f"{one.misfit.p_value:.3f}" for one in lacking)
            print(f"{name.stem}: misfit of two truths p = {p_values}")


if __name__ == "__main__":
    main()
