"""Score entries: `python benchmarks/missing_effects/score.py DIR ENTRY [ENTRY …]`, a row of the table each.

An entry is a folder with NAME.csv (episode, time, x, y, heading of the held-out drives) of every case, and NAME.json:
{"effects": ["dead_band", …] or null where it names none, "seconds": processor time}.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))

from missing_effects.cases import HORIZONS_S, Array, FormatError, case_folders, errors, read_json, read_poses

KINDS = ("in form", "pair", "other form", "outside", "clean")
SAME_TIME_S = 1e-3


@dataclass(frozen=True)
class Truth:
    """What no entry may know of a case."""

    name: str  # the case
    kind: str  # one of KINDS
    missing: tuple[frozenset[str], ...]  # for every missing effect the names that count as right
    known: frozenset[str]  # all names of the catalogue
    drives: Mapping[str, tuple[Array, Array]]  # times (T,) [s] and measured poses (T, 3) of the held-out drives
    # error of the hidden robot itself, undisturbed, by horizon [m]; None where it draws by lot
    floor: Mapping[str, float] | None


@dataclass(frozen=True)
class Result:
    """What an entry is worth in one case."""

    truth: Truth  # the case
    named: int | None  # how many missing effects it names; None where it names no effects
    false: int | None  # how many names are of effects that are not missing; None likewise
    ratios: Mapping[int, float] | None  # error by floor, for each horizon; None where there is no floor
    seconds: float | None  # processor time; None where it is not told


def read_truths(folder: Path) -> tuple[Truth, ...]:
    """The truths of all cases, in order.

    Raises:
        FormatError: If one is missing.
    """
    folders, catalogue, truths = case_folders(folder), read_json(folder / "catalogue.json"), []
    for own in folders:
        told, drive = (read_json(file) for file in (folder / "truth" / f"{own.name}.json", own / "robot.json"))
        missing = tuple(frozenset(names) for names in told["missing"])
        drives = read_poses(folder / "truth" / f"{own.name}.csv")
        known = frozenset(catalogue[drive["drive"]])
        truths.append(Truth(own.name, told["kind"], missing, known, drives, told["floor_m"]))
    return tuple(truths)


def score(entry: Path, truths: Sequence[Truth]) -> list[Result]:
    """Score an entry, case by case.

    Raises:
        FormatError: If it is no folder, lacks a case, or a file is not as it must be: one line, what and where.
    """
    if not entry.is_dir():
        raise FormatError(f"{entry}: is no folder; an entry is a folder with a .csv and a .json of every case")
    return [_score_case(entry, truth) for truth in truths]


def _score_case(entry: Path, truth: Truth) -> Result:
    predicted = _predicted(entry / f"{truth.name}.csv", truth)
    names, seconds = _told(entry / f"{truth.name}.json", truth)
    measured = [poses for _, poses in truth.drives.values()]
    row_s = float(np.median(np.diff(next(iter(truth.drives.values()))[0])))
    found = errors(predicted, measured, row_s)
    right = frozenset().union(*truth.missing)
    return Result(
        truth,
        None if names is None else sum(bool(names & wanted) for wanted in truth.missing),
        None if names is None else len(names - right),
        None if truth.floor is None else {h: found[h] / truth.floor[str(h)] for h in HORIZONS_S},
        seconds,
    )


def _predicted(file: Path, truth: Truth) -> list[Array]:
    tables = read_poses(file)
    if unknown := sorted(set(tables) - set(truth.drives)):
        raise FormatError(f"{file}: has a drive '{unknown[0]}' that is not held out")
    for drive, (times, _) in truth.drives.items():
        told = tables[drive][0] if drive in tables else np.empty(0)
        if len(told) != len(times):
            raise FormatError(f"{file}: drive '{drive}' has {len(told)} poses, {len(times)} are asked for")
        if (apart := np.abs(told - times) > SAME_TIME_S).any():
            row = int(apart.argmax())
            raise FormatError(
                f"{file}: pose {row + 1} of drive '{drive}' is at {told[row]:g} s, asked for {times[row]:g}"
            )
    return [tables[drive][1] for drive in truth.drives]


def _told(file: Path, truth: Truth) -> tuple[frozenset[str] | None, float | None]:
    told: Any = read_json(file)
    if not isinstance(told, dict):
        raise FormatError(f'{file}: is no object; it needs {{"effects": [names] or null, "seconds": number or null}}')
    names, seconds = told.get("effects"), told.get("seconds")
    if names is not None and not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
        raise FormatError(f"{file}: 'effects' is no list of names, nor null")
    if unknown := sorted(set(names or ()) - truth.known):
        raise FormatError(f"{file}: names '{unknown[0]}', which catalogue.json does not have for this robot")
    if seconds is not None and not (type(seconds) in (int, float) and 0.0 <= seconds < float("inf")):
        raise FormatError(f"{file}: 'seconds' is no finite number of at least 0, nor null")
    return None if names is None else frozenset(names), seconds


def table(results: Mapping[str, Sequence[Result]]) -> str:
    """All entries, a row each, then the same by kind, as Markdown."""
    first = next(iter(results.values()))
    floors = sum(one.ratios is not None for one in first)
    head = (
        "entry",
        "named",
        "false names a case",
        *(f"{h} s: median, nine of ten" for h in HORIZONS_S),
        "seconds a case",
    )
    kinds = [kind for kind in KINDS if any(one.truth.kind == kind for one in first)]
    by_kind = [(kind, *(_middle(_of(rows, kind), 2) for rows in results.values())) for kind in kinds]
    named = [(kind, *(_names(_of(rows, kind)) for rows in results.values())) for kind in kinds]
    titles = [f"{kind} ({len(_of(first, kind))})" for kind in kinds]
    return "\n\n".join(
        (
            f"{len(first)} cases; error by floor over the {floors} that have a floor",
            _markdown(head, [(name, *_row(rows)) for name, rows in results.items()]),
            "Error by floor at 2 s, median, worst, by kind:",
            _markdown(("entry", *titles), _turned(results, by_kind)),
            "Named of missing, and false names, by kind:",
            _markdown(("entry", *titles), _turned(results, named)),
        )
    )


def _of(rows: Sequence[Result], kind: str) -> list[Result]:
    return [one for one in rows if one.truth.kind == kind]


def _turned(results: Mapping[str, Sequence[Result]], columns: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
    return [(name, *(column[1 + place] for column in columns)) for place, name in enumerate(results)]


def _row(rows: Sequence[Result]) -> tuple[str, ...]:
    ratios = [_quantiles(rows, horizon) for horizon in HORIZONS_S]
    known = [one.seconds for one in rows if one.seconds is not None]
    seconds = f"{np.mean(known):.1f}" if known else "not told"
    missing = sum(len(one.truth.missing) for one in rows)
    if any(one.named is None for one in rows):
        return "names none", "", *ratios, seconds
    named, false = sum(one.named or 0 for one in rows), sum(one.false or 0 for one in rows)
    return f"{named} of {missing}", f"{false / len(rows):.2f}", *ratios, seconds


def _quantiles(rows: Sequence[Result], horizon: int) -> str:
    ratios = [one.ratios[horizon] for one in rows if one.ratios is not None]
    return "{:.2f}, {:.2f}".format(*np.quantile(ratios, (0.5, 0.9))) if ratios else "no floor"


def _middle(rows: Sequence[Result], horizon: int) -> str:
    ratios = [one.ratios[horizon] for one in rows if one.ratios is not None]
    return f"{np.median(ratios):.2f}, {max(ratios):.2f}" if ratios else "no floor"


def _names(rows: Sequence[Result]) -> str:
    if any(one.named is None for one in rows):
        return "names none"
    named, missing = sum(one.named or 0 for one in rows), sum(len(one.truth.missing) for one in rows)
    return f"{named} of {missing}, {sum(one.false or 0 for one in rows)} false"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = (head, ["---"] * len(head), *rows)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def main() -> int:
    """Print the table of the entries."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="DIR", help="what write.py wrote")
    parser.add_argument("entries", type=Path, nargs="+", metavar="ENTRY", help="folders of answers")
    asked = parser.parse_args()
    try:
        truths = read_truths(asked.folder)
        results = {entry.resolve().name: score(entry, truths) for entry in asked.entries}
    except FormatError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    print(table(results))
    return 0


if __name__ == "__main__":
    sys.exit(main())
