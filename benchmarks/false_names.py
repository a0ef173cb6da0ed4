"""How many effects that are not there are named: `python benchmarks/false_names.py OUTPUT [--logs N] [--jobs N]`.

Every log is of a robot that its model knows: trim and delay are declared, and nothing else is hidden. What differs is
the noise of its poses, of four kinds, and what is wrong with its tracker. N logs of each pair are diagnosed, ten
seconds of processor time each, and added to OUTPUT one by one: a run that was stopped goes on where it was. At the end
comes a table: in how many logs an effect was named, and which.
"""

import argparse
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from unittest import mock

import hidden_cases as first
import numpy as np
import second_hidden_cases as second
from joblib import Parallel, delayed
from rates import FLAGGED
from scipy.signal import lfilter

import proxytune.diagnosis.motion.diagnose as diagnosing
from proxytune.driving import read_robot
from proxytune.logs import Log, LogEpisode

Array = np.ndarray
DRIVES, SECONDS, ROW_S = 6, 40.0, 0.05

NOISES = ("white", "loud", "heavy", "coloured")
"""White, twice as much of it, Student's t with 5 degrees of freedom, and half of it remembered for 0.15 s."""


def unchanged(random: np.random.Generator, times: Array, poses: Array, noise: Array) -> Array:
    """A tracker with noise and nothing else."""
    return poses + noise


def clock_drifts(random: np.random.Generator, times: Array, poses: Array, noise: Array) -> Array:
    """Its clock runs 0.1 to 0.4 % fast or slow, in every drive."""
    rate = random.choice((-1.0, 1.0)) * random.uniform(0.001, 0.004)
    return _stamped_late(times, poses, np.broadcast_to(rate * times, poses.shape[:2])) + noise


def clock_jumps(random: np.random.Generator, times: Array, poses: Array, noise: Array) -> Array:
    """Its clock jumps by 0.05 to 0.3 s in the middle of one drive."""
    late = np.zeros(poses.shape[:2])
    after = times > random.uniform(0.25, 0.75) * times[-1]
    late[random.integers(len(poses)), after] = random.choice((-1.0, 1.0)) * random.uniform(0.05, 0.3)
    return _stamped_late(times, poses, late) + noise


def bursts_missing(random: np.random.Generator, times: Array, poses: Array, noise: Array) -> Array:
    """It loses the robot five times a drive, for 0.3 to 2 s."""
    seen = poses + noise
    for drive in seen:
        for begin in random.uniform(1.0, times[-1], 5):
            drive[(times > begin) & (times < begin + random.uniform(0.3, 2.0))] = np.nan
    return seen


def outliers(random: np.random.Generator, times: Array, poses: Array, noise: Array) -> Array:
    """One pose of a hundred is up to half a metre and half a turn off."""
    wrong = random.random(poses.shape[:2]) < 0.01
    return poses + noise + wrong[..., None] * random.uniform(-1.0, 1.0, poses.shape) * (0.5, 0.5, np.pi)


def lagging(random: np.random.Generator, times: Array, poses: Array, noise: Array) -> Array:
    """Its filter follows the robot with a lag of 0.03 to 0.1 s."""
    kept = np.exp(-ROW_S / random.uniform(0.03, 0.1))
    begin = poses[:, :1]
    return lfilter([1.0 - kept], [1.0, -kept], poses - begin, axis=1) + begin + noise


TRACKERS: Mapping[str, Callable[[np.random.Generator, Array, Array, Array], Array]] = {
    "nothing else": unchanged,
    "clock drifts": clock_drifts,
    "clock jumps": clock_jumps,
    "bursts missing": bursts_missing,
    "outliers": outliers,
    "lagging": lagging,
}


