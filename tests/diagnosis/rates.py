"""What `diagnose` says of every hidden effect, and how often that is right: rows, rates and a confusion matrix."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from unittest import mock

import numpy as np
from bullet_truth import BulletCase, make_bullet_log
from rate_jobs import GENERATORS, Job

import proxytune.diagnosis.diagnose as diagnosing
import proxytune.diagnosis.round as looking
from proxytune.diagnosis.candidates import Candidate, candidates
from proxytune.diagnosis.diagnose import declared_effects, diagnose
from proxytune.diagnosis.diagnosis import Diagnosis
from proxytune.diagnosis.drives import Drives, relative
from proxytune.diagnosis.events import RandomEffect, random_effects
from proxytune.diagnosis.fitting import Fit
from proxytune.diagnosis.replay import RANDOM_EFFECTS
from proxytune.diagnosis.windows import cut
from proxytune.driving.robot import read_robot
from proxytune.logs import Log
from proxytune.space import Theta

CLEAR = 30.0
"""An effect with more evidence than this should be named [nats]."""

HORIZON_S = 2.0
FLAGGED = ("partly explained", "unexplained")


@dataclass(frozen=True)
class Row:
    """What was said of a case.

    Attributes:
        job: The case.
        verdict: The verdict.
        adopted: The effects that were added, each with its rivals.
        depends_on: Signals that explain the rest.
        evidence: Of the hidden effects, that of the weakest [nats]; the best of all effects where none is hidden.
        before: Error with what is declared [m].
        after: Error with what was added [m].
        learnt: Error with what was learnt besides [m], NaN where nothing is.
        true: Error of the model that is right [m], NaN where there is none.
        floor: The noise floor that was told, its lower and upper end [m].
        immaterial: Effects that were found and do not matter.
        problem: What went wrong, empty as a rule.
    """

    job: Job
    verdict: str
    adopted: tuple[tuple[str, ...], ...] = ()
    depends_on: tuple[str, ...] = ()
    evidence: float = 0.0
    before: float = np.nan
    after: float = np.nan
    learnt: float = np.nan
    true: float = np.nan
    floor: tuple[float, float] = (np.nan, np.nan)
    immaterial: tuple[str, ...] = ()
    problem: str = ""

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
        known = {name for names in self.job.right for name in names} - {self.job.without}
        return not self.flagged and any(not set(names) & known for names in self.adopted)

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
    robot = read_robot("duckiebot")
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
        immaterial=tuple(one.effect for one in found.immaterial),
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

    def forms(nominal: Theta, theta: Theta, taken: Iterable[str]) -> tuple[Candidate, ...]:
        return tuple(form for form in candidates(nominal, theta, taken) if form.effect != effect)

    def chancy(model: Fit, seed: int) -> tuple[RandomEffect, ...]:
        return tuple(found for found in random_effects(model, seed) if found.effect != effect)

    with (
        mock.patch.object(looking, "candidates", forms),
        mock.patch.object(looking, "random_effects", chancy),
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
    """The rates that issue 4 asks for."""
    by_kind = {kind: [row for row in rows if row.job.kind == kind] for kind in {row.job.kind for row in rows}}
    clear = [row for row in by_kind.get("in form", []) if row.evidence > CLEAR]
    seen = {row.job.case.name for row in clear}
    lost = [row for row in by_kind.get("taken out", []) if row.job.case.name in seen]
    pairs, other = by_kind.get("pair", []), by_kind.get("other form", [])
    near = [row.after / row.true for row in clear if row.right and np.isfinite(row.true)]
    return {
        "in form above 30 nats named": _rate(clear, lambda row: row.right),
        "in form, any evidence, named": _rate(by_kind.get("in form", []), lambda row: row.right),
        "in form wrong without a flag": _rate(by_kind.get("in form", []), lambda row: row.wrong),
        "pairs both named": _rate(pairs, lambda row: row.right),
        "pairs wrong without a flag": _rate(pairs, lambda row: row.wrong),
        "clean false alarms": _rate(by_kind.get("clean", []), lambda row: bool(row.adopted) or row.flagged),
        "taken out flagged": _rate(lost, lambda row: row.flagged),
        "outside flagged": _rate(by_kind.get("outside", []), lambda row: row.flagged),
        "other form right or flagged": _rate(other, lambda row: row.right or row.flagged),
        "other form right": _rate(other, lambda row: row.right),
        "other form wrong without a flag": _rate(other, lambda row: row.wrong),
        "explained beyond 1.3 x the true floor": _rate(
            [row for row in rows if np.isfinite(row.true)], lambda row: row.calm and row.after > 1.3 * row.true
        ),
        "floor bracket holds the true one": _rate(
            [row for row in rows if np.isfinite(row.true)], lambda row: row.floor[0] <= row.true <= row.floor[1]
        ),
        "error after within 5 % of the true model's": Rate(sum(value < 1.05 for value in near), len(near)),
        "error after within 10 % of the true model's": Rate(sum(value < 1.10 for value in near), len(near)),
        "failed": _rate(rows, lambda row: bool(row.problem)),
    }


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
