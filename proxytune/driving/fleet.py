"""Robots driven side by side, control step by control step: each goes as it does by itself, to the bit.

`drive_fleet` asks drivers for commands; `Rollouts` is the same one step at a time. A single episode is a fleet of one:
`drive`. `follow` drives recorded commands without a camera. Robots that crash, leave their course or whose driver fails
drop out. Our effects filter a batch as they filter one robot, unless they draw at random; those and a user's own are
asked for each robot by itself.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.bullet import BulletPlant
from proxytune.driving.cameras import Views
from proxytune.driving.episode import (
    TICK_HZ,
    Course,
    Drive,
    Driver,
    Instance,
    Sees,
    Shown,
    alike,
    ask_many,
    begin_all,
    grouped,
    measured,
    picture_only,
    show,
)
from proxytune.driving.expert import Pupil
from proxytune.driving.optics import joined
from proxytune.driving.plants import Drivetrain, PlanarFleet, PlanarPlant, Plant
from proxytune.driving.robot import Robot
from proxytune.effects import DRIVES, Chain, Effect, FilterContext, Learnt, LearntCommands, Memory, Signal, Stage, Trace
from proxytune.errors import EpisodeError
from proxytune.space import Parameter

PLANTS = ("bullet", "planar")

AT_ONCE = {"bullet": 4, "planar": 48}
"""So many robots drive side by side on a plant: each world of Bullet takes 33 MB, and joblib ends what grows by 300."""
Result = TypeVar("Result")


class Fleet(Protocol):
    """Robots side by side, each on a floor of its own."""

    def move(self, twists: Signal, robots: Sequence[int], /) -> tuple[Signal, Sequence[bool]]:
        """The poses (robots, time, 3) that twists of some robots lead to, a tick each, and whether each has crashed."""


@dataclass(frozen=True)
class Plants:
    """A plant for each robot."""

    plants: Sequence[Plant]

    def move(self, twists: Signal, robots: Sequence[int]) -> tuple[Signal, Sequence[bool]]:
        """Let one robot after the other follow its twists."""
        poses, crashed = np.empty((*twists.shape[:2], 3)), []
        for row, robot in enumerate(robots):
            poses[row], hit = self.plants[robot].move(twists[row])
            crashed.append(hit)
        return poses, crashed


def plant_at(plant: str, robot: Robot, start: Signal) -> Plant:
    """One of PLANTS with the robot at a starting pose (3,)."""
    return BulletPlant(robot, start, 1.0 / TICK_HZ) if plant == "bullet" else PlanarPlant(start, 1.0 / TICK_HZ)


@contextmanager
def fleet_at(plant: str, robot: Robot, starts: Signal) -> Iterator[Fleet]:
    """One of PLANTS with such a robot at each of several starting poses (robots, 3)."""
    if plant == "planar":
        yield PlanarFleet(starts, 1.0 / TICK_HZ)
        return
    with ExitStack() as stack:
        yield Plants([stack.enter_context(plant_at(plant, robot, start)) for start in starts])


_OURS = frozenset((*(effect for effects in DRIVES.values() for effect in effects.values()), Learnt, LearntCommands))
"""Effects that do to each robot of a batch, to the bit, what they do to one, unless they draw."""


@dataclass(frozen=True)
class _Apart:
    """An effect that is done to each robot by itself, whose seed it draws by, unless that has `left`: these grow."""

    effect: Effect
    seeds: tuple[int, ...]
    left: set[int]
    name: ClassVar[str] = "apart"
    stage: ClassVar[Stage] = Stage.COMMAND
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    trace: ClassVar[Trace | None] = None

    def begin(self, context: FilterContext) -> list[Memory]:
        """Each robot's memory, from a context of arrays (robots, …)."""
        one = Chain((self.effect,))  # which gives the effect its own seed
        parts = zip(self.seeds, context.rest, context.headings, context.places, strict=True)
        return [
            one.begin(replace(context, seed=seed, rest=rest, headings=headings, places=places))[0]
            for seed, rest, headings, places in parts
        ]

    def apply(self, signal: Signal, memory: list[Memory]) -> tuple[Signal, list[Memory]]:
        """Filter each robot's next chunk."""
        filtered, kept = np.array(signal, dtype=float), list(memory)
        for robot in range(len(filtered)):
            if robot not in self.left:
                filtered[robot], kept[robot] = self.effect.apply(signal[robot], memory[robot])
        return filtered, kept


