"""Write cases: `python benchmarks/missing_effects/write.py DIR [--cases N] [--generators NAME,…] [--seed N]`.

DIR/cases holds what an entry may know of each robot, DIR/truth what it may not. Cases are drawn at random, kinds and
generators by turns; more cases of the same seed begin with the same ones.
"""

import argparse
import inspect
import json
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, zip_longest
from pathlib import Path
from zlib import crc32

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))

from missing_effects.cases import Drive, errors, write_drives, write_poses
from rates import GENERATORS, Job, all_jobs

from proxytune.diagnosis import RANDOM_EFFECTS
from proxytune.driving import Robot, read_robot
from proxytune.effects import DRIVES, Stage
from proxytune.logs import COMMANDS, Log

KINDS = ("in form", "outside", "clean", "other form", "pair")
"""Kinds of cases, in the order in which they take turns."""

DRIVES_TO_LEARN, DRIVES_HELD_OUT, DRIVE_S = 12, 4, 60.0


def drawn(count: int, generators: Sequence[str], seed: int) -> tuple[Job, ...]:
    """So many cases, kinds by turns and in each kind the generators by turns; all that there are for 0."""
    random = np.random.default_rng(seed)
    pools = [_by_turns(_shuffled(_jobs(name, kind), random) for name in generators) for kind in KINDS]
    jobs = _by_turns(pools)
    return jobs[:count] if count else jobs


def _jobs(generator: str, kind: str) -> list[Job]:
    return [job for job in all_jobs(1, generator) if job.kind == kind]


def _shuffled(jobs: list[Job], random: np.random.Generator) -> list[Job]:
    return [jobs[number] for number in random.permutation(len(jobs))]


def _by_turns(parts: Iterable[Sequence[Job]]) -> tuple[Job, ...]:
    return tuple(job for job in chain.from_iterable(zip_longest(*parts)) if job is not None)


def write_case(folder: Path, name: str, job: Job, drives: int = DRIVES_TO_LEARN, seconds: float = DRIVE_S) -> None:
    """Write one case and, apart from it, its truth."""
    generator, own = GENERATORS[job.generator], folder / "cases" / name
    robot = read_robot(getattr(generator, "ROBOT", "duckiebot"))
    log = generator.make_log(job.case, episodes=drives, seconds=seconds)
    other = replace(job.case, seed=crc32(f"held out {job.case.name}".encode()))
    seen, quiet = (
        generator.make_log(other, episodes=DRIVES_HELD_OUT, seconds=seconds, noiseless=still) for still in (False, True)
    )
    _write_log(own / "log", _drives(log), log, robot.name)
    first = [
        replace(one, poses=np.where(np.arange(len(one.times))[:, None] == 0, one.poses, np.nan))
        for one in _drives(seen)
    ]
    _write_log(own / "held_out", first, seen, robot.name)
    _write_json(own / "robot.json", _figures(robot, log))
    measured, floor = [one.poses for one in _drives(seen)], [one.poses for one in _drives(quiet)]
    write_poses(folder / "truth" / f"{name}.csv", _drives(seen), measured)
    draws = {one for names in job.right for one in names} & set(RANDOM_EFFECTS)
    truth = {
        "kind": job.kind,
        "generator": job.generator,
        "name": job.case.name,
        "missing": [list(names) for names in job.right],
        "hidden": getattr(job.case, "effects", getattr(job.case, "changed", ())),
        "depends_on": job.case.depends_on,
        "delay_s": job.case.delay,
        "offset": getattr(job.case, "trim", getattr(job.case, "offset", 0.0)),
        "floor_m": None if draws else errors(floor, measured, 1.0 / seen.rate_hz),
    }
    _write_json(folder / "truth" / f"{name}.json", truth)


def _drives(log: Log) -> list[Drive]:
    return [Drive(e.name, e.times, e.commands, e.poses) for e in log.episodes]


def _write_log(folder: Path, drives: Iterable[Drive], log: Log, robot: str) -> None:
    write_drives(folder / "samples.csv", drives, COMMANDS[log.command])
    text = f'format = 1\nrobot = "{robot}"\ncommand = "{log.command}"\nrate_hz = {log.rate_hz:g}\nmeasured = false\n'
    (folder / "log.toml").write_text(text, encoding="utf-8")


def _figures(robot: Robot, log: Log) -> Mapping[str, object]:
    """The robot as its maker states it."""
    known, theta = robot.figures, robot.theta
    shared = {
        "name": robot.name,
        "drive": robot.drive,
        "command": log.command,
        "full_speed_m_s": known["full_speed"],
        "delay_s": theta["delay"],
        "motor_time_constant_s": known["motor_time_constant"],
    }
    if robot.drive == "differential":
        return shared | {"wheel_radius_m": known["wheel_radius"], "baseline_m": known["effective_baseline"]}
    lock, lag = known["wheel_angle"], theta["steering_lag"]
    return shared | {"wheelbase_m": known["wheelbase"], "full_lock_deg": lock, "steering_time_constant_s": lag}


def catalogue() -> Mapping[str, Mapping[str, str]]:
    """By kind of drive, the names that an entry may give, each with its meaning."""
    declared = {"trim", "delay", "steering_offset"}
    stages = (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION, Stage.MEASUREMENT)
    return {
        drive: {
            name: (inspect.getdoc(effect) or "").split("\n\n")[0].replace("\n", " ")
            for name, effect in known.items()
            if effect.stage in stages and name not in declared
        }
        for drive, known in DRIVES.items()
    }


def _write_json(file: Path, document: object) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def main() -> None:
    """Write every case asked for; those that are there are written again."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--cases", type=int, default=0, help="how many; all that there are, if not said")
    # Where nothing is an effect there is none of KINDS but clean ones.
    named = ",".join(name for name, cases in GENERATORS.items() if not hasattr(cases, "PHYSICS"))
    parser.add_argument("--generators", default=named, help="whose cases")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    asked = parser.parse_args()
    names = asked.generators.split(",")
    if unknown := [name for name in names if name not in GENERATORS]:
        parser.error(f"no generator '{unknown[0]}'; there are {', '.join(GENERATORS)}")
    jobs = drawn(asked.cases, names, asked.seed)
    _write_json(asked.folder / "catalogue.json", catalogue())
    for number, job in enumerate(jobs, 1):
        write_case(asked.folder, f"case_{number:03d}", job)
        print(f"{number} of {len(jobs)}", file=sys.stderr, flush=True)
    counts = Counter(job.kind for job in jobs)
    print(f"{len(jobs)} cases: {', '.join(f'{counts[kind]} {kind}' for kind in KINDS)}")


if __name__ == "__main__":
    main()
