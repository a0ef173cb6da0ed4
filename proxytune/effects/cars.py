"""Effects on a car's columns, speed and angle of the front wheels as fractions of full ones, and of its tyres.

First what only a car has: of its linkage, of what steering costs, of its mass, and, on the motion that these ask of the
body, of its tyres. Then effects of two wheels on one of the columns: it goes through the wheels' own filter as two
wheels that are alike, so there is one implementation of each effect. What steers has the prefix `steering_`; what
drives is called as on wheels.
"""

import math
from collections.abc import Mapping
from dataclasses import make_dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np

from proxytune.effects.command import CommandQuantisation, Delay, ReversalPause
from proxytune.effects.effect import (
    TURN,
    Cue,
    Effect,
    FilterContext,
    Form,
    Means,
    Memory,
    Panel,
    ShippedEffect,
    Signal,
    Stage,
    Trace,
    WheelCurve,
    effect,
    like,
    parameter,
)
from proxytune.effects.features import newest_signs
from proxytune.effects.friction import Backlash, DeadBand, Stiction, taken_along
from proxytune.effects.motors import (
    BatterySag,
    DriverMap,
    Gain,
    MotorLag,
    Saturation,
    SlewRate,
    ThermalFade,
)
from proxytune.space import Parameter

THROTTLE, STEERING = 0, 1
"""The columns of a car's commands and of what comes of them: speed, and angle of the front wheels."""


def _steered(signal: Signal, angle: Signal) -> Signal:
    return np.stack((signal[..., THROTTLE], angle), axis=-1)


@effect("steering_backlash", Stage.ACTUATION)
class SteeringBacklash(ShippedEffect):
    """The linkage of the steering has play: the wheels stay while the servo is within half the gap of them."""

    gap: float = parameter("full lock", 0.0, 0.4, probes=(0.02, 0.05, 0.1, 0.2),
        source="ball joints and plastic knuckles: some degrees of the wheels, worn ones more")  # fmt: skip
    trace = Trace((Cue.STEERING, Cue.TRANSIENTS), WheelCurve.REVERSAL)

    def begin(self, context: FilterContext) -> Signal:
        """With the wheels where the servo rests."""
        return np.asarray(context.rest, dtype=float)[..., None, STEERING:]

    def apply(self, signal: Signal, memory: Signal) -> tuple[Signal, Signal]:
        """The wheels' angle is taken along by the servo's ± half the gap."""
        wheels = memory + taken_along(signal[..., STEERING:] - memory, np.asarray(self.gap / 2.0))
        return _steered(signal, wheels[..., 0]), wheels[..., -1:, :]


