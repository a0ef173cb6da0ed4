"""How often a diagnosis is right: `python benchmarks/rates.py OUTPUT [--generator NAME] [--every N] [--kinds NAMES]`.

Cases that OUTPUT has no line of yet are diagnosed, about 25 s of processor time each, and added to it one by
one: a run that was stopped goes on where it was. At the end come the rates over everything in OUTPUT.
"""

import argparse
import json
import math
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

import gym_dynamics_cases as gym
import hidden_cars
import hidden_cases as hidden
import numpy as np
import second_hidden_cars
import second_hidden_cases as second
import third_hidden_cases as third
from bullet_cases import BULLET, BulletCase, make_bullet_log
from joblib import Parallel, delayed

import proxytune.diagnosis.motion.diagnose as diagnosing
import proxytune.diagnosis.motion.evidence as looking
from proxytune.diagnosis import RANDOM_EFFECTS, Diagnosis, Drives, Fit, cut
from proxytune.diagnosis.motion import selection
from proxytune.diagnosis.motion.diagnose import declared_effects, diagnose
from proxytune.diagnosis.motion.drives import relative
from proxytune.diagnosis.motion.random_effects import RandomEffect, random_effects
from proxytune.diagnosis.motion.screening import Candidate, candidates
from proxytune.driving import Robot, read_robot
from proxytune.logs import Log
from proxytune.space import Theta

GENERATORS: dict[str, ModuleType] = {
    "first": hidden,
    "second": second,
    "third": third,
    "gym": gym,
    "car": hidden_cars,
    "second_car": second_hidden_cars,
}
"""Modules with cases of every kind, and a make_log for them; those of cars say which ROBOT."""


@dataclass(frozen=True)
class Job:
    """A case to diagnose; `without` is taken out of the catalogue."""

    kind: str
    case: hidden.Case | second.Case | third.Case | gym.Case | hidden_cars.Case | second_hidden_cars.Case | BulletCase
    without: str = ""

    @property
    def generator(self) -> str:
        """Which of GENERATORS makes its log."""
        own = (name for name, cases in GENERATORS.items() if isinstance(self.case, cases.Case))
        return next(own, "first")

    @property
    def right(self) -> tuple[tuple[str, ...], ...]:
        """For every hidden effect, the names that count as right."""
        return getattr(self.case, "right", ())


def all_jobs(every: int = 1, generator: str = "first") -> tuple[Job, ...]:
    """Every n-th case of each kind (0: none), the kinds mixed so that any beginning has a share of each.

    Only the first generator has cases of the bullet plant.
    """
    whole = _by_kind(GENERATORS[generator])
    if generator == "first":
        whole["bullet"] = [Job("bullet", case) for case in BULLET]
    chosen = [_shuffled(jobs[::every]) for jobs in whole.values()] if every else []
    placed = [((n + 0.5) / len(jobs), k, job) for k, jobs in enumerate(chosen) for n, job in enumerate(jobs)]
    return tuple(job for _, _, job in sorted(placed, key=lambda entry: entry[:2]))


def _by_kind(cases: ModuleType) -> dict[str, list[Job]]:
    """Jobs by kind, of all cases of a generator."""
    return {
        "in form": [Job("in form", case) for case in cases.IN_FORM],
        "other form": [Job("other form", case) for case in cases.OTHER_FORM],
        "pair": [Job("pair", case) for case in cases.PAIRS],
        "outside": [Job("outside", case) for case in cases.OUTSIDE],
        "taken out": [Job("taken out", case, case.right[0][0]) for case in cases.IN_FORM],
        "clean": [Job("clean", case) for case in cases.CLEAN],
        "physics": [Job("physics", case) for case in getattr(cases, "PHYSICS", ())],
    }


def _shuffled(jobs: list[Job]) -> list[Job]:
    """In an order of their own, so that neighbours do not hide the same effect."""
    return [jobs[number] for number in np.random.default_rng(1).permutation(len(jobs))]


CLEAR = 30.0
"""An effect with more evidence than this should be named [nats]."""

MATERIAL = 1.05
"""What is hidden is material if errors without it are so many times those of the model that is right."""

HORIZON_S = 2.0
FLAGGED = ("partly explained", "unexplained")


