"""Effects between the motion that the wheels ask of the body and the motion that the body makes."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.space import Parameter


def _moved(forward: Signal, sideways: Signal, yaw: Signal) -> Signal:
    return np.stack((forward, sideways, yaw), axis=-1)


@dataclass(frozen=True)
class YawScrub:
    """Tyres that scrub turn the robot as if its wheels were `baseline` apart."""

    baseline: float
    name: ClassVar[str] = "yaw_scrub"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            "baseline",
            "m",
            0.03,
            3.0,
            "effective_baseline",
            (0.05, 0.08, 0.12, 0.2, 0.3, 0.5, 1.0),
            "wheel distance on hard tyres to a few times it with scrub: 0.16 m instead of 0.10 m on a Duckiebot",
        ),
    )

    def begin(self, setting: Setting) -> float:
        """The factor on the yaw rate."""
        return setting.nominal["effective_baseline"] / self.baseline

    def apply(self, signal: Signal, memory: float) -> tuple[Signal, float]:
        """Scale the yaw rate."""
        return _moved(signal[..., 0], signal[..., 1], signal[..., 2] * memory), memory


@dataclass(frozen=True)
class TurnSlip:
    """Turning costs forward speed: it shrinks by the factor 1 − loss · |yaw rate|."""

    loss: float
    name: ClassVar[str] = "turn_slip"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            "loss",
            "s/rad",
            0.0,
            1.5,
            0.0,
            (0.02, 0.05, 0.1, 0.2, 0.4, 0.8),
            "tyres in a bend: some hundredths of the speed at 1 rad/s, tracks up to half",
        ),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow the robot down in bends, at most to a stop."""
        kept = np.maximum(0.0, 1.0 - self.loss * np.abs(signal[..., 2]))
        return _moved(signal[..., 0] * kept, signal[..., 1], signal[..., 2]), None


@dataclass(frozen=True)
class LateralSlip:
    """The robot slides outwards in bends, by `slip` times its forward speed and its yaw rate."""

    slip: float
    name: ClassVar[str] = "lateral_slip"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            "slip",
            "s",
            -0.5,
            0.5,
            0.0,
            (-0.2, -0.08, -0.03, 0.03, 0.08, 0.2),
            "slip angle of some degrees at 1 rad/s; a pose that is not measured at the axle looks the same",
        ),
    )

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slide to the right in a bend to the left."""
        outwards = self.slip * signal[..., 0] * signal[..., 2]
        return _moved(signal[..., 0], signal[..., 1] - outwards, signal[..., 2]), None


class Bearing(NamedTuple):
    """Headings known beforehand (…, n), number of the next sample, its heading (…, 1), and samples per second."""

    known: Signal
    next: int
    heading: Signal
    rate_hz: float


@dataclass(frozen=True)
class FloorSlope:
    """The floor rises along x and y: uphill the robot is slower, downhill faster, and at rest it stays.

    The forward speed shrinks by (x · cos heading + y · sin heading) · min(1, |forward speed| / REST_SPEED).
    """

    x: float
    y: float
    name: ClassVar[str] = "floor_slope"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            axis,
            "m/s",
            -0.3,
            0.3,
            0.0,
            (-0.1, -0.04, -0.015, 0.015, 0.04, 0.1),
            "speed that a small robot loses on a floor some degrees from level",
        )
        for axis in ("x", "y")
    )

    def begin(self, setting: Setting) -> Bearing:
        """With the headings that are known beforehand."""
        return bearing(setting)

    def apply(self, signal: Signal, memory: Bearing) -> tuple[Signal, Bearing]:
        """Slow the robot down by the slope along its heading at the start of each sample."""
        forward = signal[..., 0]
        course, after = headings(signal[..., 2], memory)
        slope = self.x * np.cos(course) + self.y * np.sin(course)
        slowed = forward - slope * np.minimum(1.0, np.abs(forward) / REST_SPEED)
        return _moved(slowed, signal[..., 1], signal[..., 2]), after


REST_SPEED = 0.02
"""Below this forward speed [m/s] static friction takes up more and more of the slope."""


def bearing(setting: Setting) -> Bearing:
    """The bearing before the first sample."""
    known = np.asarray(setting.headings, dtype=float)
    shape = np.broadcast_shapes(known.shape[:-1], np.shape(setting.rest)[:-1])
    known = np.broadcast_to(known, (*shape, known.shape[-1]))
    return Bearing(known, 0, known[..., :1], setting.rate_hz)


def headings(yaw: Signal, memory: Bearing) -> tuple[Signal, Bearing]:
    """Headings at the start of each sample: known ones, and beyond them those that the yaw rate leads to."""
    length = yaw.shape[-1]
    known = memory.known[..., memory.next : memory.next + length]
    given = known.shape[-1]
    newest = known[..., -1:] if given else memory.heading
    turned = np.cumsum(yaw[..., max(0, given - 1) :], axis=-1) / memory.rate_hz
    path = np.concatenate((known[..., :-1], newest, newest + turned), axis=-1)
    return path[..., :length], memory._replace(next=memory.next + length, heading=path[..., length:])
