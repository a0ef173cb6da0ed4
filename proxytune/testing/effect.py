"""The promises of every effect: `check_effect` filters signals that an effect could meet, and compares the answers.

A broken promise is one line (`claim`). An effect vanishes at its neutral values, matters all along its range, is a
causal filter whose memory a signal may be cut at, and draws from its seed alone.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from proxytune.driving import Robot, read_robot
from proxytune.effects import CHANNELS, MEMBERS, Effect, FilterContext, Signal, Stage, problems
from proxytune.errors import ConformanceError, ProxytuneError
from proxytune.extensions import describe
from proxytune.space import Parameter

ROBOT = "duckiebot"
"""Whose nominal figures an extension is told where a test names no robot."""
RATE_HZ = 60.0
HELD = 3
"""Samples over which a command holds."""
STANDS = 0.1
"""The share of commands that are to stand."""
LENGTHS = {150: 1800, 15: 2700, HELD: 2700}
"""A signal over which every parameter must matter: samples of commands that hold so long."""
PICTURE = {"camera_columns": 4.0, "camera_rows": 3.0}
"""The size of the pictures that image effects are tried on: no two sides alike, so that none is taken for the other."""
WAY = np.repeat(np.linspace(0.0, 21.0, 225), 2) * np.tile((1.0, -1.0), 225)
PLACES = np.stack([axis for way in WAY for axis in ((way, 0.0), (0.0, way))])
"""Places [m] along both axes that reach beyond every patch, nearest first, to and fro, shape (places, 2)."""


@dataclass(frozen=True)
class Subject:
    """An effect class that is put to the test, the robot whose nominal figures it is told, and what θ calls it."""

    kind: type[Effect]
    robot: Robot
    name: str

    @property
    def neutral(self) -> dict[str, float]:
        """The neutral values, by parameter."""
        return {parameter.name: parameter.neutral_value(self.robot.figures) for parameter in self.kind.parameters}

    def at(self, values: Mapping[str, float]) -> Effect:
        """The effect with these values, all others neutral."""
        return self.kind(*{**self.neutral, **values}.values())

    def moved(self, parameter: Parameter, value: float) -> Effect:
        """The effect with one value moved; what only shapes an effect is moved in one that is there."""
        first = self.kind.parameters[0]
        usual = first.probes[len(first.probes) // 2] if first.probes else 0.5 * (first.low + first.high)
        return self.at({**({first.name: usual} if parameter.shape else {}), parameter.name: value})

    def signal(self, seed: int, length: int = 90, held: int = HELD) -> Signal:
        """Held commands or motion and stands, camera figures, or changing pictures, shape (length, channels)."""
        random, stage = np.random.default_rng(seed), self.kind.stage
        if stage is Stage.CAMERA:
            return np.repeat(self.robot.camera_figures().channels()[None], length, axis=0)
        if stage is Stage.IMAGE:
            channels = 3 * int(PICTURE["camera_columns"] * PICTURE["camera_rows"])
            return random.uniform(0.0, 255.0, (length, channels)).astype(np.float32)
        values = random.uniform(-1.0, 1.0, (length // held, len(CHANNELS[stage])))
        stands = random.uniform(size=values.shape) < STANDS
        return np.repeat(np.where(stands, 0.0, values), held, axis=0)

    def context(self, rest: Signal, seed: int = 7) -> FilterContext:
        """The context of its filter; an effect of a place is shown one everywhere."""
        context = FilterContext(RATE_HZ, rest, {**self.robot.figures, **PICTURE}, seed=seed)
        placed = self.kind.trace is not None and self.kind.trace.placed
        return replace(context, places=PLACES, headings=np.zeros(len(PLACES))) if placed else context

    def rest(self, signal: Signal) -> Signal:
        """The signal before a signal: pictures stand still, commands and motion rest."""
        seen = self.kind.stage in (Stage.IMAGE, Stage.CAMERA)
        return np.asarray(signal[0] if seen else np.zeros((*signal.shape[:-2], signal.shape[-1])))

    def filtered(self, effect: Effect, signal: Signal, cuts: Iterable[int] = (), seed: int = 7) -> Signal:
        """The signal (…, time, channels) filtered, in one go or in chunks."""
        memory: Any = effect.begin(self.context(self.rest(signal), seed))
        chunks = []
        for chunk in np.split(signal, sorted(cuts), axis=-2):
            if chunk.shape[-2]:
                filtered, memory = effect.apply(chunk, memory)
                chunks.append(filtered)
        return np.concatenate(chunks, axis=-2)


Answer = TypeVar("Answer")


def claim(holds: Any, line: str) -> None:
    """Refuse what does not hold, with this line."""
    if not holds:
        raise ConformanceError(line)


def claim_members(thing: Any, what: str, members: Iterable[str]) -> None:
    """Refuse what lacks a member, with the names of those it lacks."""
    lacks = [member for member in members if not hasattr(thing, member)]
    claim(not lacks, f"{what} lacks {', '.join(lacks)}; add what every one of its kind must have")


def ask(what: str, question: Callable[[], Answer]) -> Answer:
    """Ask an extension; refused if it raises instead."""
    try:
        return question()
    except ConformanceError:
        raise
    except ProxytuneError as problem:
        raise ConformanceError(str(problem)) from problem
    except Exception as problem:
        raise ConformanceError(f"{what} raised {describe(problem)}; it must not") from problem


CUTTINGS, STEPS = 8, 9
DRIFT = 1e-11
AMID = 40


def check_effect(effect: type[Effect], *, robot: Robot | None = None, least: float = 1e-3) -> None:
    """Refuse an effect that breaks a promise.

    The same seed gives the same result; cutting a signal into chunks changes nothing; what is filtered does not depend
    on what comes later; memories and signals are never changed in place; a batch is filtered like its members; neutral
    values change nothing; each parameter changes something all along its usual range; the result is finite everywhere.

    Args:
        effect: Its class.
        robot: Whose nominal figures it is told; the Duckiebot if not given.
        least: The smallest change of a signal that counts as one.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    name = str(getattr(effect, "name", getattr(effect, "__name__", effect)))
    claim_members(effect, f"effect '{name}'", MEMBERS)
    for problem in problems(effect):
        claim(False, f"effect '{name}' {problem}")
    subject = Subject(effect, robot or read_robot(ROBOT), name)
    ask(f"effect '{name}'", lambda: _check(subject, least))