class _Band:
    """Robots of a fleet that are of one domain instance, by their numbers in it.

    Those of them `here` are still under way, in these `rows` among the fleet's; `views` are None where nobody looks.
    """

    def __init__(self, instance: Instance, robots: Sequence[int], courses: Sequence[Course], *, blind: bool) -> None:
        figures, own = instance.robot.figures, [courses[robot] for robot in robots]
        self.robots, self.here, self.rows = list(robots), list(range(len(robots))), list(robots)
        self._left: set[int] = set()
        self._train, self._alone = instance.drivetrain, len(own) == 1
        if self._alone:  # without an axis of robots our filters take less time
            start = own[0].start
            resting = FilterContext(TICK_HZ, np.zeros(2), figures, own[0].seed, start[2:], start[None, :2])
        else:
            starts = np.stack([course.start for course in own])
            resting = FilterContext(TICK_HZ, np.zeros((len(own), 2)), figures, 0, starts[:, 2:], starts[:, None, :2])
            seeds = tuple(course.seed for course in own)
            self._train = _side_by_side(instance.drivetrain, seeds, self._left)
        self._memory: Any = self._train.begin(resting)
        contexts = [FilterContext(TICK_HZ, course.start, figures, course.seed) for course in own]
        self.views = None if blind else Views(instance.camera, instance.image, contexts)

    def twists(self, duties: Signal) -> Signal:
        """The twists (robots, time, 3) that the next duties (robots, time, 2) of all of them lead to."""
        if self._alone:
            twists, self._memory = self._train.apply(duties[0], self._memory)
            return twists[None]
        twists, self._memory = self._train.apply(duties, self._memory)
        return twists

    def leave(self, rows: dict[int, int]) -> None:
        """Keep those whose rows among the robots under way are given by their numbers in the fleet."""
        self.here = [own for own, robot in enumerate(self.robots) if robot in rows]
        self.rows = [rows[self.robots[own]] for own in self.here]
        self._left.update(set(range(len(self.robots))) - set(self.here))


def _side_by_side(train: Drivetrain, seeds: tuple[int, ...], left: set[int]) -> Drivetrain:
    """A drivetrain over a leading axis of robots, each with a seed of its own."""

    def chain(of_one: Chain) -> Chain:
        together = (type(one) in _OURS and not (one.trace and one.trace.draws) for one in of_one.effects)
        pairs = zip(of_one.effects, together, strict=True)
        return Chain(tuple(one if same else _Apart(one, seeds, left) for one, same in pairs))

    return replace(train, command=chain(train.command), actuation=chain(train.actuation), motion=chain(train.motion))


