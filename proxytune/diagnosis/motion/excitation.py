"""The drive to do next, designed: commands within a robot's limits and a room from which most is learnt of a question.

Of two rivals a and b that these drives cannot tell apart, a drive is worth what the best b leaves of what a does,

    T_ab = ½ min_{θ, m} ‖z_a − z_b(θ, m)‖²  [nats],

with z whitened increments: the expected evidence for a if a is right (T-optimality: Atkinson and Fedorov 1975), but for
the noise, which is fitted to b as well. It is linearised at every fit of b so far, the least of which counts; b is
fitted to what was designed, and the design goes on against that fit too. Where noise is to be told from what is
missing, a drive is worth the information

    ½ log|I + Dᵀ D|  [nats]

about the model's parameters and the effects that the log could not show (Bayesian D-optimality: Chaloner and Verdinelli
1995), D being the change of z by one standard deviation of a parameter, or by the middle probe of an effect.

The search is evolution (μ + λ) over whole sequences of commands, beginning with the manoeuvres of the library: pieces
are set, ramped, scaled, turned round, repeated and exchanged. A sequence that leaves the room is worth nothing. Where a
manoeuvre of the library is worth about as much, it is taken.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from proxytune.arrays import NORMAL_95
from proxytune.diagnosis.motion.drives import Drives, Floats
from proxytune.diagnosis.motion.evidence import AdoptedEffect, Findings, Variant
from proxytune.diagnosis.motion.fitting import Fit, fit_theta, intervals, loss_of, slopes
from proxytune.diagnosis.motion.innovations import increments, paths, span, whitener
from proxytune.diagnosis.motion.manoeuvres import LIBRARY, commands_of, mirrored
from proxytune.diagnosis.motion.screening import Candidate, candidates
from proxytune.space import Theta

REPEATS = 10
"""A drive is repeated so often to tell noise; and at most to tell rivals."""
FEWEST = 3
"""A drive is repeated at least so often: some of the drives are kept aside."""
ROUNDS = 2
"""A rival is fitted again so often to what was designed against it."""
GENERATIONS = 10
"""Generations of each round."""
KEPT, MADE = 12, 24
"""Sequences that live on, and that each generation makes of them."""
MOST_HZ = 30.0
"""Designed commands, and the poses measured of them, come no oftener."""
SIMPLER = 1.25
"""A manoeuvre of the library is taken if what was designed is not worth so many times as much."""
CLEAR_NATS = 15.0
"""A drive is to be repeated until this is expected for an effect against its rival: with this expectation the evidence
is above `rival_nats` 98 times in 100, its standard deviation being √(2 · 15)."""
BODY_M = 0.1
"""The path keeps so far from the room's edge, for the robot has a body."""
LEAST_ROOM_M = 0.6
"""A robot has at least so much floor, however little of it a log shows."""
SCALES = (1.0, 0.5, 0.25)
"""The library's manoeuvres begin the search at these sizes, straight on and mirrored."""


@dataclass(frozen=True)
class Limits:
    """Limits of the next drive."""

    # length and width of the floor [m]; where it is None, as far as the poses of the log reach
    room: tuple[float, float] | None = None
    fastest: float = 1.0  # greatest command, as a fraction of full speed
    seconds: float = 20.0  # length of a drive [s]


LIMITS = Limits()
"""Those of a diagnosis without others."""


