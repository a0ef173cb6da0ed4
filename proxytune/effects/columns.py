"""Effects of two wheels on one column of a car's commands: throttle, or steering.

A column goes through the wheels' own filter as two wheels that are alike, so there is one implementation of each
effect. What steers has the prefix `steering_`; what drives is called as on wheels.
"""

from collections.abc import Mapping
from dataclasses import make_dataclass, replace
from typing import Any, cast

import numpy as np

from proxytune.effects.command import CommandQuantisation, Delay
from proxytune.effects.effect import Cue, Effect, FilterContext, Memory, Signal, Trace
from proxytune.effects.friction import Backlash, DeadBand, Stiction
from proxytune.effects.motors import BatterySag, DriverMap, Gain, MotorLag, Saturation, SlewRate, ThermalFade

THROTTLE, STEERING = 0, 1
"""The columns of a car's commands and of what comes of them: speed, and angle of the front wheels."""
UNEVEN = "imbalance"


def on_column(
    wheels: type[Any], column: int, name: str, does: str = "", changed: Mapping[str, Any] | None = None
) -> type[Effect]:
    """An effect on wheels as one on a column.

    Args:
        wheels: Class of the effect on wheels.
        column: THROTTLE or STEERING.
        name: What it is called.
        does: What it does, where the wheels' own docstring does not say it.
        changed: What is different about its parameters: bounds, probes, source.
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
    kind = make_dataclass(
        title, [(one.name, float) for one in own], namespace={**body, "begin": begin, "apply": apply}, frozen=True
    )
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
