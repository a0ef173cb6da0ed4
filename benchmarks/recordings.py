"""Whether every form of a recording is diagnosed alike: `python benchmarks/recordings.py OUTPUT [--seeds N]`.

A robot of nobody's (`tests/fakes/foreign_robot.py`) is recorded by a tracker on the robot's clock, on one 0.25 s early,
and on one 0.1 s late, as a bag, a TUM trajectory or a table in turn, and its log diagnosed as `diagnose` does. OUTPUT
gets a line each; a run that was stopped goes on where it was.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "fakes"))

import foreign_robot

from proxytune.diagnosis import diagnose_log, robot_of
from proxytune.importing import Facts, open_log

OFFSETS_S = (0.0, -0.25, 0.1)
FACTS = Facts(robot="nobodys", figures=foreign_robot.FIGURES)
EXPECTED = {"dead_band", "wheel_gain", "motor_lag"}


def diagnosed(form: str, seed: int, offset_s: float, count: int, seconds: float) -> dict[str, Any]:
    """What diagnose says of one recording of so many drives, each so long [s]."""
    begin = time.process_time()
    drives = [foreign_robot.drive(100 * seed + k, seconds=seconds, offset_s=offset_s) for k in range(count)]
    with tempfile.TemporaryDirectory() as home:
        path = foreign_robot.write_form(Path(home), form, drives)
        with open_log(path, facts=FACTS) as (log, _):
            motion = diagnose_log(log, robot_of(log)).motion
    assert motion is not None
    (clocks, *_) = motion.clocks
    two = next(one for one in motion.errors if one.horizon_s == 2.0)
    return {
        "form": form,
        "seed": seed,
        "offset_s": offset_s,
        "verdict": motion.verdict,
        "effects": sorted(effect.effect for effect in motion.effects),
        "theta": {name: one.value for name, one in motion.theta.items()},
        "told_offset_s": clocks.offset.value,
        "latency_s": clocks.latency.value,
        "before_mm": 1e3 * two.before.value,
        "after_mm": 1e3 * two.after.value,
        "floor_mm": [1e3 * two.floor.lower, 1e3 * two.floor.upper],
        "seconds": time.process_time() - begin,
    }


def rows_of(path: Path) -> list[dict[str, Any]]:
    """The lines that there are."""
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def main(words: Sequence[str] | None = None) -> None:
    """Diagnose what is not yet, and count."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("output", type=Path)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--drives", type=int, default=6)
    parser.add_argument("--length", type=float, default=40.0, help="of a drive [s]")
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args(words)
    wanted = [
        (foreign_robot.FORMS[(seed + turn) % len(foreign_robot.FORMS)], seed, offset)
        for seed in range(1, asked.seeds + 1)
        for turn, offset in enumerate(OFFSETS_S)
    ]
    known = {(row["form"], row["seed"], row["offset_s"]) for row in rows_of(asked.output)}
    tasks = (delayed(diagnosed)(*one, asked.drives, asked.length) for one in wanted if one not in known)
    for row in Parallel(n_jobs=asked.jobs, return_as="generator_unordered", pre_dispatch="n_jobs")(tasks):
        with asked.output.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(row["form"], row["seed"], row["offset_s"], row["verdict"], row["effects"], file=sys.stderr, flush=True)
    print(report(rows_of(asked.output)))


def report(rows: Sequence[dict[str, Any]]) -> str:
    """The counts, for each offset and over all."""
    lines = []
    for offset in OFFSETS_S:
        own = [row for row in rows if row["offset_s"] == offset]
        named = [set(row["effects"]) - {"delay"} for row in own]
        right = sum(row["verdict"] == "explained" for row in own)
        told = [row["told_offset_s"] for row in own if row["told_offset_s"]]
        lines.append(
            f"poses stamped {offset:+.2f} s: {len(own)} recordings; named {sum(n >= EXPECTED for n in named)}, nothing "
            f"beside {sum(n <= EXPECTED for n in named)}, explained {right}; "
            f"offset told {len(told)}" + (f" ({min(told):.3f} to {max(told):.3f} s)" if told else "")
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