class Course(NamedTuple):
    """Where the next drive is driven: from the middle of a room [m], along it; `start` is in the log's frame."""

    limits: Limits
    room: tuple[float, float]
    start: Floats
    drives: Drives

    @property
    def every(self) -> int:
        """Ticks of a command."""
        return math.ceil(self.drives.tick_hz / min(self.drives.rate_hz, MOST_HZ) - 1e-6)

    @property
    def rate_hz(self) -> float:
        """Commands per second."""
        return self.drives.tick_hz / self.every

    @property
    def times(self) -> Floats:
        """When commands are issued (rows,) [s]."""
        return np.arange(max(2, round(self.limits.seconds * self.rate_hz))) / self.rate_hz

    @property
    def seconds(self) -> float:
        """Length of a drive [s]."""
        return len(self.times) / self.rate_hz

    @property
    def library(self) -> Floats:
        """The manoeuvres of the library as commands (M, rows, 2) within the limits."""
        shapes = (commands_of(shape, self.times, self.drives.robot) for _, _, shape in LIBRARY)
        return self.within(np.stack(list(shapes)) * self.limits.fastest)

    def within(self, commands: Floats) -> Floats:
        """Commands (…, 2) cut off at what the robot may be told, and rounded."""
        robot, most = self.drives.robot, self.limits.fastest
        highest = np.array((most, 1.0 if robot.drive == "ackermann" else most))
        lowest = -highest * ((1.0 if robot.reverse else 0.0, 1.0) if robot.drive == "ackermann" else 1.0)
        return np.round(np.clip(commands, lowest, highest), 3)

    def imagine(self, commands: Floats, theta: Theta) -> Drives:
        """Make up drives that were never driven, of commands (E, rows, 2), with poses as a model has them, no noise."""
        drives, every = self.drives, self.every
        count, ticks = len(commands), commands.shape[1] * every
        apart = max(round(float(np.median(drives.last - drives.first))), math.ceil(drives.tick_hz / MOST_HZ))
        first = np.arange(0, ticks - apart, apart)
        episode, firsts = np.repeat(np.arange(count), len(first)), np.tile(first, count)
        batch = replace(
            drives,
            rate_hz=self.rate_hz,
            duties=np.repeat(commands, every, axis=1),
            issued=np.tile(np.arange(ticks) % every == 0, (count, 1)),
            rest=np.zeros((count, 2)),
            headings=np.full((count, ticks), self.start[2]),
            episode=episode,
            first=firsts,
            last=firsts + apart,
            poses=np.tile(self.start, (len(episode), 2, 1)),
            linked=firsts > 0,
            block=episode,
            travel=np.zeros((len(episode), 2)),
            wheels=None,
            after=None,
        )
        cosine, sine = math.cos(self.start[2]), math.sin(self.start[2])
        turned = np.array(((cosine, sine, 0.0), (-sine, cosine, 0.0), (0.0, 0.0, 1.0)))
        for _ in range(2):  # effects of places and headings act where the first pass leads
            walked = self.start + paths(batch, theta) @ turned
            poses = np.stack((walked[episode, firsts], walked[episode, firsts + apart]), axis=1)
            batch = replace(batch, poses=poses, headings=walked[:, :-1, 2])
        moved = np.abs(np.diff(poses, axis=1)[:, 0])
        return replace(batch, travel=np.stack((np.hypot(moved[:, 0], moved[:, 1]), moved[:, 2]), axis=1))

    def beyond(self, batch: Drives, drift: float) -> Floats:
        """How far each path comes out of the room, with two deviations of its drift [rad] after a metre (E,) [m]."""
        count = len(batch.duties)
        cosine, sine = math.cos(self.start[2]), math.sin(self.start[2])
        off = (batch.poses[:, 1, :2] - self.start[:2]) @ np.array(((cosine, -sine), (sine, cosine)))
        way = batch.travel.reshape(count, -1, 2) @ (1.0, 0.1)
        # Turns that drift on the way there, each by its share of it: a third of the square.
        strays = 2.0 * drift * np.sqrt(np.cumsum(way, axis=1) / 3.0) * np.hypot(*off.T).reshape(count, -1)
        reach = np.abs(off).reshape(count, -1, 2) + strays[:, :, None] - np.array(self.room) / 2.0 + BODY_M
        return np.asarray(reach.max(axis=(1, 2)))


def course_of(drives: Drives, limits: Limits) -> Course:
    """The course for the next drive, in the middle of where the log's drives were."""
    places = drives.poses[:, 1, :2]
    low, high = places.min(axis=0), places.max(axis=0)
    extent = high - low
    along = int(extent[1] > extent[0])
    extent = np.maximum(extent, LEAST_ROOM_M)
    room = limits.room or (float(extent[along]), float(extent[1 - along]))
    return Course(limits, room, np.array((*(low + high) / 2.0, along * np.pi / 2.0)), drives)


Told = tuple[tuple[str, ...], float]
"""What a drive tells apart, and how clearly a minute of it speaks [nats]."""


