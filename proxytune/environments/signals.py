"""What effects are told before the first step of an environment."""

import numpy as np

from proxytune.effects import Setting, Signal, Stage
from proxytune.environments.spaces import Spaces

WHEELS = 2
"""Effects on commands are written for a left and a right wheel."""


def figures(spaces: Spaces) -> dict[str, float]:
    """The nominal figures that effects ask for: commands come at every step, and nothing lags."""
    known = {"control_rate": spaces.rate_hz or 1.0, "motor_time_constant": 0.0}
    if spaces.picture is not None:
        known |= {"camera_rows": float(spaces.picture[0]), "camera_columns": float(spaces.picture[1])}
    return known


def rest_of(stage: Stage, spaces: Spaces) -> Signal:
    """The signal of a stage before time zero, as far as the spaces tell it."""
    if stage is Stage.IMAGE and spaces.picture is not None:
        return np.zeros(3 * spaces.picture[0] * spaces.picture[1], dtype=np.float32)
    if stage is Stage.MEASUREMENT:
        return np.zeros(3)
    return np.zeros(WHEELS if len(spaces.low) == WHEELS else (len(spaces.low), WHEELS))


def setting_of(spaces: Spaces, rest: Signal, seed: int) -> Setting:
    """What a chain is told before its first sample; where the rate is not known, no effect asks for it."""
    return Setting(spaces.rate_hz or 1.0, rest, figures(spaces), seed)