class Rollouts:
    """Episodes under way side by side, one control step after the other, all for the same time.

    There is time for so many `steps`; each command is held for `hold` ticks. The robots still driven are `under_way`,
    and `here` in arrays over all. Their `poses` (robots, ticks, 3) are those after each tick of the last step,
    before the first the starts; whether each has `crashed` then, or all have `new_pictures`, is told too.
    """

    def __init__(
        self, instances: Sequence[Instance], courses: Sequence[Course], fleet: Fleet, *, blind: bool = False
    ) -> None:
        """Put robots of these instances at their starts; `fleet` has them there. Without cameras where `blind`."""
        control_hz = instances[0].robot.figures["control_rate"]
        self.hold, self._fleet, self._courses = round(TICK_HZ / control_hz), fleet, courses
        members: dict[int, list[int]] = {}
        for robot, instance in enumerate(instances):
            members.setdefault(id(instance), []).append(robot)
        self._bands = [_Band(instances[own[0]], own, courses, blind=blind) for own in members.values()]
        self._held = np.zeros((len(courses), self.hold, 2))
        self.steps = round(courses[0].seconds * control_hz)
        self.under_way = list(range(len(courses)))
        self.here: slice | list[int] = slice(None)
        self.new_pictures = True
        self.poses: Signal = np.stack([course.start[None] for course in courses])
        self.crashed: Sequence[bool] = [False] * len(courses)

    def planes(self, first: int = 0) -> NDArray[np.uint8]:
        """The newest pictures (robots under way, 3, rows, columns), right from the first pixel that is looked at on."""
        shown = [band.views.planes(band.here, first) for band in self._bands if band.views]
        if len(shown) == 1:
            return shown[0]
        planes = np.empty((len(self.under_way), *shown[0].shape[1:]), dtype=np.uint8)
        for band, own in zip(self._bands, shown, strict=True):
            planes[band.rows] = own
        return planes

    def pictures(self, rows: Any = slice(None)) -> NDArray[np.uint8]:
        """The newest pictures (n, rows, columns, 3) of these rows of the robots under way."""
        return joined(self.planes()[rows])

    @property
    def ended(self) -> list[bool]:
        """Tell which of the robots under way have crashed or left their courses."""
        ends = zip(self.under_way, self.crashed, self.poses[:, -1, :2].tolist(), strict=True)
        return [hit or self._courses[robot].ended(x, y) for robot, hit, (x, y) in ends]

    def step(self, commands: Signal) -> None:
        """Hold a command of each robot under way, (robots under way, 2), for one control step."""
        self._held[self.here] = commands[:, None]
        held = self._held.copy()  # effects remember what they are given
        if len(self._bands) == 1 and len(held) == len(self.under_way):
            twists = self._bands[0].twists(held)
        else:
            twists = np.empty((len(self.under_way), self.hold, 3))
            for band in self._bands:
                twists[band.rows] = band.twists(held[band.robots])[band.here]
        self.poses, self.crashed = self._fleet.move(twists, self.under_way)
        for band in self._bands:
            if band.views:
                band.views.pass_by(self.poses if len(self._bands) == 1 else self.poses[band.rows], band.here)
                self.new_pictures = band.views.changed

    def keep(self, rows: Sequence[int]) -> None:
        """Go on with these rows of the robots under way alone."""
        if len(rows) == len(self.under_way):
            return
        self.here = self.under_way = [self.under_way[row] for row in rows]
        self.poses, self.crashed = self.poses[list(rows)], [self.crashed[row] for row in rows]
        row_of = {robot: row for row, robot in enumerate(self.under_way)}
        for band in self._bands:
            band.leave(row_of)
        self._bands = [band for band in self._bands if band.here]


def drive_fleet(
    instances: Sequence[Instance],
    fleet: Fleet,
    drivers: Sequence[Driver],
    courses: Sequence[Course],
    sees: Sees = picture_only,
) -> list[Drive | EpisodeError]:
    """Drive robots side by side, each until the time is over, it crashes, its course ends or its driver fails.

    Courses are for the same time, the fleet is at their starts, and drivers are shown what `sees` makes of picture and
    true pose (an expert's is `Sight`). Gives each robot's drive, or an EpisodeError where its driver failed.
    """
    control_hz = instances[0].robot.figures["control_rate"]
    drives = _Drives(Rollouts(instances, courses, fleet), drivers, [instance.robot for instance in instances], sees)
    for step in range(drives.rollouts.steps):
        drives.ask(step / control_hz)
        if not drives.drivers:
            break
        drives.step(step)
    return drives.results