class Rivals:
    """The question which of an effect and its rivals is there; fewer nats a minute than `least` tell nothing.

    The effect counts at the size that was fitted and at half of it: a log that cannot tell it from rivals may not tell
    its size well.
    """

    def __init__(self, course: Course, model: Fit, effect: AdoptedEffect) -> None:
        self._course, self._model, self._effect = course, model, effect
        self.least = model.drives.rules.rival_nats
        parameters, figures = model.drives.robot.catalogue.parameters, model.drives.robot.figures
        half = {
            name: 0.5 * (model.theta[name] + parameters[name].neutral_value(figures))
            for coordinate in effect.free
            for name in coordinate
        }
        self._truths: tuple[Theta, ...] = (model.theta, {**model.theta, **half})
        shown = [course.imagine(course.library, truth) for truth in self._truths]
        # Models with a rival instead of the effect, fitted to what the effect does on some drive.
        self._fits = [[[self._first_fit(rival, batch)] for batch in shown] for rival in effect.rivals]

    def worth(self, commands: Floats) -> Floats:
        """What drives of these commands (E, rows, 2) are worth, all rivals and sizes together (E,)."""
        batches = [self._course.imagine(commands, truth) for truth in self._truths]
        apart = [
            np.min([nats_apart(self._model, batch, one) for one in fits], axis=0)
            for rival in self._fits
            for batch, fits in zip(batches, rival, strict=True)
        ]
        return np.asarray(np.log1p(apart).sum(axis=0))

    def doubt(self, commands: Floats) -> None:
        """Fit every rival to a drive of these commands (rows, 2) too."""
        for number, truth in enumerate(self._truths):
            batch = self._course.imagine(commands[None], truth)
            for rival in self._fits:
                rival[number].append(self._refit(batch, rival[number][-1]))

    def told(self, commands: Floats) -> Told:
        """Tell the effect, of the size that was fitted, from the rivals that a drive leaves behind, fitted to it."""
        batch = self._course.imagine(commands[None], self._model.theta)
        clear = {}
        for rival, (fits, *_) in zip(self._effect.rivals, self._fits, strict=True):
            apart = min(nats_apart(self._model, batch, self._refit(batch, one))[0] for one in fits)
            if (nats := float(apart) * 60.0 / self._course.seconds) > self.least:
                clear[rival.effect] = nats
        return (self._effect.effect, *clear), min(clear.values(), default=0.0)

    def _first_fit(self, rival: Candidate, batch: Drives) -> Variant:
        """Fit a rival to what the effect does on imagined drives, from the best of the rival's probes."""
        model, effect = self._model, self._effect
        theta = {name: value for name, value in model.theta.items() if name not in effect.names}
        free = tuple(coordinate for coordinate in model.free if coordinate not in effect.free) + rival.free
        starts = [rival.theta_at(theta, probe) for probe in rival.probes or ((),)]
        whiten = whitener(batch, model.noise)
        best = min(starts, key=lambda start: loss_of(batch, start, whiten))
        return self._refit(batch, Variant(best, free))

    def _refit(self, batch: Drives, rival: Variant) -> Variant:
        return rival._replace(theta=fit_theta(batch, *rival, whitener(batch, self._model.noise)))


def nats_apart(model: Fit, batch: Drives, rival: Variant) -> Floats:
    """Evidence of each imagined drive against a rival near its fit [nats] (E,)."""
    count, whiten = len(batch.duties), whitener(batch, model.noise)
    left = whiten.whiten(batch.measured - increments(batch, rival.theta)).reshape(count, -1)
    columns = slopes(batch, rival.theta, rival.free, whiten).reshape(*left.shape, -1)
    gram = np.swapaxes(columns, 1, 2) @ columns
    gram += 1e-9 * (1.0 + np.einsum("ecc->e", gram))[:, None, None] * np.eye(columns.shape[2])
    along = np.einsum("enc,en->ec", columns, left)
    explained = np.einsum("ec,ec->e", along, np.linalg.solve(gram, along[..., None])[..., 0])
    apart = np.maximum(0.0, np.einsum("en,en->e", left, left) - explained)
    # It is n/2 log(1 + 2 T / n) with n innovations, for the rival's noise is fitted too and takes up a part.
    return np.asarray(0.5 * left.shape[1] * np.log1p(apart / left.shape[1]))


