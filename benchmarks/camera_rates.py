"""How often a diagnosis of the camera is right: `python benchmarks/camera_rates.py OUTPUT [--every N]`.

Blind sets that OUTPUT has no line of yet are drawn (about 20 s of processor time each), diagnosed, and added to it one
by one: a run that was stopped goes on where it was. At the end come the rates over everything in OUTPUT.
"""

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from camera_truth.cases import CHANGES, DECLARED, GEOMETRIC, LIGHT, OUTSIDE, PAIRS, TIMED
from camera_truth.sight import DECLARED as DECLARED_PARAMETERS
from camera_truth.writing import Truth, write_set
from joblib import Parallel, delayed

import proxytune

FLAGGED = ("partly explained", "unexplained")


@dataclass(frozen=True)
class Answer:
    """A set's truth and what was said."""

    truth: Mapping[str, Any]  # what is true of the set, as Truth has it
    camera: Mapping[str, Any]  # `camera` of the diagnosis' document; empty where there is none
    seconds: float  # processor time of the diagnosis [s]
    problem: str = ""  # what went wrong, empty as a rule

    @property
    def key(self) -> tuple[str, int]:
        """What tells a set from all others."""
        return self.truth["case"], self.truth["seed"]

    @property
    def missing(self) -> tuple[str, ...]:
        """Effects of the catalogue that the declared model lacks."""
        return tuple(one for one in self.truth["effects"] if one not in (*DECLARED_PARAMETERS, *OUTSIDE))

    @property
    def outside(self) -> bool:
        """Whether something is wrong that no catalogue has."""
        return bool(self.truth["outside"])

    @property
    def verdict(self) -> str:
        """The verdict on the camera."""
        return str(self.camera.get("verdict", "failed"))

    @property
    def named(self) -> tuple[tuple[str, ...], ...]:
        """Effects that were added, each with those that are said to be indistinguishable from it."""
        return tuple((one["name"], *one.get("indistinguishable_from", ())) for one in self.camera.get("effects", ()))

    @property
    def first_names(self) -> frozenset[str]:
        """The effects that were added, without rivals."""
        return frozenset(names[0] for names in self.named)

    @property
    def flagged(self) -> bool:
        """Whether it was said that something is left over, or a place in the picture pointed at."""
        return self.verdict in FLAGGED or bool(self.camera.get("blemishes"))

    @property
    def right(self) -> bool:
        """Whether every missing effect was named, or one that is said to be indistinguishable from it."""
        said = {name for names in self.named for name in names}
        return set(self.missing) <= said

    @property
    def surplus(self) -> tuple[str, ...]:
        """Effects that were added, of which neither they nor their rivals are missing."""
        return tuple(names[0] for names in self.named if not set(names) & set(self.missing))

    def intervals(self) -> dict[str, tuple[float, float, float]]:
        """Lower end, truth and upper end of every parameter of the extended model that is declared or missing."""
        known = (*DECLARED_PARAMETERS, *self.missing)
        told = {name: one for name, one in self.camera.get("extended", {}).items() if name.split(".")[0] in known}
        figures = self.truth["figures"]
        return {
            name: (one["interval"][0], figures[name], one["interval"][1])
            for name, one in told.items()
            if name in figures and None not in one["interval"] and (self.truth["scene"]["moves"] or name != "blur")
        }


def diagnosed(case: str, seed: int) -> Answer:
    """Draw a set into a folder that does not stay, and diagnose it."""
    with tempfile.TemporaryDirectory() as folder:
        truth: Truth = write_set(Path(folder), case, seed)
        began = time.process_time()
        try:
            camera = proxytune.diagnose(folder).document().get("camera") or {}
            problem = "" if camera else "nothing was said of the camera"
        except Exception as error:
            camera, problem = {}, f"{type(error).__name__}: {error}"
    return Answer(asdict(truth), camera, time.process_time() - began, problem)


def append(file: Path, answer: Answer) -> None:
    """Add an answer, on a line of its own even where the last one was cut off."""
    cut_off = file.exists() and file.stat().st_size > 0 and not file.read_bytes().endswith(b"\n")
    with file.open("a", encoding="utf-8") as lines:
        lines.write(("\n" if cut_off else "") + json.dumps(asdict(answer)) + "\n")


def read_answers(file: Path) -> list[Answer]:
    """All answers of a file, without a last one that was cut off."""
    answers = []
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            answers.append(Answer(**json.loads(line)))
        except (ValueError, TypeError):
            continue
    return answers


EXAM = 1000
"""Seeds of an examination begin here; smaller ones are to develop on."""

SETS = {
    "none": 20,
    **dict.fromkeys(DECLARED, 6),
    **dict.fromkeys(GEOMETRIC, 8),
    **dict.fromkeys(TIMED, 8),
    **dict.fromkeys(LIGHT, 4),
    **dict.fromkeys(OUTSIDE, 12),
    **dict.fromkeys(PAIRS, 1),
}
"""How many sets of each case an examination has."""


