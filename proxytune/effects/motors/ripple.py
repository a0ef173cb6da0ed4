"""Wheels that are not round, or not mounted in their middle."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.known import Known, beforehand, values_along
from proxytune.effects.trace import Cue, Means, Panel, Trace
from proxytune.space import Parameter


class Rolling(NamedTuple):
    """The angle of each wheel as known beforehand, half the distance between them [m], and their radius [m]."""

    angles: tuple[Known, Known]
    half: float
    radius: float


@dataclass(frozen=True)
class WheelRipple:
    """Each wheel rolls faster and slower once a turn: by the factor 1 + sine · sin(angle) + cosine · cos(angle).

    Its amplitude is √(sine² + cosine²). Angles count from the start of the episode.
    """

    left_sine: float
    left_cosine: float
    right_sine: float
    right_cosine: float
    name: ClassVar[str] = "wheel_ripple"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=f"{side}_{part}",
            unit="",
            low=-0.6,
            high=0.6,
            neutral=0.0,
            probes=(-0.3, -0.1, -0.03, 0.03, 0.1, 0.3),
            source="a hub some tenths of a millimetre to some millimetres off the middle of a small wheel",
        )
        for side in ("left", "right")
        for part in ("sine", "cosine")
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.LEFT_ANGLE, Cue.RIGHT_ANGLE),
        shown=Means(
            Cue.LEFT_ANGLE,
            tuple(
                Panel(f"{side} angle", f"angle of the {side} wheel [rad]", side, share=True)
                for side in ("left", "right")
            ),
        ),
    )

    def begin(self, setting: Setting) -> Rolling:
        """With the angles that are known beforehand."""
        angles = np.asarray(setting.angles, dtype=float)
        left, right = (beforehand(angles[..., side], setting) for side in (0, 1))
        return Rolling((left, right), setting.nominal["effective_baseline"] / 2.0, setting.nominal["wheel_radius"])

    def apply(self, signal: Signal, memory: Rolling) -> tuple[Signal, Rolling]:
        """Add what each wheel gains or loses, by its angle in the middle of each sample."""
        forward, sideways, yaw = np.moveaxis(signal, -1, 0)
        parts = ((self.left_sine, self.left_cosine), (self.right_sine, self.right_cosine))
        extra, after = [], []
        for side, (sine, cosine), known in zip((-1.0, 1.0), parts, memory.angles, strict=True):
            speed = forward + side * memory.half * yaw
            angles, later = values_along(speed / memory.radius, known)
            middle = angles + speed / (2.0 * memory.radius * known.rate_hz)
            extra.append(speed * (sine * np.sin(middle) + cosine * np.cos(middle)))
            after.append(later)
        turned = yaw + (extra[1] - extra[0]) / (2.0 * memory.half)
        moved = np.stack((forward + (extra[0] + extra[1]) / 2.0, sideways, turned), axis=-1)
        return moved, memory._replace(angles=(after[0], after[1]))
