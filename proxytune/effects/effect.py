"""An effect is a causal filter; here is what it promises, and what filters of any stage share.

`begin` gives the memory before the first sample, `apply` filters the next chunk and gives the memory for the one after,
so that cutting a signal into chunks changes nothing. `Trace` is what a diagnosis has to know to find an effect in
measured motion. Filters share a first-order low-pass, exact for signals that hold over each sample, and dead reckoning
of headings and angles beyond those that are known.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from types import ModuleType
from typing import Any, ClassVar, NamedTuple, Protocol, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import compiled_loops
from proxytune.space import Parameter


class Cue(StrEnum):
    """A signal that motion may depend on, as people call it."""

    WHEEL_COMMAND = "wheel command"
    STEERING = "steering"
    COMMAND_DIFFERENCE = "difference of the wheel commands"
    TRANSIENTS = "command transients"
    REVERSAL = "distance since reversal"
    TIME = "time in the episode"
    USE = "cumulated use"
    TURN_RATE = "turn rate"
    HEADING = "heading"
    POSITION = "position"
    LEFT_ANGLE = "left wheel angle"
    RIGHT_ANGLE = "right wheel angle"
    DIRECTION = "direction of travel"


MOTIONS = ("forward", "sideways", "turn", "left", "right")
"""What a panel can show of the motion: of the body, or the speed of a wheel."""
SIGNALS = ("", "x", "y", "heading", "left angle", "right angle", "bend", *MOTIONS)
"""What a panel can have along its axis: the signal of the cue, or one of these."""


class Panel(NamedTuple):
    """Axes of one panel of a figure."""

    signal: str  # along the axis, one of SIGNALS; empty for that of the cue
    label: str
    motion: str  # which motion is added, one of MOTIONS
    share: bool = False  # whether as a share of that motion instead of in its unit


TURN = "turn rate [deg/s]"
"""What an axis of turn rates is called."""


class Means(NamedTuple):
    """Motion that is added, as means over signals; the cue says which flexible curve is drawn beside it."""

    cue: Cue
    panels: tuple[Panel, ...]


class WheelCurve(StrEnum):
    """A curve of wheel speed that shows an effect."""

    STEADY = "steady speed over the command"
    STEP = "speed after a step of the command"
    REVERSAL = "speed after a step of the command and its reversal"


class Lateness(NamedTuple):
    """Lateness of commands under a random effect: its mean [s], and a mixture of times about it."""

    mean_s: float  # how late a command is on average [s]
    commands: NDArray[Any]  # times that a command may be later than that (K,), in commands
    log_weights: NDArray[Any]  # logarithms of how often each happens (K,)


@dataclass(frozen=True)
class Draws:
    """Random draws of an effect of one parameter, one for each command."""

    # from the parameter's value and the commands per second to how late commands are
    lateness: Callable[[float, float], Lateness]
    sizes: tuple[float, float]  # least and greatest value that is looked for


@dataclass(frozen=True)
class Form:
    """A form that an effect may take."""

    # the parameters that are fitted, by coordinate: those of one coordinate share a value
    free: tuple[tuple[str, ...], ...]
    name: str = ""  # what is special about it: `left wheel`; empty where nothing is
    # values of other parameters; those that are not named stay where the model has them
    fixed: Mapping[str, float] = field(default_factory=dict)
    # parameters that a search sets out with, the others where the model has them; all where none is named
    moved: tuple[str, ...] = ()
    present: bool | None = None  # whether the model has to have the effect already, must not have it, or either
    shown: WheelCurve | Means | None = None  # what shows it, where that is not what shows the effect's other forms


@dataclass(frozen=True)
class Trace:
    """Knowledge of an effect on motion that a diagnosis goes by."""

    cues: tuple[Cue, ...]  # the signals through which it acts
    shown: WheelCurve | Means  # what shows it in a figure
    # the forms that it can take; where there are none, a single one with every parameter free
    forms: tuple[Form, ...] = ()
    # whether its parameters change the motion by steps, so that no slope leads to their best values
    stepwise: bool = False
    draws: Draws | None = None  # what it draws, if it strikes at random
    # whether it acts in a part of the map: its parameters after the first are x, y [m] and a radius [m]
    placed: bool = False
    contains: tuple[str, ...] = ()  # other effects that are special cases of it

    def shown_in(self, form: str) -> WheelCurve | Means:
        """Curve or means that show the form of this name."""
        own = next((one.shown for one in self.forms if one.name == form), None)
        return own or self.shown


Signal = NDArray[Any]
"""An array of shape (…, time, channels); a value holds, or is the mean, over one sample interval."""
Memory = Any
"""What a filter remembers from one chunk to the next; never changed in place."""


class Stage(StrEnum):
    """Places in a domain instance where effects bend the signal, in the order in which it passes them."""

    COMMAND = "command"
    ACTUATION = "actuation"
    MOTION = "motion"
    MEASUREMENT = "measurement"
    CAMERA = "camera"
    IMAGE = "image"


CHANNELS: Mapping[Stage, tuple[str, ...]] = {
    Stage.COMMAND: ("left", "right"),  # of a car: throttle and steering
    Stage.ACTUATION: ("left", "right"),
    Stage.MOTION: ("forward_m_s", "sideways_m_s", "yaw_rad_s"),
    Stage.MEASUREMENT: ("x_m", "y_m", "heading_rad"),
    Stage.CAMERA: (
        "pitch_deg",
        "roll_deg",
        "yaw_deg",
        "height_m",
        "field_of_view_deg",
        "k1",
        "forward_m",
        "centre_right",
        "centre_down",
        "aspect",
    ),
    Stage.IMAGE: ("red, green and blue of every pixel, row by row, 0 to 255",),
}


@dataclass(frozen=True)
class FilterContext:
    """Context that a filter is told before the first sample."""

    rate_hz: float  # samples per second
    rest: Signal  # the signal before time zero, shape (…, channels)
    nominal: Mapping[str, float]  # the robot's nominal figures by name
    seed: int = 0  # seed of everything random in the filter
    # headings known beforehand, sample by sample (…, n) [rad]: the starting heading alone (n = 1), or the
    # measured ones
    headings: Signal = field(default_factory=lambda: np.zeros(1))
    # places known beforehand in the same way (…, n, 2) [m]
    places: Signal = field(default_factory=lambda: np.zeros((1, 2)))
    # angles that the wheels have turned by, known beforehand in the same way (…, n, 2) [rad]
    angles: Signal = field(default_factory=lambda: np.zeros((1, 2)))


class Effect(Protocol):
    """A frozen bundle of parameter values with a pure filter.

    Cutting a signal into chunks never changes the result. An effect that measured motion cannot show has no trace.
    """

    name: ClassVar[str]
    stage: ClassVar[Stage]
    parameters: ClassVar[tuple[Parameter, ...]]
    trace: ClassVar[Trace | None]

    def begin(self, context: FilterContext) -> Memory:
        """The memory before the first sample."""

    def apply(self, signal: Signal, memory: Memory) -> tuple[Signal, Memory]:
        """Filter the next chunk, shape (…, time, channels), and give the memory for the one after."""


class ShippedEffect(Effect):
    """A shipped effect, which `effect` completes: without a trace, and without memory, unless it says so."""

    name: ClassVar[str]
    stage: ClassVar[Stage]
    parameters: ClassVar[tuple[Parameter, ...]]
    trace: ClassVar[Trace | None] = None

    def begin(self, context: FilterContext) -> Memory:
        """Remember nothing: what is done to each sample is the same."""
        return None


Kind = TypeVar("Kind", bound=ShippedEffect)


def like(known: Parameter) -> Any:
    """A field of an effect that is such a parameter, called as the field is."""
    return field(metadata={"parameter": known})


def parameter(
    unit: str,
    low: float,
    high: float,
    neutral: float | str = 0.0,
    *,
    probes: tuple[float, ...],
    source: str,
    shape: bool = False,
    usual: tuple[float, float] | None = None,
) -> Any:
    """A field of an effect that is a parameter with these properties."""
    known = Parameter(
        name="", unit=unit, low=low, high=high, neutral=neutral, probes=probes, source=source, shape=shape, usual=usual
    )
    return like(known)


@dataclass_transform(frozen_default=True, field_specifiers=(like, parameter))
def effect(name: str, stage: Stage) -> Callable[[type[Kind]], type[Kind]]:
    """Make a class a frozen dataclass and an effect of this name and stage, whose parameters are its fields."""

    def make(kind: type[Kind]) -> type[Kind]:
        made = dataclass(frozen=True)(kind)
        made.name, made.stage = name, stage
        own: tuple[Any, ...] = fields(made)  # type: ignore[arg-type]
        made.parameters = tuple(replace(one.metadata["parameter"], name=one.name) for one in own)
        return made

    return make


def skip_nothing(effect: object, memory: Any, samples: int) -> Any:
    """The `skip` of an effect that does the same to each sample: its memory after so many more."""
    return memory


FEW = 8
"""Up to so many samples, a control step, a loop over them is faster than to set up a filter."""


PAYS_OFF = 20_000_000
"""So many samples NumPy and SciPy filter before Numba, which takes up to 0.3 s to load and would have saved that."""
_filtered = [0]


def fastest(samples: int) -> ModuleType | None:
    """The compiled filters once some more samples pay for loading them, where they work: to the same bit."""
    _filtered[0] += samples
    return _by_numba() if _filtered[0] > PAYS_OFF else None


@functools.cache
def _by_numba() -> ModuleType | None:
    return compiled_loops("proxytune.effects.compiled")


class LowPassState(NamedTuple):
    """A first-order low-pass under way."""

    value: Signal  # what follows the signal, at the end of the last sample (…, channels)
    remainder: float  # how much of a step is left after one sample
    mean_remainder: float  # how much of it is left on average over that sample


def low_pass_at(value: Signal, samples: float) -> LowPassState:
    """A low-pass with a time constant of so many samples, at a value (…, channels)."""
    remainder = float(np.exp(-1.0 / samples)) if samples else 0.0
    return LowPassState(value, remainder, samples * (1.0 - remainder))


def lfilter(*words: Any, **named: Any) -> Any:
    """As scipy.signal's, of which importing takes longer than driving an episode."""
    from scipy import signal

    return signal.lfilter(*words, **named)