@dataclass(frozen=True)
class Row:
    """What was said of a case."""

    job: Job  # the case
    verdict: str
    adopted: tuple[tuple[str, ...], ...] = ()  # the effects that were added, each with its rivals
    depends_on: tuple[str, ...] = ()  # signals that explain the rest
    # of the hidden effects, that of the weakest [nats]; the best of all effects where none is hidden
    evidence: float = 0.0
    before: float = np.nan  # error with what is declared [m]
    after: float = np.nan  # error with what was added [m]
    learnt: float = np.nan  # error with what was learnt besides [m], NaN where nothing is
    true: float = np.nan  # error of the model that is right [m], NaN where there is none
    floor: tuple[float, float] = (np.nan, np.nan)  # the noise floor that was told, its lower and upper end [m]
    immaterial: tuple[str, ...] = ()  # effects that were found and do not matter
    problem: str = ""  # what went wrong, empty as a rule

    @property
    def flagged(self) -> bool:
        """Whether it was said that something is left over."""
        return self.verdict in FLAGGED

    @property
    def calm(self) -> bool:
        """Whether it was said that nothing is left over."""
        return self.verdict in ("explained", "nothing missing")

    @property
    def right(self) -> bool:
        """Whether every hidden effect is among those added or their rivals."""
        said = {name for names in self.adopted for name in names}
        return all(said & set(names) for names in self.job.right)

    @property
    def wrong(self) -> bool:
        """Whether an effect was added that is not hidden, nor a rival of one, and no flag raised."""
        return not self.flagged and bool(self.surplus)

    @property
    def material(self) -> bool:
        """Whether what is hidden makes errors larger by 5 %; effects that draw move no mean, and count."""
        return not self.before < MATERIAL * self.true

    @property
    def surplus(self) -> tuple[str, ...]:
        """Effects that were added, are not hidden and no rivals of one that is."""
        known = {name for names in self.job.right for name in names} - {self.job.without}
        return tuple(names[0] for names in self.adopted if not set(names) & known)

    @property
    def reached(self) -> float:
        """The error with all that was found, curves included [m]."""
        return self.learnt if np.isfinite(self.learnt) else self.after

    @property
    def text(self) -> str:
        """One line of the table."""
        added = " + ".join(f"{names[0]}({'/'.join(names[1:])})" if names[1:] else names[0] for names in self.adopted)
        errors = " ".join(
            f"{1e3 * value:.1f}" for value in (self.before, self.after, self.learnt, self.true, *self.floor)
        )
        name = self.job.case.name + (f" without {self.job.without}" if self.job.without else "")
        added += f"; immaterial: {', '.join(self.immaterial)}" if self.immaterial else ""
        rest = f" rest: {', '.join(self.depends_on)}" if self.depends_on else ""
        head = f"{self.job.kind:11s} {name:44s} {self.verdict:16s}"
        return f"{head} [{added}]{rest} {self.evidence:.0f} nats, mm: {errors} {self.problem}".rstrip()


def diagnosed(job: Job, episodes: int = 12, seconds: float = 60.0) -> Row:
    """Diagnose one case."""
    robot = read_robot(getattr(GENERATORS[job.generator], "ROBOT", "duckiebot"))
    log = _log(job, episodes, seconds)
    try:
        with _without(job.without):
            found = diagnose(log, robot, declared_effects(robot))
    except Exception as problem:
        return Row(job, "failed", problem=f"{type(problem).__name__}: {problem}")
    error = min(found.errors, key=lambda one: abs(one.horizon_s - HORIZON_S))
    return Row(
        job=job,
        verdict=found.verdict,
        adopted=tuple((one.effect, *(rival.effect for rival in one.rivals)) for one in found.effects),
        depends_on=found.residual_depends_on,
        evidence=_evidence(job, found),
        before=error.before.value,
        after=error.after.value,
        learnt=_learnt_error(found),
        true=_true_error(job, found.parts.tested, episodes, seconds),
        floor=error.floor[:2],
        immaterial=tuple(one.effect for one in found.negligible),
    )


def _log(job: Job, episodes: int, seconds: float, noiseless: bool = False) -> Log:
    if isinstance(job.case, BulletCase):
        return make_bullet_log(job.case, episodes=episodes, seconds=seconds, noiseless=noiseless)
    make_log = GENERATORS[job.generator].make_log
    log: Log = make_log(job.case, episodes=episodes, seconds=seconds, noiseless=noiseless)
    return log


