"""How often clocks that are apart are told, and how often that is said of clocks that are not.

    python benchmarks/clock_rates.py [CASES [LOG …]]

prints a line for every miss and false alarm, the counts, and what is said of logs. Every case is a log of twelve drives
of a minute. A jump is missed too if its time is told off by 4 s or more, or another one beside it.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from hidden_cases import CLEAN, IN_FORM, OTHER_FORM, OUTSIDE, Case, make_log

from proxytune.diagnosis import Clocks, robot_of
from proxytune.diagnosis.motion.clocks import read_clocks
from proxytune.driving import read_robot
from proxytune.logs import read_log

EPISODES, ROWS = 12, 1200
SIZES = (0.05, 0.08, 0.12, 0.2, 0.3, 0.4, 0.5)
KINDS = ("constant", "one drive", "jump", "jump in a third", "drift")
PROOF_S = 0.03
"""A constant offset can be told where motion then comes so long before its command."""


class Planted(NamedTuple):
    """A log whose poses are stamped so late (12, 1200) [s], for a kind of reason; in one drive, or from it on."""

    kind: str
    case: Case
    late_s: np.ndarray
    drive: int
    by_s: float
    at_s: float


def planted(kind: str, number: int, hidden: bool) -> Planted:
    """The numbered case of one of KINDS."""
    random = np.random.default_rng((number, len(kind), hidden))
    pool = (*IN_FORM, *OTHER_FORM, *OUTSIDE) if hidden else CLEAN
    case = pool[int(random.integers(len(pool)))]
    by = SIZES[number % len(SIZES)] * (-1.0 if (number // len(SIZES)) % 2 == 0 else 1.0)
    drive, at = int(random.integers(EPISODES)), float(random.uniform(10.0, 50.0))
    late = np.zeros((EPISODES, ROWS))
    if kind == "constant":
        late[:] = by = -abs(by)
    elif kind == "drift":
        late[:] = by / ROWS * np.arange(ROWS)
    else:
        late[_jumping(kind, drive), round(at * 20.0) if kind != "one drive" else 0 :] = by
    return Planted(kind, case, late, drive, by, at)


def _jumping(kind: str, drive: int) -> list[int]:
    """The drives that have another clock, or one that jumps."""
    return [(drive + 3 * k) % EPISODES for k in range(4)] if kind == "jump in a third" else [drive]


def identifiable(one: Planted) -> bool:
    """Whether motion comes before its command, which is all that can tell a constant offset; others always can."""
    return one.kind != "constant" or one.case.delay + one.by_s < -PROOF_S


def told(one: Planted, found: Clocks) -> bool:
    """Whether what was planted was told, with its size, and nothing else."""
    name = f"{one.drive:02d}"
    if one.kind == "constant":
        return bool(found.offset.value) and abs(found.offset.value - one.by_s - one.case.delay + 0.15) < 0.05
    if found.offset.value:
        return False
    if one.kind == "drift":
        return abs(found.drift.value * ROWS / 20.0 - one.by_s) < 0.02 and not (found.drives or found.jumps)
    if one.kind == "one drive":
        return set(found.drives) == {name} and abs(found.drives[name].value - one.by_s) < 0.03 and not found.jumps
    drives = {f"{drive:02d}" for drive in _jumping(one.kind, one.drive)}
    right = [jump.drive in drives and abs(jump.time_s - one.at_s) < 4.0 for jump in found.jumps]
    return {jump.drive for jump in found.jumps} == drives and all(right)


def read(case: Case, late_s: np.ndarray | float) -> tuple[Clocks, float]:
    """The clocks of a log with what they took [s of processor time]."""
    log = make_log(case, late_s=late_s)
    began = time.process_time()
    found = read_clocks(log, read_robot("duckiebot"))
    return found, time.process_time() - began


def main(cases: int, logs: Sequence[Path]) -> None:
    """Count and print."""
    seconds = []
    for kind in KINDS:
        for hidden in (False, True):
            all_planted = [planted(kind, number, hidden) for number in range(3 * cases)]
            chosen = [one for one in all_planted if identifiable(one)][:cases]
            hits = 0
            for one in chosen:
                found, took = read(one.case, one.late_s)
                seconds.append(took)
                hit = told(one, found)
                hits += hit
                if not hit:
                    size = f"{one.by_s:+.2f} s in drive {one.drive} at {one.at_s:.0f} s, delay {one.case.delay:.2f}"
                    print(f"missed: {kind}, {one.case.name}, {size}: {_said(found)}", flush=True)
            print(
                f"{kind}, {'with' if hidden else 'without'} a hidden effect: told {hits} of {len(chosen)}", flush=True
            )
    for name, pool in (("clean", CLEAN), ("hidden effect", (*IN_FORM, *OTHER_FORM, *OUTSIDE))):
        alarms = 0
        for case in pool:
            found, took = read(case, 0.0)
            seconds.append(took)
            alarms += found.differ
            if found.differ:
                print(f"false alarm: {case.name}: {_said(found)}", flush=True)
        print(f"{name}, one clock: false alarms {alarms} of {len(pool)}", flush=True)
    print(f"processor time per log: median {np.median(seconds):.2f} s, most {max(seconds):.2f} s")
    for folder in logs:
        log = read_log(folder)
        if log.command != "none":
            print(f"{folder.name}: {_said(read_clocks(log, robot_of(log)))}", flush=True)


def _said(found: Clocks) -> str:
    low, high = found.latency.interval
    apart = {name: round(one.value, 3) for name, one in found.drives.items()}
    jumps = [(jump.drive, round(jump.time_s), round(jump.by_s, 3)) for jump in found.jumps]
    latency = f"latency {found.latency.value:.3f} ({low:.3f} to {high:.3f}) s"
    return f"{latency}, offset {found.offset.value:.3f} s, drives {apart}, jumps {jumps}"


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40, [Path(word) for word in sys.argv[2:]])
