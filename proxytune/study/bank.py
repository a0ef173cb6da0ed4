"""A bank: a study without a target, whose trials other studies learn from; and what to know before going to the robot.

`run_bank` simulates a quasi-random design. Each of some trials is then taken for a target in turn, with the noise that
another placement makes (`bank_of`): how well would these agents and so many starts tell each parameter?
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from proxytune.errors import RunError
from proxytune.search import Expected, Trial, design_point, expect_of
from proxytune.storage import TrialRecord
from proxytune.study.facts import check_facts
from proxytune.study.preflight import check_some_work, run_preflight
from proxytune.study.run import goal_of
from proxytune.study.settings import StudySettings
from proxytune.study.study_run import StudyRun, outputs_of

TOGETHER = 8
"""So many trials are simulated at once."""
WITHIN = 1 / 30
"""A parameter is told to so much of its range, either side, by its mean 95 % interval: trim to 0.02."""


@dataclass(frozen=True)
class Bank:
    """A bank as it stands."""

    settings: StudySettings  # of its study
    trials: int  # how many trials it has
    expected: Mapping[int, Expected]  # what a target measured from some first starts will tell, by their number
    needed: Mapping[str, int | None]  # how many starts tell each parameter to `WITHIN`; None where all do not
    units: Mapping[str, str]  # the parameters' units by their names; "" where one has none
    failed: Mapping[str, int]  # in how many trials an agent failed from every start, where in any

    def widths(self, starts: int) -> dict[str, float]:
        """Mean width of each parameter's 95 % interval, by a target that is measured from so many starts."""
        pairs = zip(self.settings.space.intervals, self.expected[starts].widths, strict=True)
        return {box.name: float(width) * (box.high - box.low) for box, width in pairs}

    @property
    def agents(self) -> tuple[tuple[str, float], ...]:
        """The agents with their mean shares in what is told of all parameters, the most telling first."""
        told = [dict(one.agents) for one in self.expected[self.settings.starts].information]
        shares = {name: np.mean([one.get(name, 0.0) for one in told]) for name in self.settings.agents if told}
        return tuple(sorted(((name, float(share)) for name, share in shares.items()), key=lambda pair: -pair[1]))


def run_bank(run: StudyRun) -> None:
    """Simulate what is left of a bank's design; raises as any study, and if what it depends on has changed."""
    check_facts(run)
    run_preflight(run)
    settings, done = run.settings, len(run.finished_trials())
    for first in range(done, settings.budget, TOGETHER):
        numbers = range(first, min(first + TOGETHER, settings.budget))
        points = [design_point(settings.space, index, settings.seed) for index in numbers]
        pairs = zip(numbers, map(settings.space.theta, points), strict=True)
        trials = [TrialRecord(index + 1, theta, "finished") for index, theta in pairs]
        what = f"trials {first + 1} to {first + len(trials)} of {settings.budget}"
        outcomes = run.outcomes([episode for trial in trials for episode in run.episodes_of(trial)], what)
        if not first:
            check_some_work(outcomes.values(), what)
        failed = [sum(outcomes[e].metrics is None for e in run.episodes_of(trial)) for trial in trials]
        run.save_trials(*(replace(one, failed_episodes=n) for one, n in zip(trials, failed, strict=True)))
        run.watcher.finished(what)


def bank_of(run: StudyRun) -> Bank:
    """Sum up a bank, simulating nothing; a RunError if it has no trial, or the store lacks episodes of one."""
    settings, goal, records = run.settings, goal_of(run), run.finished_trials()
    if not records:
        raise RunError(f"{run.store.path}: no trial is finished yet")
    driven = [run.known(run.episodes_of(trial)).values() for trial in records]
    values = [settings.space.values(trial.theta) for trial in records]
    expected = {}
    for starts in sorted({1, settings.starts // 2 or 1, settings.starts}):
        means = [outputs_of(run.study, [one for one in each if one.episode.start < starts]) for each in driven]
        trials = [Trial(place, None, outcome) for place, outcome in zip(values, means, strict=True)]
        noise = goal.noise * settings.starts / starts
        expected[starts] = expect_of(settings.space, trials, replace(goal, noise=noise), settings.seed)
    reach = [
        _starts_needed({n: one.widths[row] / 2.0 for n, one in expected.items()}, run.study.family.starts)
        for row in range(len(settings.space.names))
    ]
    needed = dict(zip(settings.space.names, reach, strict=True))
    units = {name: run.study.family.parameters[name].unit for name in settings.space.names}
    worked = [{one.episode.agent for one in each if one.metrics is not None} for each in driven]
    failed = {name: sum(name not in agents for agents in worked) for name in settings.agents}
    failed = {name: trials for name, trials in failed.items() if trials}
    return Bank(settings, len(records), expected, needed, units, failed)


def _starts_needed(reach: Mapping[int, float], most: int) -> int | None:
    """The fewest starts whose interval reaches no further than WITHIN; None where that is more than there are."""
    # Squared reaches follow a + b / starts: a is what trials leave unknown, and no start makes it less.
    counts = np.array(list(reach))
    design = np.stack([np.ones(len(counts)), 1.0 / counts], axis=1)
    (left, by_start), *_ = np.linalg.lstsq(design, np.array(list(reach.values())) ** 2, rcond=None)
    enough = [n for n in range(1, most + 1) if left + by_start / n <= WITHIN**2]
    return enough[0] if enough else None