def low_pass(signal: Signal, state: LowPassState) -> tuple[Signal, LowPassState]:
    """The mean over each sample of what follows a signal (…, time, channels), and the state after the last one.

    It follows with a first-order lag, exactly for a signal that holds over each sample.
    """
    value, remainder, mean_remainder = state
    start, gain = value[..., None, :], 1.0 - remainder
    if signal.ndim == 2 and len(signal) <= FEW:
        # As `lfilter` does it, operation by operation
        kept, rows = [remainder * before for before in value.tolist()], []
        for sample in signal.tolist():
            rows.append([was + gain * new for was, new in zip(kept, sample, strict=True)])
            kept = [0.0 * new + remainder * end for new, end in zip(sample, rows[-1], strict=True)]
        ends = np.array(rows)
    elif signal.shape[-2] <= FEW:
        rest, ends = remainder * value, np.empty(signal.shape)
        for number in range(signal.shape[-2]):
            ends[..., number, :] = rest + gain * signal[..., number, :]
            rest = 0.0 * signal[..., number, :] + remainder * ends[..., number, :]
    elif signal.dtype == float and (compiled := fastest(signal.size)):
        mean, last = compiled.low_pass(signal, value, remainder, mean_remainder)
        return mean, LowPassState(last, remainder, mean_remainder)
    else:
        ends = lfilter([gain], [1.0, -remainder], signal, axis=-2, zi=remainder * start)[0]
    starts = np.concatenate((start, ends[..., :-1, :]), axis=-2)
    mean = signal + mean_remainder * (starts - signal)
    return mean, LowPassState(ends[..., -1, :], remainder, mean_remainder)


