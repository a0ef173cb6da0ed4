"""What an effect is: a causal filter between a command and the pictures that come of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from proxytune.effects.trace import Trace
from proxytune.space import Parameter

Signal = NDArray[Any]
"""An array of shape (…, time, channels); a value holds, or is the mean, over one sample interval."""

Memory = Any
"""What a filter remembers from one chunk to the next; never changed in place."""


class Stage(StrEnum):
    """Where in a domain instance an effect bends the signal, in the order the signal passes."""

    COMMAND = "command"
    ACTUATION = "actuation"
    MOTION = "motion"
    MEASUREMENT = "measurement"
    CAMERA = "camera"
    IMAGE = "image"


CHANNELS: Mapping[Stage, tuple[str, ...]] = {
    Stage.COMMAND: ("left", "right"),
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
class Setting:
    """What a filter is told before the first sample.

    Attributes:
        rate_hz: Samples per second.
        rest: The signal before time zero, shape (…, channels).
        nominal: The robot's nominal figures by name.
        seed: Seed of everything random in the filter.
        headings: Headings known beforehand, sample by sample (…, n) [rad]: the starting heading alone (n = 1), or the
            measured ones.
        places: Places known beforehand in the same way (…, n, 2) [m].
        angles: Angles that the wheels have turned by, known beforehand in the same way (…, n, 2) [rad].
    """

    rate_hz: float
    rest: Signal
    nominal: Mapping[str, float]
    seed: int = 0
    headings: Signal = field(default_factory=lambda: np.zeros(1))
    places: Signal = field(default_factory=lambda: np.zeros((1, 2)))
    angles: Signal = field(default_factory=lambda: np.zeros((1, 2)))


class Effect(Protocol):
    """A frozen bundle of parameter values with a pure filter.

    Cutting a signal into chunks never changes the result. An effect that measured motion cannot show has no trace.
    """

    name: ClassVar[str]
    stage: ClassVar[Stage]
    parameters: ClassVar[tuple[Parameter, ...]]
    trace: ClassVar[Trace | None]

    def begin(self, setting: Setting) -> Memory:
        """The memory before the first sample."""
        ...

    def apply(self, signal: Signal, memory: Memory) -> tuple[Signal, Memory]:
        """Filter the next chunk, shape (…, time, channels), and give the memory for the one after."""
        ...


@runtime_checkable
class Recalling(Protocol):
    """An effect for which it matters what came before a window that begins amid a drive."""

    def recall(self, setting: Setting, signal: Signal, row: Signal, sample: Signal) -> Memory:
        """The memory as of a sample (W,) of a row (W,) of longer signals (rows, time, channels)."""
        ...