def all_sets(cases: Sequence[str] = (), every: int = 1) -> list[tuple[str, int]]:
    """Case and seed of every n-th set of each kind, mixed so that any beginning has a share of each."""
    kinds = [SETS.keys() - PAIRS, PAIRS] if not cases else [cases]
    sets = []
    for kind in kinds:
        of_kind = [(name, EXAM + number) for name in kind for number in range(SETS.get(name, 4))]
        sets += sorted(of_kind)[::every]
    counts = Counter(name if name not in PAIRS else "pair" for name, _ in sets)
    done: Counter[str] = Counter()
    placed = []
    for name, seed in sets:
        kind = name if name not in PAIRS else "pair"
        placed.append(((done[kind] + 0.5) / counts[kind], name, seed))
        done[kind] += 1
    return [(name, seed) for _, name, seed in sorted(placed)]


@dataclass(frozen=True)
class Rate:
    """So many of so many."""

    hits: int
    of: int

    def __str__(self) -> str:
        return f"{self.hits} of {self.of}" + (f" ({100.0 * self.hits / self.of:.0f} %)" if self.of else "")


def rates(answers: Sequence[Answer]) -> dict[str, Rate]:
    """How often the diagnosis is right, by what was wrong with the camera; those that failed count for that alone."""
    sound = [one for one in answers if not one.problem]
    whole = [one for one in sound if not one.outside]
    clean = [one for one in whole if not one.missing]
    outside = [one for one in sound if one.outside]
    pairs = [one for one in whole if len(one.missing) > 1]
    lone = [one for one in whole if len(one.missing) == 1]
    told = {}
    for title, group in (("geometric", GEOMETRIC), ("timed", TIMED), ("light", LIGHT)):
        of_group = [one for one in lone if one.missing[0] in group]
        told[f"{title}: named"] = _rate(of_group, lambda one: one.right)
        told[f"{title}: named, nothing beside"] = _rate(of_group, lambda one: one.right and not one.surplus)
        told[f"{title}: named by itself, no rival"] = _rate(of_group, lambda one: set(one.missing) == one.first_names)
        told[f"{title}: wrong without a flag"] = _rate(of_group, _is_wrong)
    return told | {
        "pairs: both named": _rate(pairs, lambda one: one.right),
        "pairs: both named, nothing beside": _rate(pairs, lambda one: one.right and not one.surplus),
        "nothing missing: false alarms": _rate(clean, lambda one: bool(one.named) or one.flagged),
        "outside: flagged": _rate(outside, lambda one: one.flagged),
        "outside: called explained or nothing missing": _rate(outside, lambda one: _is_calm(one) and not one.flagged),
        "failed": _rate(answers, lambda one: bool(one.problem)),
    }


def coverage(answers: Sequence[Answer]) -> dict[str, Rate]:
    """How often intervals hold the truth, by parameter, where nothing outside the catalogue is wrong."""
    held: dict[str, list[bool]] = {}
    for answer in answers:
        if not answer.outside and answer.right:
            for name, (low, true, high) in answer.intervals().items():
                held.setdefault(name, []).append(low <= true <= high)
    each = {name: Rate(sum(flags), len(flags)) for name, flags in sorted(held.items())}
    return each | {"all": Rate(sum(one.hits for one in each.values()), sum(one.of for one in each.values()))}


WITHIN = {
    "camera_pitch": 0.3,
    "camera_roll": 0.3,
    "camera_yaw": 0.5,
    "camera_height": 0.002,
    "field_of_view": 1.0,
    "lens_distortion": 0.02,
    "camera_latency": 0.005,
    "blur": 0.010,
    "vignetting": 0.03,
}
"""How near the truth a figure is to come, in its unit."""


def accuracy(answers: Sequence[Answer]) -> dict[str, Rate]:
    """How often figures come so near the truth, where nothing outside the catalogue is wrong."""
    near: dict[str, list[bool]] = {}
    for answer in answers:
        for name, (_, true, _) in ({} if answer.outside else answer.intervals()).items():
            if name in WITHIN:
                value = answer.camera["extended"][name]["value"]
                near.setdefault(f"{name} within {WITHIN[name]:g}", []).append(abs(value - true) <= WITHIN[name])
    return {name: Rate(sum(one), len(one)) for name, one in sorted(near.items())}


def confusion(answers: Sequence[Answer]) -> str:
    """For everything that was wrong what was said, and how often."""
    said: dict[str, Counter[str]] = {}
    for answer in answers:
        names = " + ".join(sorted(answer.first_names)) or "-"
        truth = " + ".join(answer.truth["effects"]) or "none"
        said.setdefault(truth, Counter())[f"{names} ({answer.verdict})"] += 1
    order = {name: number for number, name in enumerate(("none", *CHANGES))}
    return "\n".join(
        f"{truth:34s} {', '.join(f'{name} {count}' for name, count in counts.most_common())}"
        for truth, counts in sorted(said.items(), key=lambda pair: (order.get(pair[0], len(order)), pair[0]))
    )


def _is_calm(answer: Answer) -> bool:
    return answer.verdict in ("explained", "nothing missing")


def _is_wrong(answer: Answer) -> bool:
    """Whether an effect was named that is not missing, or none was, and nothing was said to be left over."""
    return not answer.flagged and (bool(answer.surplus) or (not answer.right and _is_calm(answer)))


def _rate(answers: Sequence[Answer], hit: Callable[[Answer], bool]) -> Rate:
    return Rate(sum(map(hit, answers)), len(answers))


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