def _check(subject: Subject, least: float) -> None:
    _claim_vanishes(subject)
    for parameter in subject.kind.parameters:
        _claim_moves(subject, parameter, least)
        for value in dict.fromkeys((*parameter.probes, parameter.low, parameter.high)):
            effect = subject.moved(parameter, value)
            what = f"effect '{subject.name}' at {parameter.name} {value:g}"
            _claim_filter(subject, effect, what)
            _claim_chunks(subject, effect, what)
            if hasattr(effect, "recall"):
                _claim_recall(subject, effect, what)
    if subject.kind.trace is not None:
        _claim_seed(subject, bool(subject.kind.trace.draws))
        _claim_no_drift(subject)


def _claim_vanishes(subject: Subject) -> None:
    """At its neutral values it changes nothing, or is what the robot has in any case."""
    signal, still = subject.signal(1), subject.at({})
    filtered = subject.filtered(still, signal)
    told = ", ".join(f"{name} {value:g}" for name, value in subject.neutral.items())
    own = _of_the_robot(subject)
    if own is not None:
        same = np.array_equal(filtered, subject.filtered(own, signal))
        claim(same, f"effect '{subject.name}' at its neutral {told} is not the robot's own; it must be")
    else:
        same = np.array_equal(filtered, signal)
        claim(same, f"effect '{subject.name}' changes the signal at its neutral {told}; it must vanish there")


def _of_the_robot(subject: Subject) -> Effect | None:
    """The robot's own effect of this kind, where the neutral value is a nominal figure that it follows in any case."""
    single = len(subject.kind.parameters) == 1
    theta = subject.robot.theta
    names = {p.name: subject.name if single else f"{subject.name}.{p.name}" for p in subject.kind.parameters}
    own = {parameter: theta[name] for parameter, name in names.items() if name in theta}
    nominal = any(isinstance(parameter.neutral, str) for parameter in subject.kind.parameters)
    return subject.at(own) if own and nominal and subject.kind.stage is not Stage.CAMERA else None


def _claim_moves(subject: Subject, parameter: Parameter, least: float) -> None:
    """Each step over its usual range changes the signal, and so does each probe."""
    signal = np.concatenate([subject.signal(6, length, held) for held, length in LENGTHS.items()])
    shaping = parameter is not subject.kind.parameters[0] and not parameter.shape
    remedy = "; declare one that only shapes another with Parameter(shape=True)" if shaping else ""
    steps = np.linspace(*parameter.usual_range, STEPS)
    filtered = [subject.filtered(subject.moved(parameter, float(value)), signal) for value in steps]
    for (low, earlier), (high, later) in pairwise(zip(steps, filtered, strict=True)):
        line = f"is the same at {parameter.name} {low:g} and {high:g}; a parameter must matter all along its range"
        claim(_apart(earlier, later) > least, f"effect '{subject.name}' {line}{remedy}")
    signal, neutral = np.concatenate((subject.signal(2, 900), signal)), subject.neutral[parameter.name]
    still = subject.filtered(subject.moved(parameter, neutral), signal)
    for probe in parameter.probes:
        moved = _apart(subject.filtered(subject.moved(parameter, probe), signal), still)
        holds = moved == 0.0 if probe == neutral else moved > least
        line = f"does nothing at its probe {parameter.name} {probe:g}; a search must be able to see it there"
        claim(holds, f"effect '{subject.name}' {line}")


