"""Several robots of one kind, each measured with a study's agents: θ of each, and p(θ) over them.

`learn_fleet` asks the trials that a study or bank knows; no episode is driven. A robot that no θ explains is told as
such and left out of p(θ).
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from proxytune.arrays import Floats
from proxytune.errors import InputError
from proxytune.search import Knowledge, Population, population_of, summary_of
from proxytune.storage import FILE_NAME as DATABASE, Store
from proxytune.study.earlier import BANK_FILE, table_alone
from proxytune.study.facts import open_read_only, stored_run
from proxytune.study.opening import open_bank, read_target, with_scores
from proxytune.study.preflight import noise_of
from proxytune.study.run import goal_of, knowledge_of
from proxytune.study.settings import LEARNING, StudySettings, read_study_settings
from proxytune.study.study_run import StudyRun
from proxytune.usefulness import Estimate

FEWEST = 2
"""Fewer robots have nothing between them."""
FEW = 5
"""Of fewer the spread is mostly what was assumed of it before."""
NOTICED = 0.25
"""Robots differ where the interval of their spread begins above this share of one robot's own deviation."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot of a fleet: its name, its table of scores, what the study's trials say of its θ, and what is left out."""

    name: str
    path: Path
    knowledge: Knowledge
    cautions: tuple[str, ...]

    @property
    def fits(self) -> bool:
        """True if the proxy may have made its scores, as far as can be told."""
        return self.knowledge.misfit.fits is not False


@dataclass(frozen=True, eq=False)
class Fleet:
    """A fleet as its scores have it; what is told by name is in the parameters' own units."""

    settings: StudySettings  # of the study that knows the trials
    robots: tuple[Robot, ...]  # in the order in which they were given
    population: Population | None  # p(θ) over those that fit; None where these are fewer than two
    units: Mapping[str, str]  # the parameters' units by their names; "" where one has none

    @property
    def fitting(self) -> tuple[Robot, ...]:
        """The robots that p(θ) is of."""
        return tuple(robot for robot in self.robots if robot.fits)

    @property
    def left_out(self) -> tuple[str, ...]:
        """The names of those that no θ explains."""
        return tuple(robot.name for robot in self.robots if not robot.fits)

    @cached_property
    def given(self) -> Mapping[str, Mapping[str, Estimate]]:
        """θ of each robot that fits, given the whole fleet."""
        drawn = self.population.robots if self.population else np.empty((0, 0, 0))
        return {robot.name: self._told(drawn[:, row]) for row, robot in enumerate(self.fitting[: drawn.shape[1]])}

    @cached_property
    def mean(self) -> Mapping[str, Estimate]:
        """The mean of each parameter over robots of this kind."""
        return self._told(self.population.mean) if self.population else {}

    @cached_property
    def deviation(self) -> Mapping[str, Estimate]:
        """Standard deviation of each parameter between robots, measurement taken out."""
        return self._told(self.population.deviation, 0.0) if self.population else {}

    @cached_property
    def next_robot(self) -> Mapping[str, Estimate]:
        """A robot of this kind that has not been measured, cut off at the box."""
        return self._told(np.clip(self.population.next_robot, 0.0, 1.0)) if self.population else {}

    @cached_property
    def varies(self) -> Mapping[str, bool]:
        """Whether robots differ in a parameter by more than measurements of one do."""
        own = np.median([np.sqrt(np.diag(one.knowledge.unwidened.covariance)) for one in self.fitting], axis=0)
        widths = {box.name: box.high - box.low for box in self.settings.space.intervals}
        limits = {name: NOTICED * widths[name] * float(one) for name, one in zip(widths, own, strict=True)}
        return {name: told.low > limits[name] for name, told in self.deviation.items()}

    @property
    def correlations(self) -> Mapping[tuple[str, str], Estimate]:
        """Pairs of parameters that go together between robots beyond noise, with their correlation."""
        names, drawn = self.settings.space.names, self.population.correlation if self.population else None
        pairs = [(i, j) for j in range(len(names)) for i in range(j)] if drawn is not None else []
        told = {(names[i], names[j]): _estimate(summary_of(drawn[:, i, j])) for i, j in pairs}  # type: ignore[index]
        return {pair: found for pair, found in told.items() if found.low * found.high > 0.0}

    def _told(self, drawn: Floats, origin: float = 1.0) -> Mapping[str, Estimate]:
        """Sum up draws in the unit cube (draws, parameters), in the parameters' units; differences have no origin."""
        found, boxes = summary_of(drawn), self.settings.space.intervals
        return {
            box.name: _estimate(origin * box.low + (box.high - box.low) * found[:, row])
            for row, box in enumerate(boxes)
        }