class _Drives:
    """Drives under way, in the rows of the robots under way, and the `results` of those that ended."""

    def __init__(self, rollouts: Rollouts, drivers: Sequence[Driver], robots: Sequence[Robot], sees: Sees) -> None:
        self.rollouts, self.drivers, self._sees = rollouts, alike(drivers), sees
        self.results: list[Any] = [None] * len(drivers)
        self._groups = grouped(self.drivers)
        self._by_picture = all(isinstance(driver, Pupil) for driver in drivers)
        self._memories, problems = begin_all(self.drivers, robots)
        self._shown: Shown | None = None
        self._commands = np.zeros((len(drivers), 2))
        self._issued = np.empty((len(drivers), rollouts.steps, 2))
        self._poses = np.empty((len(drivers), rollouts.steps * rollouts.hold + 1, 3))
        self._poses[:, 0] = rollouts.poses[:, 0]
        self._fail(problems)

    def ask(self, time_s: float) -> None:
        """Ask for the next commands; a policy that has seen the pictures before would answer the same."""
        if not self.drivers or (self._by_picture and not self.rollouts.new_pictures):
            return
        see: Callable[[list[int]], Any] = self.rollouts.pictures
        if self._sees is not picture_only:
            sights = zip(self.rollouts.pictures(), self.rollouts.poses[:, -1], strict=True)
            seen = [self._sees(*one) for one in sights]
            self._shown, see = [], lambda rows: [seen[row] for row in rows]
        elif self._shown is None or self.rollouts.new_pictures:
            self._shown = show(self.drivers, self.rollouts.planes, self._groups)
        self._commands, self._memories, problems = ask_many(self.drivers, self._shown, see, self._memories, time_s)
        self._fail(problems)

    def step(self, number: int) -> None:
        """Go on for the control step of this number, and leave out whoever has ended with it."""
        rollouts, first = self.rollouts, number * self.rollouts.hold + 1
        rollouts.step(self._commands)
        self._issued[rollouts.here, number] = self._commands
        self._poses[rollouts.here, first : first + rollouts.hold] = rollouts.poses
        ended = rollouts.ended if number + 1 < rollouts.steps else [True] * len(self.drivers)
        if not any(ended):
            return
        for row, robot in enumerate(rollouts.under_way):
            if ended[row]:
                poses, issued = self._poses[robot, : first + rollouts.hold], self._issued[robot, : number + 1]
                self.results[robot] = Drive(poses, issued, bool(rollouts.crashed[row]), self._memories[row])
        self._go_on([row for row, over in enumerate(ended) if not over])

    def _fail(self, problems: Mapping[int, EpisodeError]) -> None:
        """Leave out the robots in these rows."""
        if problems:
            for row, problem in problems.items():
                self.results[self.rollouts.under_way[row]] = problem
            self._go_on([row for row in range(len(self.drivers)) if row not in problems])

    def _go_on(self, rows: list[int]) -> None:
        self.rollouts.keep(rows)
        self.drivers = [self.drivers[row] for row in rows]
        self._groups = grouped(self.drivers)
        self._memories = [self._memories[row] for row in rows]
        self._commands, self._shown = self._commands[rows], None


def drive(instance: Instance, plant: Plant, driver: Driver, course: Course, sees: Sees = picture_only) -> Drive:
    """Drive one robot as `drive_fleet` drives several.

    Raises:
        EpisodeError: If the agent raises, or its answer is not two finite duties.
    """
    return only(drive_fleet([instance], Plants([plant]), [driver], [course], sees))


def only(results: Sequence[Result | EpisodeError]) -> Result:
    """The result of a fleet of one; if it is an EpisodeError, that is raised."""
    [result] = results
    if isinstance(result, EpisodeError):
        raise result
    return result


def follow(instance: Instance, plant: Plant, start: Signal, duties: Signal, seed: int) -> Signal:
    """Drive commands on open floor.

    They are duties (rows, 2), one per control step, bent by an instance's effects, which draw by the seed; the plant
    is at the start (3,). Gives the measured pose at each command (rows, 3).
    """
    course = Course(start, 0.0, seed, lambda x, y: False)
    rollouts, poses = Rollouts([instance], [course], Plants([plant]), blind=True), [start[None]]
    for command in duties[:-1]:
        rollouts.step(command[None])
        poses.append(rollouts.poses[0])
    hold = round(TICK_HZ / instance.robot.figures["control_rate"])
    return np.asarray(measured(instance, np.concatenate(poses), seed)[::hold])
