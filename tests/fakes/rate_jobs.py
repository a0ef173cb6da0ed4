"""What rates.py diagnoses: the cases of either generator, each kind a number of jobs."""

from dataclasses import dataclass
from types import ModuleType

import hidden
import numpy as np
import second_hidden as second
from bullet_truth import BULLET, BulletCase

GENERATORS: dict[str, ModuleType] = {"first": hidden, "second": second}
"""Modules with cases of every kind, and a make_log for them."""


@dataclass(frozen=True)
class Job:
    """A case to diagnose; `without` is taken out of the catalogue."""

    kind: str
    case: hidden.Case | second.Case | BulletCase
    without: str = ""

    @property
    def generator(self) -> str:
        """Which generator makes its log: "first" or "second"."""
        return "second" if isinstance(self.case, second.Case) else "first"

    @property
    def right(self) -> tuple[tuple[str, ...], ...]:
        """For every hidden effect, the names that count as right."""
        return getattr(self.case, "right", ())


def all_jobs(every: int = 1, generator: str = "first") -> tuple[Job, ...]:
    """Every n-th case of each kind, the kinds mixed so that any beginning has a share of each.

    The second generator has cases of its own, and none of the bullet plant.
    """
    whole = _by_kind(GENERATORS[generator])
    if generator == "first":
        whole["bullet"] = [Job("bullet", case) for case in BULLET]
    chosen = [_shuffled(jobs[::every]) for jobs in whole.values()]
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
    }


def _shuffled(jobs: list[Job]) -> list[Job]:
    """In an order of their own, so that neighbours do not hide the same effect."""
    return [jobs[number] for number in np.random.default_rng(1).permutation(len(jobs))]
