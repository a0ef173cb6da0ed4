"""How often a diagnosis is right: `python tests/benchmarks/bench_rates.py OUTPUT [--generator second] [--every N]`.

Cases that OUTPUT has no line of yet are diagnosed, about half a minute of processor time each, and added to it one by
one: a run that was stopped goes on where it was. At the end come the rates over everything in OUTPUT.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import rate_rows
import rates
from joblib import Parallel, delayed
from rate_jobs import GENERATORS, Job, all_jobs


def arguments(words: Sequence[str] | None = None) -> argparse.Namespace:
    """What was asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("output", type=Path, help="file of JSON lines, one a case, that is added to")
    parser.add_argument("--generator", choices=tuple(GENERATORS), default="first", help="whose cases")
    parser.add_argument("--every", type=int, default=1, help="every so many-th case of each kind")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    parser.add_argument("--episodes", type=int, default=12, help="drives of a log")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of a drive")
    return parser.parse_args(words)


def diagnose_all(asked: argparse.Namespace) -> None:
    """Add a row for each case that has none yet."""
    finished = {rate_rows.key(row.job) for row in rate_rows.read_rows(asked.output)}
    wanted = [job for job in all_jobs(asked.every, asked.generator) if rate_rows.key(job) not in finished]
    for number, row in enumerate(_rows(wanted, asked), 1):
        rate_rows.append(asked.output, row)
        print(f"{number} of {len(wanted)}: {row.text}", file=sys.stderr, flush=True)


def _rows(wanted: Sequence[Job], asked: argparse.Namespace) -> Iterator[rates.Row]:
    """Rows in the order in which they are finished."""
    tasks = (delayed(rates.diagnosed)(job, asked.episodes, asked.seconds) for job in wanted)
    yield from Parallel(n_jobs=asked.jobs, return_as="generator_unordered", pre_dispatch="n_jobs")(tasks)


def report(rows: Sequence[rates.Row]) -> str:
    """The rates and what was said of what."""
    lines = [f"{name}: {rate}" for name, rate in rates.rates(rows).items()]
    ratios = "error after, curves included, by that of the right model, windows of 2 s"
    return "\n".join((f"{len(rows)} cases", *lines, "", ratios, rates.errors(rows), "", rates.confusion(rows)))


def main() -> None:
    """Diagnose what is not yet, and count."""
    asked = arguments()
    diagnose_all(asked)
    print(report(rate_rows.read_rows(asked.output)))


if __name__ == "__main__":
    main()
