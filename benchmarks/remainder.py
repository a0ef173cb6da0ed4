"""What the learnt remainder is worth on drives that were not fitted, case by case and log by log.

    python benchmarks/remainder.py [--episodes N] [--seconds S] [--names] CASE …
    python benchmarks/remainder.py [--names] FOLDER …

A CASE is one of hidden_cases.py ("outside", "clean" and "in form" stand for many), a FOLDER is a log's.
Without `--names` the search for named effects is left out: the remainder is learnt beside what is declared alone.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import rates
from hidden_cases import CLEAN, IN_FORM, OTHER_FORM, OUTSIDE, PAIRS, make_log

from proxytune.diagnosis import cut, pose_errors, robot_of
from proxytune.diagnosis.motion.clocks import split
from proxytune.diagnosis.motion.diagnose import declared_effects, declared_parameters
from proxytune.diagnosis.motion.discrepancy import HORIZONS_S, fit_discrepancy
from proxytune.diagnosis.motion.fitting import fit
from proxytune.diagnosis.motion.selection import fit_declared, search
from proxytune.effects import PARAMETERS
from proxytune.logs import read_log

CASES = {case.name: case for case in (*IN_FORM, *OTHER_FORM, *PAIRS, *OUTSIDE, *CLEAN)}
STAND_FOR = {"outside": OUTSIDE, "clean": CLEAN[:10], "in form": IN_FORM[::6]}


def errors(drives, theta):
    """RMSE of position [mm] by horizon, NaN where there are no windows."""
    found = []
    for horizon_s in HORIZONS_S:
        windows = cut(drives, horizon_s)
        squares = pose_errors(drives, theta, windows)[:, 0] ** 2 if len(windows.begin) else np.array([np.nan])
        found.append(1e3 * float(np.sqrt(squares.mean())))
    return found


def row(name, log, true_mm, names):
    """One line of the table."""
    robot, began = robot_of(log), time.process_time()
    parts = split(log, robot, None)
    declared = declared_parameters(declared_effects(robot))
    start = {one: robot.theta.get(one, PARAMETERS[one].neutral_value(robot.figures)) for one in declared}
    if names:
        found = search(fit_declared(parts.fitted, start, declared), 1, lambda _: None)
        models = {"before": found.declared.theta, "names": found.model.theta}
    else:
        models = {"before": fit(parts.fitted, start, tuple((one,) for one in declared)).theta}
    best = list(models.values())[-1]
    learnt = fit_discrepancy(parts.fitted, best)
    models["learnt"] = {**best, **learnt.theta}
    told = {kind: " ".join(f"{value:7.1f}" for value in errors(parts.tested, theta)) for kind, theta in models.items()}
    guard = " ".join(f"{h:g}s {one.value:.2f}<{one.interval[1]:.2f}" for h, one in learnt.guard.items())
    shares = ", ".join(f"{title} {100 * share:.0f} %" for title, share in learnt.share.items()) or "nothing"
    columns = " | ".join(f"{kind} {numbers}" for kind, numbers in told.items())
    seconds = time.process_time() - began
    verdict = "used   " if learnt.used else "refused"
    return f"{name:34s} {verdict} {columns} | true 2 s {true_mm:6.1f} | {guard or '-'} | {shares} | {seconds:.1f} s"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="+")
    parser.add_argument("--episodes", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--names", action="store_true")
    given = parser.parse_args()
    print(f"RMSE of position at 1, 2 and 5 s on drives not fitted [mm]; {given.episodes} x {given.seconds:g} s a case")
    for what in given.what:
        if Path(what).is_dir():
            print(row(Path(what).name, read_log(Path(what)), np.nan, given.names), flush=True)
            continue
        for case in STAND_FOR.get(what) or (CASES[what],):
            log = make_log(case, episodes=given.episodes, seconds=given.seconds)
            tested = split(log, robot_of(log), None).tested
            true = rates._true_error(rates.Job("outside", case), tested, given.episodes, given.seconds)
            print(row(case.name, log, 1e3 * true, given.names), flush=True)


if __name__ == "__main__":
    main()
