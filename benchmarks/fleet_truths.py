"""What does `fleet` tell of robots whose θ is known? `python benchmarks/fleet_truths.py KINEMATICS.csv OUTPUT`.

Robots drive the agents of the shipped bank on the planar plant. Their trim is that of real Duckiebots, drawn from
KINEMATICS.csv (a column `trim`); delay, blur and camera pitch are drawn from normal distributions. OUTPUT keeps their
tables of scores, so it may be stopped and run on. Prints a table in Markdown.
"""

import argparse
import functools
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from proxytune.api import FleetReport, fleet
from proxytune.arrays import Floats
from proxytune.files import shipped
from proxytune.running import run_together
from proxytune.scores import write_scores
from proxytune.seeds import target_seed
from proxytune.study import Study, open_bank, plan_episodes, read_study_settings, score_table

BANK = "duckiebot_bank"
ROBOTS, FLEETS = 24, 3
PLANTED: Mapping[str, tuple[float, float]] = {"delay": (0.12, 0.03), "blur": (0.04, 0.012), "camera_pitch": (19.0, 2.5)}
"""Mean and standard deviation of what is not measured of real robots."""
MIDDLE = (0.05, 0.95)
"""Share of the bank's box that robots are drawn from: a θ outside is none that a bank can tell."""


@functools.cache
def bank() -> Study:
    """The shipped bank."""
    return open_bank(read_study_settings(shipped("studies") / BANK))


def truths(trims: Floats, number: int) -> pd.DataFrame:
    """θ of each robot of a fleet, a row each."""
    rng, rows = np.random.default_rng(number), {}
    for box in bank().settings.space.intervals:
        low, high = (box.low + share * (box.high - box.low) for share in MIDDLE)
        if box.name == "trim":
            drawn = rng.choice(trims[(trims > low) & (trims < high)], ROBOTS, replace=False)
        else:
            drawn = np.clip(rng.normal(*PLANTED[box.name], ROBOTS), low, high)
        rows[box.name] = drawn
    return pd.DataFrame(rows, index=[f"robot{row:02d}" for row in range(ROBOTS)])


def drive(known: pd.DataFrame, number: int, output: Path) -> list[Path]:
    """Drive what is missing of a fleet; its tables of scores."""
    study, paths = bank(), [output / f"fleet{number}" / f"{name}.csv" for name in known.index]
    for row, path in enumerate(paths):
        if not path.exists():
            planned = plan_episodes(study.settings, dict(known.iloc[row]), target_seed(1000 * number + row))
            path.parent.mkdir(parents=True, exist_ok=True)
            write_scores(score_table(run_together(study.family, planned) or ()), path)
    return paths


def row_of(report: FleetReport, known: pd.DataFrame, name: str) -> tuple[Floats, Floats]:
    """What is told of a parameter: figures that are added up, and mean and spread beside the truth."""
    told, population = report.robots().xs(name, level="parameter"), report.population().loc[name]
    truth, own = known[name].to_numpy(), told[["low", "high"]].to_numpy()
    given = told[["fleet_low", "fleet_middle", "fleet_high"]].to_numpy()
    row, (box,) = list(known).index(name), [one for one in bank().settings.space.intervals if one.name == name]
    middle = [box.low + (box.high - box.low) * one.knowledge.unwidened.mean[row] for one in report.result.robots]
    added = [
        ((own[:, 0] <= truth) & (truth <= own[:, 1])).sum(),
        ((given[:, 0] <= truth) & (truth <= given[:, 2])).sum(),
        ((np.array(middle) - truth) ** 2).sum(),
        ((given[:, 1] - truth) ** 2).sum(),
        ((population["robots_low"] <= truth) & (truth <= population["robots_high"])).sum(),
    ]
    wanted = [truth.mean(), truth.std(ddof=1)]
    ends = population[[f"{key}_{end}" for key in ("mean", "deviation") for end in ("low", "middle", "high")]]
    return np.array(added), np.array([*wanted, *ends])


def main() -> None:
    """Drive what is missing, and print what is told."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinematics", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--first", type=int, default=4, help="number of the first fleet [4]; 1 to 3 were tuned on")
    arguments = parser.parse_args()
    trims = pd.read_csv(arguments.kinematics)["trim"].to_numpy()
    numbers = range(arguments.first, arguments.first + FLEETS)
    known = {number: truths(trims, number) for number in numbers}
    reports = {n: fleet(shipped("studies") / BANK, drive(known[n], n, arguments.output)) for n in numbers}
    count = FLEETS * ROBOTS
    print(f"left out: {[one.result.left_out for one in reports.values()]}\n")
    print("| parameter | own holds θ | given the fleet | RMS error: own, given the fleet | 95 % of robots holds |")
    print("|---|---|---|---|---|")
    for name in next(iter(known.values())).columns:
        own, given, own_error, error, held = sum(row_of(reports[n], known[n], name)[0] for n in numbers)
        errors = f"{np.sqrt(own_error / count):.3g}, {np.sqrt(error / count):.3g}"
        print(f"| {name} | {own:.0f} of {count} | {given:.0f} of {count} | {errors} | {held:.0f} of {count} |")
    print("\n| parameter | fleet | mean: true, told | standard deviation: true, told |")
    print("|---|---|---|---|")
    for name in next(iter(known.values())).columns:
        for number in numbers:
            mean, spread, *ends = row_of(reports[number], known[number], name)[1]
            told = ["{1:.3g} ({0:.3g} to {2:.3g})".format(*three) for three in (ends[:3], ends[3:])]
            print(f"| {name} | {number} | {mean:.3g}, {told[0]} | {spread:.3g}, {told[1]} |")


if __name__ == "__main__":
    main()
