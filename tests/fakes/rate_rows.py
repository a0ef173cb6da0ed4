"""Rows of rates.py as lines of JSON, kept in a file that grows as cases are diagnosed."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rate_jobs import GENERATORS, Job, all_jobs
from rates import Row

NUMBERS = ("before", "after", "learnt", "true")


def key(job: Job) -> tuple[str, str, str, str]:
    """What tells a job from all others."""
    return job.generator, job.kind, job.case.name, job.without


def to_json(row: Row) -> str:
    """One line without its end; a number that is not there is null."""
    generator, kind, case, without = key(row.job)
    told = {name: value for name, value in asdict(row).items() if name != "job"}
    told |= {name: _null(told[name]) for name in NUMBERS} | {"floor": [_null(end) for end in row.floor]}
    head = {"generator": generator, "kind": kind, "case": case, "without": without}
    return json.dumps(head | told, allow_nan=False)


def from_json(line: str) -> Row:
    """The row of a line.

    Raises:
        ValueError: If it is none, or its case is no longer there.
    """
    told: dict[str, Any] = json.loads(line)
    wanted = tuple(told.pop(name) for name in ("generator", "kind", "case", "without"))
    if wanted not in JOBS:
        raise ValueError(f"no such case: {wanted}")
    told |= {name: _nan(told[name]) for name in NUMBERS} | {"floor": tuple(map(_nan, told["floor"]))}
    told["adopted"] = tuple(map(tuple, told["adopted"]))
    told |= {name: tuple(told[name]) for name in ("depends_on", "immaterial")}
    return Row(job=JOBS[wanted], **told)


def read_rows(file: Path) -> list[Row]:
    """All rows of a file, without a last one that was cut off and without cases that are no longer there."""
    rows = []
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            rows.append(from_json(line))
        except ValueError:
            continue
    return rows


def append(file: Path, row: Row) -> None:
    """Add a row, on a line of its own even where the last one was cut off."""
    cut_off = file.exists() and not file.read_bytes().endswith(b"\n") and file.stat().st_size > 0
    with file.open("a", encoding="utf-8") as lines:
        lines.write(("\n" if cut_off else "") + to_json(row) + "\n")


def _null(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _nan(value: float | None) -> float:
    return math.nan if value is None else value


JOBS = {key(job): job for generator in GENERATORS for job in all_jobs(generator=generator)}
"""All jobs there are."""