class Unknown:
    """The question what is missing at all: parameters known badly, and effects that a log could not show."""

    def __init__(self, course: Course, model: Fit, unseen: Sequence[str]) -> None:
        self._course, self._model, self.least = course, model, 0.0
        forms = candidates(model.drives.robot, model.theta, ())
        own = {form.effect: form for form in reversed(forms) if form.probes and form.effect in unseen}
        self._forms = tuple(own.values())
        known = intervals(model)
        ranges = [(span(coordinate, model.drives), known[coordinate[0]]) for coordinate in model.free]
        self._deviations = np.array([(b - a) / (2.0 * NORMAL_95) / (high - low) for (low, high), (a, b) in ranges])

    def worth(self, commands: Floats) -> Floats:
        """The information of a minute of drives of these commands (E, rows, 2), each (E,)."""
        model, count = self._model, len(commands)
        batch = self._course.imagine(commands, model.theta)
        whiten, here = whitener(batch, model.noise), increments(batch, model.theta)
        columns = [slopes(batch, model.theta, model.free, whiten) * self._deviations]
        for form in self._forms:
            moved = form.theta_at(model.theta, form.middle_probe)
            columns.append(whiten.whiten(here - increments(batch, moved))[:, None])
        together = np.concatenate(columns, axis=1).reshape(count, -1, len(self._deviations) + len(self._forms))
        gram = np.swapaxes(together, 1, 2) @ together * 60.0 / self._course.seconds
        return np.asarray(0.5 * np.linalg.slogdet(np.eye(gram.shape[1]) + gram)[1])

    def doubt(self, commands: Floats) -> None:
        """Nothing is fitted to what is unknown."""

    def told(self, commands: Floats) -> Told:
        """Tell noise from what is missing."""
        return ("noise", "what is missing"), float(self.worth(commands[None])[0])


Worth = Callable[[Floats], Floats]
"""What drives of some commands (E, rows, 2) are worth [nats] (E,)."""