@effect("steering_offset", Stage.ACTUATION)
class SteeringOffset(ShippedEffect):
    """The wheels are not straight at a steering of 0: the trim of a car."""

    offset: float = parameter("full lock", -0.4, 0.4, probes=(-0.2, -0.08, -0.03, 0.03, 0.08, 0.2),
        source="servo horns have some 25 teeth: up to 7° of the horn off; DART: 0.027 of full lock")  # fmt: skip
    trace = Trace((Cue.STEERING,), WheelCurve.STEADY)

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Add it."""
        return _steered(signal, signal[..., STEERING] + self.offset), None


LOCK = Parameter(name="lock", unit="deg", low=3.0, high=60.0, neutral="wheel_angle",
                 probes=(10.0, 15.0, 20.0, 25.0, 30.0, 40.0),
                 source="knuckles of cars stop at 20° to 45°, left and right some degrees apart")  # fmt: skip
BEND = Parameter(name="bend", unit="", low=0.0, high=3.0, neutral=0.0, probes=(0.5, 1.0, 1.5, 2.0),
                 source="DART: 1.4 to the left, 1.0 to the right")  # fmt: skip


@effect("steering_curve", Stage.ACTUATION)
class SteeringCurve(ShippedEffect):
    """The wheels' angle is a curve of the steering, to either side its own: side · tanh(bend · s) / tanh(bend).

    `left` and `right` are the angles at full lock; at a bend of 0 a side is a straight line.
    """

    left: float = like(LOCK)
    right: float = like(LOCK)
    left_bend: float = like(BEND)
    right_bend: float = like(BEND)
    trace = Trace(
        (Cue.STEERING,),
        WheelCurve.STEADY,
        forms=(
            Form((("left",), ("right",)), "sides", moved=("left", "right")),
            Form((("left",), ("right",), ("left_bend", "right_bend")), "sides bent alike"),
            Form((("left",), ("right",), ("left_bend",), ("right_bend",)), "sides bent apart"),
        ),
    )

    def begin(self, context: FilterContext) -> float:
        """The angle that stands for 1 [deg]."""
        return context.nominal["wheel_angle"]

    def apply(self, signal: Signal, memory: float) -> tuple[Signal, float]:
        """Bend each sample by the curve of its side."""
        steering = signal[..., STEERING]
        left, right = (
            share / memory * (np.tanh(bend * steering) / math.tanh(bend) if bend > 0.0 else steering)
            for share, bend in ((self.left, self.left_bend), (self.right, self.right_bend))
        )
        return _steered(signal, np.where(steering > 0.0, left, right)), memory


@effect("steering_friction", Stage.ACTUATION)
class SteeringFriction(ShippedEffect):
    """Turned wheels brake the car: the motor's speed shrinks by the factor 1 − loss · |wheel angle at full lock|."""

    loss: float = parameter("", 0.0, 0.9, probes=(0.05, 0.1, 0.2, 0.4),
        source="front tyres that scrub: some tenths of the speed at full lock")  # fmt: skip
    trace = Trace((Cue.STEERING,), Means(Cue.TURN_RATE, (Panel("turn", TURN, "forward", share=True),)))

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow the car down by how far its wheels are turned, at most to a stop."""
        kept = np.maximum(0.0, 1.0 - self.loss * np.abs(signal[..., STEERING]))
        return np.stack((signal[..., THROTTLE] * kept, signal[..., STEERING]), axis=-1), None


FAR = 1e9
"""Beyond any speed."""


class RollingState(NamedTuple):
    """A car that rolls."""

    speed: Signal  # at the end of the last sample (…,), as a fraction of full speed
    ahead: Signal  # whether its motor last drove it forwards (…,): 1, or −1
    sample_s: float  # how long a sample lasts [s]
    friction: float  # what friction takes from it in a second


@effect("rolling", Stage.ACTUATION)
class Rolling(ShippedEffect):
    """The car has mass and rolls on without throttle: its speed v follows the motor's u.

    dv/dt = (u − (1 − freewheel + freewheel · |u|) · v) / inertia − friction − drag · v, u and v as fractions of full
    speed. At a `freewheel` of 0 the motor holds the speed asked for and brakes as it drives; at 1 it pulls the less the
    faster it turns, as a motor does on a voltage that is switched, and without throttle it does not brake at all.
    """

    inertia: float = parameter("s", 0.0, 30.0, probes=(0.1, 0.2, 0.4, 0.8, 1.6), usual=(0.0, 3.0),
        source="full speed by the acceleration from rest: 0.2 to 1 s for model cars, seconds for large "
               "ones")  # fmt: skip
    freewheel: float = parameter("", 0.0, 1.0, probes=(0.25, 0.5, 0.75, 1.0),
        source="0 for a speed controller that holds a speed, 1 for one that switches a voltage",
        shape=True)  # fmt: skip
    friction: float = parameter("m/s²", 0.0, 4.0, probes=(0.1, 0.3, 0.7, 1.5),
        source="rolling friction of model cars: 0.2 to 1 m/s²; DART: 0.74 m/s²", shape=True)  # fmt: skip
    drag: float = parameter("1/s", 0.0, 2.0, probes=(0.05, 0.1, 0.2, 0.5, 1.0),
        source="gears, bearings and air: some tenths of the speed in a second", shape=True)  # fmt: skip
    trace = Trace(
        (Cue.TRANSIENTS, Cue.WHEEL_COMMAND),
        WheelCurve.STEP,
        forms=(
            Form((("inertia",),), moved=("inertia",)),
            Form((("inertia",), ("friction",)), "rolls on", fixed={"freewheel": 1.0}, moved=("inertia", "friction")),
            Form((("inertia",), ("freewheel",), ("friction",), ("drag",)), "all"),
        ),
    )

    def begin(self, context: FilterContext) -> RollingState:
        """At the speed that the motor rests at."""
        rest = np.asarray(context.rest, dtype=float)[..., THROTTLE]
        friction = self.friction / context.nominal["full_speed"]
        return RollingState(rest, np.where(rest < 0.0, -1.0, 1.0), 1.0 / context.rate_hz, friction)

    def apply(self, signal: Signal, memory: RollingState) -> tuple[Signal, RollingState]:
        """The mean speed over each sample, exact for a throttle that holds over it."""
        if self.inertia == 0.0:
            return signal, memory
        motor = signal[..., THROTTLE]
        speed = np.broadcast_to(memory.speed, motor.shape[:-1])
        before = np.broadcast_to(memory.ahead, motor.shape[:-1])[..., None]
        ahead = newest_signs(np.concatenate((before, np.sign(motor)), axis=-1))[..., 1:]
        rate = (1.0 - self.freewheel + self.freewheel * np.abs(motor)) / self.inertia + self.drag
        rate = np.maximum(rate, 1e-9)
        push = motor / self.inertia - ahead * memory.friction
        # Where the motor is too weak for friction, that ends at rest
        stuck = np.abs(motor) / self.inertia < memory.friction
        low, high = np.where(stuck & (ahead > 0.0), 0.0, -FAR), np.where(stuck & (ahead < 0.0), 0.0, FAR)
        kept, goal = np.exp(-rate * memory.sample_s), push / rate
        ends = _follow(np.stack((kept, goal * (1.0 - kept), low, high)), speed)
        starts = np.concatenate((speed[..., None], ends[..., :-1]), axis=-1)
        mean = goal + (starts - goal) * (1.0 - kept) / (rate * memory.sample_s)
        rolled = np.stack((np.clip(mean, low, high), signal[..., STEERING]), axis=-1)
        return rolled, memory._replace(speed=ends[..., -1], ahead=ahead[..., -1])


def _follow(steps: Signal, start: Signal) -> Signal:
    """The values (…, time) that steps v → clip(factor · v + shift, low, high) (4, …, time) make of a start (…,).

    Such steps in a row are one such step: they are composed within √time blocks side by side, then these follow.
    """
    length = steps.shape[-1]
    size = math.isqrt(length)
    filler = np.reshape([1.0, 0.0, -FAR, FAR], (4, *[1] * (steps.ndim - 1)))
    filled = np.concatenate((steps, np.broadcast_to(filler, (*steps.shape[:-1], -length % size))), axis=-1)
    blocks = filled.reshape(*steps.shape[:-1], -1, size).copy()
    for inside in range(1, size):
        factor, shift, low, high = blocks[..., inside].copy()
        before = blocks[..., inside - 1]
        blocks[0, ..., inside], blocks[1, ..., inside] = factor * before[0], factor * before[1] + shift
        for bound in (2, 3):
            blocks[bound, ..., inside] = np.clip(factor * before[bound] + shift, low, high)
    values: Signal = np.empty_like(blocks[0])
    for block in range(values.shape[-2]):
        factor, shift, low, high = blocks[..., block, :]
        values[..., block, :] = np.clip(factor * start[..., None] + shift, low, high)
        start = values[..., block, -1]
    flat: Signal = values.reshape(*steps.shape[1:-1], -1)
    return flat[..., :length]


@effect("tyres", Stage.MOTION)
class Tyres(ShippedEffect):
    """Tyres slip sideways in bends: the car turns the less the harder it corners, and its rear slides outwards.

    The yaw rate is divided by 1 + understeer · v²; then the lateral acceleration a = v · yaw is held back as
    tanh(slide · a) / slide, at most 1 / slide; and the rear axle slides by v · rear_slip · a.
    """

    understeer: float = parameter("s²/m²", 0.0, 10.0, probes=(0.01, 0.03, 0.1, 0.3), usual=(0.0, 1.0),
        source="1 by the square of the speed at which a car turns half as far: 3 to 10 m/s for model cars")  # fmt: skip
    slide: float = parameter("s²/m", 0.0, 10.0, probes=(0.07, 0.15, 0.3, 0.6), usual=(0.0, 1.0),
        source="1 by the lateral acceleration that tyres hold: 2 to 10 m/s²")  # fmt: skip
    rear_slip: float = parameter("s²/m", -0.1, 0.2, probes=(0.005, 0.015, 0.04, 0.1),
        source="slip angle of some degrees at 5 m/s²")  # fmt: skip
    trace = Trace(
        (Cue.TURN_RATE,),
        Means(Cue.TURN_RATE, (Panel("bend", "forward speed times turn rate [m/s²]", "turn", share=True),)),
        forms=(
            Form((("understeer",),), "understeer", moved=("understeer",)),
            Form((("slide",),), "slide", moved=("slide",)),
            Form(
                (("rear_slip",),),
                "rear slip",
                moved=("rear_slip",),
                shown=Means(Cue.TURN_RATE, (Panel("bend", "forward speed times turn rate [m/s²]", "sideways"),)),
            ),
        ),
    )

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Turn the less, and slide the more, the harder the car corners."""
        forward, sideways, yaw = np.moveaxis(signal, -1, 0)
        turned = yaw / (1.0 + self.understeer * forward**2)
        wanted = self.slide * np.abs(forward * turned)
        turned = turned * np.where(wanted > 1e-9, np.tanh(wanted) / np.maximum(wanted, 1e-9), 1.0)
        slid = sideways - self.rear_slip * np.abs(forward) * forward * turned
        return np.stack((forward, slid, turned), axis=-1), None