def _claim_filter(subject: Subject, effect: Effect, what: str) -> None:
    """It keeps shapes, is finite, repeats itself and looks at the past alone."""
    signal = subject.signal(3)
    filtered = subject.filtered(effect, signal)
    claim(filtered.shape == signal.shape, f"{what} makes a signal {filtered.shape} of {signal.shape}; keep the shape")
    claim(np.isfinite(filtered).all(), f"{what} is not finite; it must be, up to both ends of its range")
    again = subject.filtered(effect, signal)
    claim(np.array_equal(filtered, again), f"{what} gives two results for one seed; draw from context.seed alone")
    other = np.concatenate((signal[:45], signal[45:] * 0.5 + 0.1))
    causal = np.array_equal(filtered[:45], subject.filtered(effect, other.astype(signal.dtype))[:45])
    claim(causal, f"{what} depends on samples that come later; a filter knows the past alone")


def _claim_chunks(subject: Subject, effect: Effect, what: str) -> None:
    """Neither cutting nor batching changes the result, and nothing is changed in place."""
    random = np.random.default_rng(0)
    tolerance = 2e-4 if subject.kind.stage is Stage.IMAGE else 1e-12  # Pictures are of single precision.
    for seed in range(CUTTINGS):
        signal, cuts = subject.signal(seed), random.integers(1, 90, seed % 7)
        apart = _apart(subject.filtered(effect, signal, cuts), subject.filtered(effect, signal))
        where = ", ".join(map(str, sorted(cuts)))
        claim(apart <= tolerance, f"{what} changes by {apart:.2g} if the signal is cut at {where}; keep memory")
    _claim_nothing_in_place(subject, effect, what)
    if subject.kind.stage not in (Stage.CAMERA, Stage.IMAGE):
        batch = np.stack([subject.signal(seed) for seed in range(6)]).reshape(2, 3, 90, -1)
        alone = np.array([[subject.filtered(effect, one) for one in row] for row in batch])
        together = subject.filtered(effect, batch, (50,))
        line = f"{what} filters a batch unlike its members; use leading axes (…, time, 2)"
        claim(_apart(together, alone) <= 1e-12, line)


def _claim_nothing_in_place(subject: Subject, effect: Effect, what: str) -> None:
    signal = subject.signal(4)
    kept, memory = signal.copy(), effect.begin(subject.context(subject.rest(signal)))
    first, middle = effect.apply(signal, memory)
    first = first.copy()
    second = effect.apply(signal, middle)[0].copy()
    same = np.array_equal(effect.apply(signal, memory)[0], first)
    same &= np.array_equal(effect.apply(signal, middle)[0], second)
    claim(same, f"{what} changes a memory in place; make a new one")
    claim(np.array_equal(signal, kept), f"{what} changes the signal in place; make a new one")


def _claim_recall(subject: Subject, effect: Any, what: str) -> None:
    """What begins amid a longer signal goes on as that does."""
    drives = np.stack([subject.signal(seed) for seed in range(3)])
    row, sample = np.array([2, 0]), np.array([AMID, AMID])
    driven, ahead = (subject.context(subject.rest(drives[: len(one)])) for one in (drives, row))
    whole, _ = effect.apply(drives, effect.begin(driven))
    amid, _ = effect.apply(drives[row][:, AMID:], effect.recall(ahead, driven, drives, row, sample))
    apart = _apart(amid, whole[row][:, AMID:])
    claim(apart <= DRIFT, f"{what} goes on amid a signal {apart:.2g} unlike it; recall what came before")


def _claim_seed(subject: Subject, draws: bool) -> None:
    """An effect that a diagnosis may fit depends on the seed only if its trace says that it draws."""
    effect, signal = _strongest(subject), subject.signal(4)
    differ = _apart(subject.filtered(effect, signal, seed=7), subject.filtered(effect, signal, seed=8)) > 0.0
    line = "depends on the seed" if differ else "does not depend on the seed"
    claim(differ == draws, f"effect '{subject.name}' {line}, and its trace says otherwise; correct one of them")


def _claim_no_drift(subject: Subject) -> None:
    """A long signal told a control step at a time is filtered as a whole one."""
    effect, signal = _strongest(subject), subject.signal(5, 1800)
    apart = _apart(subject.filtered(effect, signal, range(3, 1800, 3)), subject.filtered(effect, signal))
    line = f"changes by {apart:.2g} if it is told a control step at a time; a memory must not drift"
    claim(apart <= DRIFT, f"effect '{subject.name}' {line}")


def _strongest(subject: Subject) -> Effect:
    first = subject.kind.parameters[0]
    return subject.moved(first, first.probes[-1])


def _apart(one: Signal, other: Signal) -> float:
    return float(np.abs(np.asarray(one) - np.asarray(other)).max())
