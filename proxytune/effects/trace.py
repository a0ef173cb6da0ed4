"""The trace that an effect leaves in measured motion: what a diagnosis goes by to find it, fit it and draw it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

from numpy.typing import NDArray


class Cue(StrEnum):
    """A signal that motion may depend on, as people call it."""

    WHEEL_COMMAND = "wheel command"
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
    """What is drawn against what.

    Attributes:
        signal: Along the axis, one of SIGNALS; empty for that of the cue.
        label: Its label.
        motion: Which motion is added, one of MOTIONS.
        share: Whether as a share of that motion instead of in its unit.
    """

    signal: str
    label: str
    motion: str
    share: bool = False


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
    """How late a random effect makes commands: its mean [s], and a mixture of times about it.

    Attributes:
        mean_s: How late a command is on average [s].
        commands: Times that a command may be later than that (K,), in commands.
        log_weights: Logarithms of how often each happens (K,).
    """

    mean_s: float
    commands: NDArray[Any]
    log_weights: NDArray[Any]


@dataclass(frozen=True)
class Draws:
    """What an effect of one parameter draws for each command.

    Attributes:
        lateness: From the parameter's value and the commands per second to how late commands are.
        sizes: Least and greatest value that is looked for.
    """

    lateness: Callable[[float, float], Lateness]
    sizes: tuple[float, float]


@dataclass(frozen=True)
class Form:
    """A form that an effect may take.

    Attributes:
        free: The parameters that are fitted, by coordinate: those of one coordinate share a value.
        name: What is special about it: `left wheel`; empty where nothing is.
        fixed: Values of other parameters; those that are not named stay where the model has them.
        moved: Parameters that a search sets out with, the others where the model has them; all where none is named.
        present: Whether the model has to have the effect already, must not have it, or either.
        shown: What shows it, where that is not what shows the effect's other forms.
    """

    free: tuple[tuple[str, ...], ...]
    name: str = ""
    fixed: Mapping[str, float] = field(default_factory=dict)
    moved: tuple[str, ...] = ()
    present: bool | None = None
    shown: WheelCurve | Means | None = None


@dataclass(frozen=True)
class Trace:
    """What a diagnosis has to know of an effect on motion.

    Attributes:
        cues: The signals through which it acts.
        shown: What shows it in a figure.
        forms: The forms that it can take; where there are none, a single one with every parameter free.
        stepwise: Whether its parameters change the motion by steps, so that no slope leads to their best values.
        draws: What it draws, if it strikes at random.
        placed: Whether it acts in a part of the map: its parameters after the first are x, y [m] and a radius [m].
    """

    cues: tuple[Cue, ...]
    shown: WheelCurve | Means
    forms: tuple[Form, ...] = ()
    stepwise: bool = False
    draws: Draws | None = None
    placed: bool = False

    def shown_in(self, form: str) -> WheelCurve | Means:
        """What shows the form of this name."""
        own = next((one.shown for one in self.forms if one.name == form), None)
        return own or self.shown