def _estimate(summary: Floats) -> Estimate:
    low, middle, high = summary.tolist()
    return Estimate(middle, low, high)


def learn_fleet(path: Path, targets: Sequence[Path]) -> Fleet:
    """Learn θ of each robot and p(θ) over them, from the trials of a study or bank.

    An InputError if the study knows no trial or a table cannot be used, a RunError if no trial has an outcome.
    """
    settings = read_study_settings(path)
    settings.check_single()
    if settings.objective == LEARNING:
        raise settings.error("objective", f"'{LEARNING}' is not searched by scores, which tell θ; give another study")
    if len(targets) < FEWEST:
        told = f"a fleet takes at least {FEWEST} tables, got {len(targets)}"
        raise InputError(f"{told}; of one robot `study` tells θ, with learn_from and budget = 0")
    for one, times in Counter(target.resolve() for target in targets).items():
        if times > 1:
            raise InputError(f"{one}: is given twice; give each robot's table once")
    with _known(settings) as run:
        robots = tuple(_robots(run, targets))
        fitting = [robot.knowledge.unwidened for robot in robots if robot.fits]
        population = population_of(fitting, settings.seed) if len(fitting) >= FEWEST else None
        units = {name: run.study.family.parameters[name].unit for name in settings.space.names}
    return Fleet(settings, robots, population, units)


@contextmanager
def _known(settings: StudySettings) -> Iterator[StudyRun]:
    """The study as its trials were run; of a bank, its table will do."""
    if not settings.targets and not (settings.home / DATABASE).exists() and (settings.home / BANK_FILE).exists():
        with table_alone(open_bank(settings)) as run:
            yield run
        return
    with Store.read(settings.home) as store:
        yield open_read_only(settings, store) if settings.targets else stored_run(open_bank(settings), store)


def _robots(run: StudyRun, targets: Sequence[Path]) -> Iterator[Robot]:
    # All tables are read before any is learnt from.
    measured = []
    for path in targets:
        known, left_out = with_scores(replace(run.settings, targets=(path,)))
        table, unused = read_target(known, run.study.family)
        measured.append((run.of(replace(run.study, settings=known, target=table)), (*left_out, *unused)))
    first: Knowledge | None = None
    seen: dict[bytes, str] = {}
    for name, path, (one, left_out) in zip(_names(targets), targets, measured, strict=True):
        goal = goal_of(one)
        if first is None or goal.outputs != first.goal.outputs:
            first = own = knowledge_of(one, one.finished_trials())
        else:
            own = first.of(goal)
        like = seen.setdefault(goal.values.tobytes(), name)
        copied = "" if like == name else f"{path}: scores as {like} to the last digit; a copy is no other robot"
        yield Robot(name, path, own, tuple(filter(None, (*left_out, noise_of(one).caution, copied))))


def _names(targets: Sequence[Path]) -> list[str]:
    """Names of robots: those of their files, with their folders where these are alike."""
    stems = [path.stem for path in targets]
    if len(set(stems)) == len(stems):
        return stems
    return ["/".join(path.resolve().with_suffix("").parts[-2:]) for path in targets]