class Sequences:
    """Sequences of commands that evolve, those worth most kept."""

    def __init__(self, course: Course, model: Fit, seed: int) -> None:
        self._course, self._model = course, model
        self._random = np.random.default_rng(seed)
        both = (*course.library, *mirrored(course.library, course.drives.robot))
        self._living = np.stack([course.within(one * size) for one in both for size in SCALES])

    def evolve(self, worth: Worth) -> Floats:
        """Go on for some generations; what is worth most (rows, 2)."""
        living, values = self._living, self.values(self._living, worth)
        for _ in range(GENERATIONS):
            best = np.argsort(-values, kind="stable")[:KEPT]
            living, values = living[best], values[best]
            parents = self._random.integers(len(living), size=(2, MADE)).min(axis=0)
            made = np.stack([self._changed(living, int(parent)) for parent in parents])
            living = np.concatenate((living, made))
            values = np.concatenate((values, self.values(made, worth)))
        best = np.argsort(-values, kind="stable")
        self._living = living[best[:KEPT]]
        return np.asarray(living[best[0]])

    def values(self, commands: Floats, worth: Worth) -> Floats:
        """What sequences (E, rows, 2) are worth (E,); of those that leave the room how far they do, below 0."""
        batch = self._course.imagine(commands, self._model.theta)
        beyond = self._course.beyond(batch, self._model.noise.drive[2])
        return np.where(beyond > 0.0, -beyond, worth(commands))

    def _changed(self, living: Floats, parent: int) -> Floats:
        commands, random, rows = living[parent].copy(), self._random, living.shape[1]
        for _ in range(1 + int(random.integers(3))):
            shortest = max(2, round(0.2 * self._course.rate_hz))
            length = min(rows, round(shortest * (rows / shortest) ** random.uniform()))
            at = int(random.integers(rows - length + 1))
            part = slice(at, at + length)
            change = int(random.integers(7))
            if change == 0:
                commands[part] = self._level()
            elif change == 1:
                share = np.linspace(0.0, 1.0, length)[:, None]
                commands[part] = (1.0 - share) * self._level() + share * self._level()
            elif change == 2:
                commands[part] *= random.uniform(-1.3, 1.3)
            elif change == 3:
                commands[part] += 0.3 * random.uniform() * self._level()
            elif change == 4:
                commands[part] = commands[part][::-1]
            elif change == 5:
                other = living[int(random.integers(len(living)))]
                begin = int(random.integers(rows - length + 1))
                commands[part] = other[begin : begin + length]
            else:
                cycle = commands[at : at + max(shortest, length // int(random.integers(2, 9)))]
                commands[part] = np.resize(cycle, (length, 2))
        return self._course.within(commands)

    def _level(self) -> Floats:
        """Commands for a piece (2,): small ones as often as large ones, a third straight on, a sixth on the spot."""
        forward, turn = self._random.uniform(-1.0, 1.0, 2) * self._random.uniform(0.0, 1.0, 2)
        if self._course.drives.robot.drive == "ackermann":
            return np.array((forward, turn))
        kind = self._random.uniform()
        forward, turn = (forward, 0.0) if kind < 1 / 3 else (0.0, turn) if kind < 1 / 2 else (forward, 0.5 * turn)
        return np.array((forward - turn, forward + turn))


@dataclass(frozen=True)
class NextDrive:
    """A drive that tells rivals apart, or noise from what is missing if it is driven several times."""

    name: str  # what it is called
    description: str  # how to drive it
    between: tuple[str, ...]  # what it tells apart
    nats_per_minute: float  # how clearly a minute of it speaks
    commands: Floats  # as fractions of full speed, of a car as throttle and steering, a row each 1 / rate_hz (rows, 2)
    rate_hz: float  # commands per second
    times: int  # how often to drive it from the same commands
    room: tuple[float, float]  # length and width that it keeps to [m]
    # the best manoeuvre of the library and what a minute of that is worth [nats], within the same limits; None
    # where none keeps to the room
    manoeuvre: tuple[str, float] | None

    @property
    def seconds(self) -> float:
        """Length of a drive [s]."""
        return len(self.commands) / self.rate_hz


def design_drive(
    found: Findings, *, again: bool = False, limits: Limits = LIMITS, unseen: Sequence[str] = (), seed: int = 1
) -> NextDrive | None:
    """Design the drive that tells an adopted effect from its rivals, or noise from what is missing; None without both.

    Noise is told from what is missing `again`: by REPEATS drives. Effects that the log could not show are `unseen`.
    """
    course = course_of(found.model.drives, limits)
    contested = next((effect for effect in found.adopted if effect.rivals), None)
    drive = _settle(Rivals(course, found.model, contested), course, found.model, seed) if contested else None
    if drive is None and again:
        drive = _settle(Unknown(course, found.model, unseen), course, found.model, seed)
    return replace(drive, times=REPEATS) if drive and again else drive


def _settle(question: "Rivals | Unknown", course: Course, model: Fit, seed: int) -> NextDrive | None:
    """Design a drive for a question, and take it or a manoeuvre of the library; None where neither tells anything."""
    sequences, library = Sequences(course, model, seed), course.library
    for _ in range(ROUNDS):
        designed = sequences.evolve(question.worth)
        question.doubt(designed)
    values = sequences.values(np.concatenate((library, designed[None])), question.worth)
    known = int(np.argmax(values[:-1]))
    offers = {LIBRARY[known][0]: library[known]} if values[known] > 0.0 else {}
    offers |= {"designed": designed} if values[-1] > 0.0 else {}
    if not offers:
        return None
    told = {name: question.told(one) for name, one in offers.items()}
    name = max(told, key=lambda one: told[one][1] * (1.0 if one != "designed" else 1.0 / SIMPLER))
    between, nats = told[name]
    if nats <= question.least:
        return None
    length, width = course.room
    how = "the commands of next/commands.csv" if name == "designed" else LIBRARY[known][1]
    return NextDrive(
        name="the designed drive" if name == "designed" else name,
        description=f"{how}, {course.limits.seconds:g} s within {length:.1f} × {width:.1f} m, from its middle along it",
        between=between,
        nats_per_minute=nats,
        commands=offers[name],
        rate_hz=course.rate_hz,
        times=min(REPEATS, max(FEWEST, math.ceil(CLEAR_NATS * 60.0 / course.seconds / nats))),
        room=course.room,
        manoeuvre=next(((one, told[one][1]) for one in told if one != "designed"), None),
    )