@contextmanager
def _without(effect: str) -> Iterator[None]:
    """Take an effect out of what the search may find, and leave out the confirmation on the bullet plant."""

    def forms(robot: Robot, theta: Theta, taken: Iterable[str]) -> tuple[Candidate, ...]:
        return tuple(form for form in candidates(robot, theta, taken) if form.effect != effect)

    def chancy(model: Fit, seed: int) -> tuple[RandomEffect, ...]:
        return tuple(found for found in random_effects(model, seed) if found.effect != effect)

    with (
        mock.patch.object(looking, "candidates", forms),
        mock.patch.object(looking, "random_effects", chancy),
        mock.patch.object(selection, "OF_CARS", tuple(name for name in selection.OF_CARS if name != effect)),
        mock.patch.object(diagnosing, "has_body", return_value=False),
    ):
        yield


def _evidence(job: Job, found: Diagnosis) -> float:
    gains = {tried.effect: tried.gain for tried in reversed(found.found.tried)}
    gains |= {one.effect: max(one.gain, gains.get(one.effect, 0.0)) for one in found.effects}
    if not job.right or job.without:
        return max(gains.values(), default=0.0)
    return min(max(gains.get(name, 0.0) for name in names) for names in job.right)


def _learnt_error(found: Diagnosis) -> float:
    errors = found.learning.errors
    return min(errors, key=lambda one: abs(one.horizon_s - HORIZON_S)).after.value if errors else float("nan")