UNEVEN = "imbalance"


def on_column(
    wheels: type[Any], column: int, name: str, does: str = "", changed: Mapping[str, Any] | None = None
) -> type[Effect]:
    """An effect on wheels as one on a column, under a name of its own.

    `does` says what it does where the wheels' own docstring does not, `changed` what is different about its parameters:
    bounds, probes, source.
    """
    own = tuple(replace(one, **(changed or {})) for one in wheels.parameters if one.name != UNEVEN)
    even = {UNEVEN: 0.0} if len(own) < len(wheels.parameters) else {}

    def begin(self: Any, context: FilterContext) -> tuple[Any, Memory]:
        effect = wheels(**{one.name: getattr(self, one.name) for one in own}, **even)
        return effect, effect.begin(replace(context, rest=_twice(np.asarray(context.rest, dtype=float), column)))

    def apply(self: Any, signal: Signal, memory: tuple[Any, Memory]) -> tuple[Signal, tuple[Any, Memory]]:
        effect, before = memory
        both, after = effect.apply(_twice(signal, column), before)
        bent = np.array(signal, dtype=float)
        bent[..., column] = both[..., 0]
        return bent, (effect, after)

    begin.__doc__, apply.__doc__ = "Begin as two wheels that are alike.", "Filter the column, and leave the other."
    body = {"name": name, "stage": wheels.stage, "parameters": own, "trace": _trace(wheels.trace, column)}
    title = "".join(part.title() for part in name.split("_")) + ("OfCar" if column == THROTTLE else "")
    fields = [(one.name, float) for one in own]
    kind = make_dataclass(title, fields, namespace={**body, "begin": begin, "apply": apply}, frozen=True)
    kind.__doc__, kind.__module__ = does or wheels.__doc__, __name__
    return cast(type[Effect], kind)


