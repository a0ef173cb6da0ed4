"""How an effect on the wheels is shared out between the left one and the right one."""

from dataclasses import replace

import numpy as np

from proxytune.effects.effect import Signal
from proxytune.space import Parameter

IMBALANCE = Parameter(
    "imbalance",
    "",
    -1.0,
    1.0,
    0.0,
    (-1.0, -0.5, 0.5, 1.0),
    "by definition: −1 is the left wheel alone, 1 the right one",
)
"""How much more of an effect the right wheel has than the left one."""

SLIGHT_IMBALANCE = replace(IMBALANCE, probes=(-0.5, -0.2, 0.2, 0.5))
"""The same where a wheel without any of the effect is no sensible guess."""


def per_wheel(value: float, imbalance: float) -> Signal:
    """A value's share on each wheel, (2,): value · (1 − imbalance) left, value · (1 + imbalance) right."""
    return np.array((value * (1.0 - imbalance), value * (1.0 + imbalance)))
