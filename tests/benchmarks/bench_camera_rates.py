"""How often a diagnosis of the camera is right: `python tests/benchmarks/bench_camera_rates.py OUTPUT [--every N]`.

Blind sets that OUTPUT has no line of yet are drawn (about 20 s of processor time each), diagnosed, and added to it one
by one: a run that was stopped goes on where it was. At the end come the rates over everything in OUTPUT.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from camera_truth.answers import Answer, append, diagnosed, read_answers
from camera_truth.rates import accuracy, all_sets, confusion, coverage, rates
from joblib import Parallel, delayed


def arguments(words: Sequence[str] | None = None) -> argparse.Namespace:
    """What was asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("output", type=Path, help="file of JSON lines, one a set, that is added to")
    parser.add_argument("--cases", nargs="+", default=(), help='cases instead of all, as in "camera_roll horseshoe"')
    parser.add_argument("--every", type=int, default=1, help="every so many-th set of each kind")
    parser.add_argument("--jobs", type=int, default=2, help="sets at a time")
    return parser.parse_args(words)


def diagnose_all(asked: argparse.Namespace) -> None:
    """Add an answer for each set that has none yet."""
    finished = {answer.key for answer in read_answers(asked.output)}
    wanted = [one for one in all_sets(asked.cases, asked.every) if one not in finished]
    tasks = (delayed(diagnosed)(case, seed) for case, seed in wanted)
    answers = Parallel(n_jobs=asked.jobs, return_as="generator_unordered", pre_dispatch="n_jobs")(tasks)
    for number, answer in enumerate(answers, 1):
        append(asked.output, answer)
        print(f"{number} of {len(wanted)}: {line(answer)}", file=sys.stderr, flush=True)


def line(answer: Answer) -> str:
    """One line of the table."""
    added = ", ".join("/".join(names) for names in answer.named)
    error = answer.camera.get("error") or {}
    errors = " ".join(f"{name} {error[name]}" for name in ("before", "after", "noise_floor", "unit") if name in error)
    name = f"{answer.truth['case']} {answer.truth['seed']}"
    return f"{name:34s} {answer.verdict:16s} [{added}] {errors} {answer.seconds:.0f} s {answer.problem}".rstrip()


def report(answers: Sequence[Answer]) -> str:
    """The rates and what was said of what."""
    lines = [f"{name}: {rate}" for name, rate in rates(answers).items() if rate.of]
    held = [f"  {name}: {rate}" for name, rate in coverage(answers).items()]
    near = [f"  {name}: {rate}" for name, rate in accuracy(answers).items()]
    table = ("intervals that hold the truth:", *held, "", "figures near the truth:", *near, "", confusion(answers))
    return "\n".join((f"{len(answers)} sets", *lines, "", *table))


def main() -> None:
    """Diagnose what is not yet, and count."""
    asked = arguments()
    diagnose_all(asked)
    print(report(read_answers(asked.output)))


if __name__ == "__main__":
    main()