def _twice(signal: Signal, column: int) -> Signal:
    return np.repeat(signal[..., column : column + 1], 2, axis=-1)


def _trace(trace: Trace, column: int) -> Trace:
    """What shows it: forms with uneven wheels are none, and what steers is seen by the steering."""
    forms = (form for form in trace.forms if UNEVEN not in form.fixed and UNEVEN not in form.moved)
    kept = tuple(form for form in forms if not any({"left", "right"} & {*names} for names in form.free))
    cues = tuple(Cue.STEERING if cue is Cue.WHEEL_COMMAND else cue for cue in trace.cues)
    return replace(trace, forms=kept, cues=cues if column == STEERING else trace.cues)


_SERVO = "hobby servos of model cars"

QUANTISATION = on_column(CommandQuantisation, THROTTLE, "command_quantisation", "Throttle is rounded to multiples.")
PAUSE = on_column(
    ReversalPause,
    THROTTLE,
    "reversal_pause",
    "The speed controller lets the motor rest for `pause` before it drives it the other way.",
)

STEERED_COMMANDS: tuple[type[Effect], ...] = (
    on_column(CommandQuantisation, STEERING, "steering_quantisation", "Steering is rounded to multiples of a step.",
              {"unit": "full lock", "source": f"{_SERVO}: steps of some hundredths of full lock"}),
    on_column(Delay, STEERING, "steering_delay", "Steering arrives later than throttle by a constant time.",
              {"high": 0.3, "probes": (0.02, 0.04, 0.08, 0.15),
               "source": f"{_SERVO} are sent a pulse every 20 ms, some through a slower board"}),
)  # fmt: skip