def _true_error(job: Job, tested: Drives, episodes: int, seconds: float) -> float:
    """The error of the same windows when the hidden robot itself predicts, undisturbed; NaN where it draws."""
    if isinstance(job.case, BulletCase) or {name for names in job.right for name in names} & set(RANDOM_EFFECTS):
        return float("nan")
    quiet = _log(job, episodes, seconds, noiseless=True)
    poses = np.stack([episode.poses for episode in quiet.episodes])[2::3]
    windows = cut(tested, HORIZON_S)
    ticks = round(tested.tick_hz / tested.rate_hz)
    begin, ends = windows.begin[windows.window], windows.increment
    episode = tested.episode[ends]
    said = relative(poses[episode, tested.first[begin] // ticks], poses[episode, tested.last[ends] // ticks])
    seen = relative(tested.poses[begin, 0], tested.poses[ends, 1])
    return float(np.sqrt(np.mean(np.sum((said - seen)[:, :2] ** 2, axis=1))))


@dataclass(frozen=True)
class Rate:
    """So many of so many."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        """The share, 1 of none."""
        return self.hits / self.of if self.of else 1.0

    def __str__(self) -> str:
        return f"{self.hits} of {self.of} ({100.0 * self.share:.0f} %)"


def rates(rows: Sequence[Row]) -> dict[str, Rate]:
    """How often the diagnosis is right, by what was hidden."""
    by_kind = {kind: [row for row in rows if row.job.kind == kind] for kind in {row.job.kind for row in rows}}
    form, other, outside = (by_kind.get(kind, []) for kind in ("in form", "other form", "outside"))
    material = [row for row in form if row.material]
    seen = {row.job.case.name for row in material if row.evidence > CLEAR}
    lost = [row for row in by_kind.get("taken out", []) if row.job.case.name in seen]
    true = [row for row in rows if np.isfinite(row.true)]
    return {
        "in form and material: named, nothing beside": _rate(material, lambda row: row.right and not row.surplus),
        "in form and material: named": _rate(material, lambda row: row.right),
        "in form, not material: nothing wrong named": _rate(
            [row for row in form if not row.material], lambda row: not row.surplus
        ),
        "in form wrong without a flag": _rate(form, lambda row: row.wrong),
        "pairs both named": _rate(by_kind.get("pair", []), lambda row: row.right),
        "clean false alarms": _rate(by_kind.get("clean", []), lambda row: bool(row.adopted) or row.flagged),
        "taken out flagged": _rate(lost, lambda row: row.flagged),
        "taken out called explained": _rate(lost, lambda row: row.calm),
        "outside flagged": _rate(outside, lambda row: row.flagged),
        "outside called explained": _rate(outside, lambda row: row.calm),
        "other form right": _rate(other, lambda row: row.right),
        "other form right or flagged": _rate(other, lambda row: row.right or row.flagged),
        "other form wrong without a flag": _rate(other, lambda row: row.wrong),
        "explained beyond 1.3 x the true floor": _rate(true, lambda row: row.calm and row.after > 1.3 * row.true),
        "floor bracket holds the true one": _rate(true, lambda row: row.floor[0] <= row.true <= row.floor[1]),
        "failed": _rate(rows, lambda row: bool(row.problem)),
    }


def errors(rows: Sequence[Row]) -> str:
    """The error after, curves included, by that of the model that is right: a line for each kind."""
    lines = []
    for kind in dict.fromkeys(row.job.kind for row in rows):
        known = [row for row in rows if row.job.kind == kind and np.isfinite(row.reached / row.true)]
        if known:
            shares = np.array([row.reached / row.true for row in known])
            middle, most = np.quantile(shares, (0.5, 0.9))
            worst = known[int(shares.argmax())]
            name = worst.job.case.name + (f" without {worst.job.without}" if worst.job.without else "")
            told = f"median {middle:.2f}, nine of ten {most:.2f}, worst {shares.max():.2f} ({name})"
            lines.append(f"{kind:11s} {len(known):3d}: {told}")
    return "\n".join(lines)


def _rate(rows: Sequence[Row], hit: object) -> Rate:
    return Rate(sum(bool(hit(row)) for row in rows), len(rows))


def confusion(rows: Sequence[Row]) -> str:
    """For every hidden effect what was said first, and how often."""
    said: dict[str, Counter[str]] = {}
    for row in rows:
        if row.job.kind in ("in form", "clean"):
            truth = row.job.right[0][0] if row.job.right else "nothing"
            answer = row.adopted[0][0] if row.adopted else row.verdict
            said.setdefault(truth, Counter())[answer] += 1
    return "\n".join(
        f"{truth:22s} {', '.join(f'{name} {count}' for name, count in counts.most_common())}"
        for truth, counts in sorted(said.items())
    )


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


def arguments(words: Sequence[str] | None = None) -> argparse.Namespace:
    """What was asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("output", type=Path, help="file of JSON lines, one a case, that is added to")
    parser.add_argument("--generator", choices=tuple(GENERATORS), default="first", help="whose cases")
    parser.add_argument("--every", type=int, default=1, help="every so many-th case of each kind; 0: count only")
    parser.add_argument(
        "--kinds", default="", help="only cases of these kinds, as in 'outside,other form'; all, if not said"
    )
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    parser.add_argument("--episodes", type=int, default=12, help="drives of a log")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of a drive")
    return parser.parse_args(words)


def diagnose_all(asked: argparse.Namespace) -> None:
    """Add a row for each case that has none yet."""
    finished = {key(row.job) for row in read_rows(asked.output)}
    kinds = asked.kinds.split(",") if asked.kinds else None
    jobs = (job for job in all_jobs(asked.every, asked.generator) if kinds is None or job.kind in kinds)
    wanted = [job for job in jobs if key(job) not in finished]
    for number, row in enumerate(_rows(wanted, asked), 1):
        append(asked.output, row)
        print(f"{number} of {len(wanted)}: {row.text}", file=sys.stderr, flush=True)


def _rows(wanted: Sequence[Job], asked: argparse.Namespace) -> Iterator[Row]:
    """Rows in the order in which they are finished."""
    tasks = (delayed(diagnosed)(job, asked.episodes, asked.seconds) for job in wanted)
    yield from Parallel(n_jobs=asked.jobs, return_as="generator_unordered", pre_dispatch="n_jobs")(tasks)


def report(rows: Sequence[Row]) -> str:
    """The rates and what was said of what."""
    lines = [f"{name}: {rate}" for name, rate in rates(rows).items()]
    ratios = "error after, curves included, by that of the right model, windows of 2 s"
    return "\n".join((f"{len(rows)} cases", *lines, "", ratios, errors(rows), "", confusion(rows)))


def main() -> None:
    """Diagnose what is not yet, and count."""
    asked = arguments()
    diagnose_all(asked)
    print(report(read_rows(asked.output)))


if __name__ == "__main__":
    main()
