"""Episodes of one domain instance as one batch, step by step: each goes as it does by itself, to the bit.

Our effects filter a batch as they filter one robot, unless they draw at random; others get a drivetrain for each robot.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.domain import Episode, Policy
from proxytune.driving.agent import Command
from proxytune.driving.cameras import Views
from proxytune.driving.episode import TICK_HZ, Course, Fleet, Instance, ask, check_command
from proxytune.driving.expert import Pupil
from proxytune.driving.plants import Drivetrain, DrivetrainState
from proxytune.effects import CATALOGUE, Effect, FilterContext, Learnt, Signal
from proxytune.errors import EpisodeError

AT_ONCE = 16
"""So many robots drive side by side: each has a world in memory."""

_OURS = frozenset((*CATALOGUE.values(), Learnt))


@dataclass(frozen=True)
class UnbatchedDrivetrain:
    """A drivetrain for each robot by itself.

    Attributes:
        one: That of one robot.
        seeds: Each robot's.
    """

    one: Drivetrain
    seeds: tuple[int, ...]

    def begin(self, context: FilterContext) -> list[DrivetrainState]:
        """Each robot's memory, from a context of arrays (robots, …)."""
        parts = zip(self.seeds, context.rest, context.headings, context.places, strict=True)
        return [
            self.one.begin(replace(context, seed=seed, rest=rest, headings=headings, places=places))
            for seed, rest, headings, places in parts
        ]

    def apply(self, signal: Signal, memory: list[DrivetrainState]) -> tuple[Signal, list[DrivetrainState]]:
        """The twists (robots, time, 3) that the next duties (robots, time, 2) lead to."""
        twists, kept = zip(*(self.one.apply(*part) for part in zip(signal, memory, strict=True)), strict=True)
        return np.stack(twists), list(kept)


def batched_drivetrain(drivetrain: Drivetrain, seeds: tuple[int, ...]) -> Drivetrain | UnbatchedDrivetrain:
    """A drivetrain over a leading axis of robots, each with a seed of its own."""
    chains = (drivetrain.command, drivetrain.actuation, drivetrain.motion)
    alike = all(_same_in_batches(effect) for chain in chains for effect in chain.effects)
    return drivetrain if alike else UnbatchedDrivetrain(drivetrain, seeds)


def _same_in_batches(effect: Effect) -> bool:
    """Tell whether it does to each robot of a batch, to the bit, what it does to one: ours do, unless they draw."""
    return type(effect) in _OURS and (effect.trace is None or effect.trace.draws is None)


def groups_of(episodes: Sequence[Episode]) -> Iterator[list[Episode]]:
    """Episodes in their order, cut into groups of one θ that can be driven side by side."""
    for _, same in itertools.groupby(episodes, key=lambda episode: episode.theta):
        group = list(same)
        yield from (group[first : first + AT_ONCE] for first in range(0, len(group), AT_ONCE))


def drive_together(instance: Instance, fleet: Fleet, policy: Policy, courses: Sequence[Course]) -> list[Signal]:
    """Let one policy drive several robots, each until the time is over, it crashes or its course ends.

    Args:
        instance: What bends commands, motion and pictures.
        fleet: What moves, at the starts.
        policy: Who drives; a picture that has not changed is answered as before.
        courses: What each drives, all for the same time.

    Returns:
        Each robot's poses, (ticks + 1, 3) from its start on.

    Raises:
        EpisodeError: If the policy raises, or an answer is not two finite duties.
    """
    rollouts, control_hz = _Rollouts(instance, fleet, courses), instance.robot.figures["control_rate"]
    for step in range(round(courses[0].seconds * control_hz)):
        if rollouts.new_pictures:
            rollouts.obey(answers(policy, rollouts.pictures, step / control_hz))
        rollouts.step()
        if not rollouts.under_way:
            break
    return [np.concatenate(driven) for driven in rollouts.poses]


class _Rollouts:
    """Episodes under way, as a Rollout is one.

    Attributes:
        under_way: The robots that have neither crashed nor left their courses.
        new_pictures: Whether they have new pictures since the last step.
        poses: Each robot's, step by step.
    """

    def __init__(self, instance: Instance, fleet: Fleet, courses: Sequence[Course]) -> None:
        figures, self._fleet, self._courses = instance.robot.figures, fleet, courses
        starts, seeds = np.stack([course.start for course in courses]), tuple(course.seed for course in courses)
        self._hold = round(TICK_HZ / figures["control_rate"])
        self._commands = np.zeros((len(courses), 2))
        self._drivetrain = batched_drivetrain(instance.drivetrain, seeds)
        resting = FilterContext(TICK_HZ, np.zeros((len(courses), 2)), figures, 0, starts[:, 2:], starts[:, None, :2])
        self._memory: Any = self._drivetrain.begin(resting)
        settings = [FilterContext(TICK_HZ, one.start, figures, one.seed) for one in courses]
        self._views = Views(instance.camera, instance.image, settings)
        self.under_way = list(range(len(courses)))
        self.new_pictures = True
        self.poses = [[start[None]] for start in starts]

    @property
    def pictures(self) -> NDArray[np.uint8]:
        """The newest picture of each robot under way, (robots, rows, columns, 3)."""
        return self._views.pictures(self.under_way)

    def obey(self, commands: Sequence[Command] | Signal) -> None:
        """Hold these commands, one for each robot under way, from now on."""
        self._commands[self.under_way] = commands

    def step(self) -> None:
        """Go on for one control step."""
        held = np.repeat(self._commands[:, None], self._hold, axis=1)
        twists, self._memory = self._drivetrain.apply(held, self._memory)
        poses, crashed = self._fleet.move(twists, self.under_way)
        moved = list(zip(self.under_way, poses, crashed, strict=True))
        for robot, driven, _ in moved:
            self.poses[robot].append(driven)
        self._views.pass_by(poses, self.under_way)
        self.new_pictures = self._views.changed
        ended = [hit or self._courses[robot].ended(*driven[-1, :2].tolist()) for robot, driven, hit in moved]
        self.under_way = [robot for robot, over in zip(self.under_way, ended, strict=True) if not over]


def answers(policy: Policy, pictures: NDArray[np.uint8], time_s: float) -> Sequence[Command] | Signal:
    """A policy's commands for pictures, all at once where it can.

    Raises:
        EpisodeError: With the time [s], if it raises or answers with something that is not two finite duties for each.
    """
    act_many = getattr(policy, "act_many", None)
    if act_many is None:
        return [ask(Pupil(policy), picture, None, time_s)[0] for picture in pictures]
    try:
        commands = np.asarray(act_many(pictures), dtype=float)
    except Exception as problem:
        raise EpisodeError(f"raised {type(problem).__name__} at {time_s:.2f} s: {problem}") from problem
    if commands.shape[:1] != (len(pictures),):
        raise EpisodeError(f"answered {len(pictures)} pictures with shape {commands.shape} at {time_s:.2f} s")
    for command in commands:
        check_command(command, time_s)
    return commands
