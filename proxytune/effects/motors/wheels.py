"""How an effect on the wheels is shared out between the left one and the right one."""

from dataclasses import replace

import numpy as np

from proxytune.effects.effect import Signal
from proxytune.effects.trace import Form
from proxytune.space import Parameter

IMBALANCE = Parameter(
    name="imbalance",
    unit="",
    low=-1.0,
    high=1.0,
    neutral=0.0,
    probes=(-1.0, -0.5, 0.5, 1.0),
    source="by definition: −1 is the left wheel alone, 1 the right one",
    shape=True,
)
"""How much more of an effect the right wheel has than the left one."""

SLIGHT_IMBALANCE = replace(IMBALANCE, probes=(-0.5, -0.2, 0.2, 0.5))
"""The same where a wheel without any of the effect is no sensible guess."""


def per_wheel(value: float, imbalance: float) -> Signal:
    """A value's share on each wheel, (2,): value · (1 − imbalance) left, value · (1 + imbalance) right."""
    return np.array((value * (1.0 - imbalance), value * (1.0 + imbalance)))


def wheel_forms(*parameters: str) -> tuple[Form, ...]:
    """Forms with these parameters free: both wheels alike, one of them alone, or, where both have it, unevenly."""
    free = tuple((name,) for name in parameters)
    return (
        Form(free),
        Form(free, "left wheel", fixed={"imbalance": -1.0}, present=False),
        Form(free, "right wheel", fixed={"imbalance": 1.0}, present=False),
        Form((*free, ("imbalance",)), "uneven wheels", moved=("imbalance",), present=True),
    )