def _stamped_late(times: Array, poses: Array, late_s: Array) -> Array:
    """What rows show whose stamps are so much too late (drives, rows) [s]; NaN where the drive had not begun."""
    seen = [
        np.stack([np.interp(times - late, times, column, left=np.nan, right=np.nan) for column in drive.T], axis=-1)
        for drive, late in zip(poses, late_s, strict=True)
    ]
    return np.array(seen)


def make_log(tracker: str, noise: str, number: int) -> Log:
    """The numbered log of a robot without a secret, under such noise, by such a tracker."""
    random = np.random.default_rng([list(TRACKERS).index(tracker), NOISES.index(noise), number])
    seed, rows = int(random.integers(2**31)), round(SECONDS / ROW_S)
    trim, delay = float(random.uniform(-0.1, 0.1)), float(random.uniform(0.1, 0.2))
    name = f"{tracker}, {noise}, {number}"
    if noise in ("white", "loud"):
        case = replace(
            first.CLEAN[0], seed=seed, trim=trim, delay=delay, noise={"white": "normal"}.get(noise, "double")
        )
        drives = first.make_drives(seed, DRIVES, rows)
        poses, duties = first.true_poses(case, drives, first.LEVELS[case.noise]), drives.duties
        noises = first.measured(poses, case, first.LEVELS[case.noise]) - poses
    else:
        other = replace(second.CLEAN[0], seed=seed, trim=trim, delay=delay, noise=f"normal {noise}")
        course = second.plan(seed, DRIVES, rows)
        poses, duties = second.driven(other, course, 1.0), course.duties
        noises = second.noisy(other, poses.shape)
    times = np.arange(poses.shape[1]) * ROW_S
    seen = TRACKERS[tracker](random, times, poses, noises)
    one = (LogEpisode(f"{e:02d}", times, duties[e], seen[e], None) for e in range(DRIVES))
    return Log(name, "duckiebot", "duty", 1.0 / ROW_S, {}, tuple(one))


def diagnosed(tracker: str, noise: str, number: int) -> dict[str, object]:
    """What is named of it."""
    robot = read_robot("duckiebot")
    with mock.patch.object(diagnosing, "has_body", return_value=False):  # Bullet confirms, it names nothing
        found = diagnosing.diagnose(make_log(tracker, noise, number), robot, diagnosing.declared_effects(robot))
    return {
        "tracker": tracker,
        "noise": noise,
        "number": number,
        "names": [effect.effect for effect in found.effects],
        "verdict": found.verdict,
        "at_most": found.expected_false_names,
    }


def main(output: Path, logs: int, jobs: int) -> None:
    """Diagnose what is left, and print the table."""
    output.parent.mkdir(parents=True, exist_ok=True)
    lines = output.read_text(encoding="utf-8").splitlines() if output.exists() else []
    rows = [json.loads(line) for line in lines]
    done = {(row["tracker"], row["noise"], row["number"]) for row in rows}
    left = [one for n in range(logs) for t in TRACKERS for k in NOISES if (one := (t, k, n)) not in done]
    with output.open("a", encoding="utf-8") as file:
        for row in Parallel(jobs, return_as="generator_unordered")(delayed(diagnosed)(*one) for one in left):
            print(json.dumps(row), file=file, flush=True)
            rows.append(row)
    print(f"{'tracker':16s} {'logs':>4s} {'with a false name':>18s}  {'flagged':>7s}  names")
    for tracker in (*TRACKERS, "all"):
        some = [row for row in rows if tracker in (row["tracker"], "all")]
        wrong = [row for row in some if row["names"]]
        flagged = sum(row["verdict"] in FLAGGED for row in some)
        names = "; ".join(f"{row['noise']} {row['number']}: {', '.join(row['names'])}" for row in wrong)
        print(
            f"{tracker:16s} {len(some):4d} {len(wrong):18d}  {flagged:7d}  {names if tracker != 'all' else ''}".rstrip()
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("output", type=Path)
    parser.add_argument("--logs", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    main(arguments.output, arguments.logs, arguments.jobs)