def starts_of(signal: Signal, mean: Signal, state: LowPassState) -> Signal:
    """Where each sample of what follows a signal starts, by the mean over it that `low_pass` gave."""
    return signal + (mean - signal) / state.mean_remainder if state.mean_remainder else signal


def approach(goal: Signal, kept: Signal, value: Signal) -> tuple[Signal, Signal]:
    """Go towards a goal (…, time), of which each sample keeps a share of the way: where each starts, and the end."""
    value = np.broadcast_to(value, goal.shape[:-1])
    if compiled := fastest(goal.size):
        return compiled.approach(goal, kept, value)  # type: ignore[no-any-return]
    shares, ends = (np.moveaxis(part, -1, 0).copy() for part in (kept, (1.0 - kept) * goal))
    values = np.concatenate((value[None], ends))
    for number, share in enumerate(shares):
        values[number + 1] += share * values[number]
    return np.moveaxis(values[:-1], 0, -1), values[-1]


class DeadReckoning(NamedTuple):
    """Values known beforehand (…, n), number of the next sample, its value (…, 1), and samples per second."""

    values: Signal
    next: int
    newest: Signal
    rate_hz: float


def start_reckoning(values: Signal, context: FilterContext) -> DeadReckoning:
    """Values known beforehand (…, n) for every member of the batch that the setting's rest (…, channels) is of."""
    known = np.asarray(values, dtype=float)
    shape = np.broadcast_shapes(known.shape[:-1], np.shape(context.rest)[:-1])
    known = np.broadcast_to(known, (*shape, known.shape[-1]))
    return DeadReckoning(known, 0, known[..., :1], context.rate_hz)


def reckon(rates: Signal, memory: DeadReckoning) -> tuple[Signal, DeadReckoning]:
    """Values at the start of each sample (…, time): known ones, and beyond them those that the rates lead to."""
    length = rates.shape[-1]
    known = memory.values[..., memory.next : memory.next + length]
    given = known.shape[-1]
    newest = known[..., -1:] if given else memory.newest
    gained = np.cumsum(rates[..., max(0, given - 1) :], axis=-1) / memory.rate_hz
    path = np.concatenate((known[..., :-1], newest, newest + gained), axis=-1)
    return path[..., :length], memory._replace(next=memory.next + length, newest=path[..., length:])