THROTTLED: tuple[type[Effect], ...] = (
    on_column(SlewRate, THROTTLE, "slew_rate", "The motor's driver changes throttle no faster than from rest to full "
              "within `rise_time`."),
    on_column(DriverMap, THROTTLE, "driver_map"),
    on_column(DeadBand, THROTTLE, "dead_band", "The motor does nothing for throttles up to `width`, and by that much "
              "less for larger ones.", {"source": "speed controllers of model cars: 0.05 to 0.2 of full throttle"}),
    on_column(Stiction, THROTTLE, "stiction", "A resting car needs a throttle of `breakaway` to start; a moving one "
              "goes on down to `release` times that."),
    on_column(Saturation, THROTTLE, "saturation", "The motor turns no faster than at a throttle of `limit`."),
    on_column(Gain, THROTTLE, "wheel_gain", "The car drives faster or slower than nominal by a factor.",
              {"source": "batteries, gears and motors other than nominal: up to half faster or slower"}),
    on_column(BatterySag, THROTTLE, "battery_sag"),
    on_column(ThermalFade, THROTTLE, "thermal_fade"),
    on_column(MotorLag, THROTTLE, "motor_lag", "The motor follows throttle with a first-order lag."),
    on_column(Backlash, THROTTLE, "backlash"),
)  # fmt: skip

STEERED: tuple[type[Effect], ...] = (
    on_column(SlewRate, STEERING, "steering_slew_rate", "The servo turns no faster than from the middle to full lock "
              "within `rise_time`.", {"high": 1.0, "usual": None, "probes": (0.05, 0.1, 0.2, 0.4, 0.8),
                                      "source": f"{_SERVO}: 60° in 0.1 to 0.2 s"}),
    on_column(DeadBand, STEERING, "steering_dead_band", "The servo does nothing for steering up to `width`, and by "
              "that much less for more.", {"unit": "full lock", "high": 0.3, "usual": None, "probes": (0.02, 0.04, 0.08,
                                           0.15), "source": f"{_SERVO}: some hundredths of full lock"}),
    on_column(Saturation, STEERING, "steering_saturation", "The wheels stop at `limit`, whatever is asked.",
              {"unit": "full lock", "source": "stops of the linkage before those of the servo: 0.6 to 1"}),
    on_column(MotorLag, STEERING, "steering_lag", "The servo follows steering with a first-order lag.",
              {"high": 0.6, "usual": None, "neutral": 0.0, "probes": (0.02, 0.05, 0.1, 0.2, 0.4),
               "source": f"{_SERVO}: 0.05 to 0.2 s"}),
    on_column(Gain, STEERING, "steering_gain", "The wheels turn by more or less than nominal by a factor.",
              {"source": "linkages and servo horns other than nominal: some tenths more or less"}),
)  # fmt: skip
