"""Effects of the floor: slopes that slow the robot down or push it aside, and patches where its wheels slip."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.known import Known, beforehand, values_along
from proxytune.effects.trace import Cue, Means, Panel, Trace
from proxytune.space import Parameter

REST_SPEED = 0.02
"""Below this forward speed [m/s] static friction takes up more and more of the slope."""

RIM_M = 0.1
"""A patch begins to be felt over this way: a robot is not a point."""


@dataclass(frozen=True)
class FloorSlope:
    """The floor rises along x and y: uphill the robot is slower, downhill faster, and at rest it stays.

    The forward speed shrinks by (x · cos heading + y · sin heading) · min(1, |forward speed| / REST_SPEED); across the
    slope the robot slides downhill by `push` times what the slope would take from it along its heading.
    """

    x: float
    y: float
    push: float
    name: ClassVar[str] = "floor_slope"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *(
            Parameter(
                name=axis,
                unit="m/s",
                low=-0.3,
                high=0.3,
                neutral=0.0,
                probes=(-0.1, -0.04, -0.015, 0.015, 0.04, 0.1),
                source="speed that a small robot loses on a floor some degrees from level",
            )
            for axis in ("x", "y")
        ),
        Parameter(
            name="push",
            unit="",
            low=0.0,
            high=2.0,
            neutral=0.0,
            probes=(0.25, 0.5, 1.0, 1.0, 0.5, 0.25),
            source="0 for tyres that hold sideways, 1 for a robot that slides as easily across as along",
            shape=True,
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.HEADING,),
        shown=Means(
            Cue.HEADING, tuple(Panel("heading", "heading [deg]", motion) for motion in ("forward", "sideways"))
        ),
    )

    def begin(self, setting: Setting) -> Known:
        """With the headings that are known beforehand."""
        return beforehand(setting.headings, setting)

    def apply(self, signal: Signal, memory: Known) -> tuple[Signal, Known]:
        """Slow the robot down by the slope along its heading at the start of each sample."""
        forward, sideways, yaw = np.moveaxis(signal, -1, 0)
        headings, after = values_along(yaw, memory)
        cosine, sine = np.cos(headings), np.sin(headings)
        moving = np.minimum(1.0, np.abs(forward) / REST_SPEED)
        slowed = forward - (self.x * cosine + self.y * sine) * moving
        pushed = sideways + self.push * (self.x * sine - self.y * cosine) * moving
        return np.stack((slowed, pushed, yaw), axis=-1), after


class Walk(NamedTuple):
    """Poses known beforehand (…, n, 3), number of the next sample, the pose at its start (…, 3), samples per second."""

    known: Signal
    next: int
    pose: Signal
    rate_hz: float


@dataclass(frozen=True)
class SlipperyPatch:
    """In a round part of the map the wheels slip: the robot loses a share of its motion there.

    The part's rim is RIM_M wide, and half of the loss is felt in its middle, `radius` away from (x, y).
    """

    loss: float
    x: float
    y: float
    radius: float
    name: ClassVar[str] = "slippery_patch"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="loss",
            unit="",
            low=0.0,
            high=0.9,
            neutral=0.0,
            probes=(0.05, 0.1, 0.2, 0.4),
            source="carpet, dust and wet floors: some hundredths to half of the motion",
        ),
        *(
            Parameter(
                name=axis,
                unit="m",
                low=-20.0,
                high=20.0,
                neutral=0.0,
                probes=(-1.0, -0.5, 0.5, 1.0),
                source="where the robot drives; a diagnosis looks over all places that were driven through",
                shape=True,
            )
            for axis in ("x", "y")
        ),
        Parameter(
            name="radius",
            unit="m",
            low=0.1,
            high=5.0,
            neutral=0.5,
            probes=(0.3, 0.8, 1.5, 2.5),
            source="from a puddle to a carpet",
            shape=True,
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.POSITION,),
        shown=Means(Cue.POSITION, tuple(Panel(axis, f"{axis} [m]", "forward", share=True) for axis in ("x", "y"))),
        placed=True,
    )

    def begin(self, setting: Setting) -> Walk:
        """With the poses that are known beforehand."""
        places, headings = np.asarray(setting.places, dtype=float), np.asarray(setting.headings, dtype=float)
        count = min(places.shape[-2], headings.shape[-1])
        shape = np.broadcast_shapes(places.shape[:-2], headings.shape[:-1], np.shape(setting.rest)[:-1])
        parts = (places[..., :count, 0], places[..., :count, 1], headings[..., :count])
        known = np.stack([np.broadcast_to(part, (*shape, count)) for part in parts], axis=-1)
        return Walk(known, 0, known[..., 0, :], setting.rate_hz)

    def apply(self, signal: Signal, memory: Walk) -> tuple[Signal, Walk]:
        """Scale the motion by where the robot is at the start of each sample."""
        length = signal.shape[-2]
        known = memory.known[..., memory.next : memory.next + length, :]
        given = known.shape[-2]
        pose = known[..., -1, :] if given else memory.pose
        moved = signal.copy()
        moved[..., :given, :] *= self._kept(known)[..., None]
        for sample in range(max(0, given - 1), length):
            if sample >= given:
                moved[..., sample, :] *= self._kept(pose)[..., None]
            pose = _after(pose, moved[..., sample, :] / memory.rate_hz)
        return moved, memory._replace(next=memory.next + length, pose=pose)

    def _kept(self, poses: Signal) -> Signal:
        """The share of the motion that is kept at each pose (…)."""
        away = np.hypot(poses[..., 0] - self.x, poses[..., 1] - self.y)
        return np.asarray(1.0 - self.loss * np.clip((self.radius - away) / RIM_M + 0.5, 0.0, 1.0))


def _after(pose: Signal, motion: Signal) -> Signal:
    """The pose after a small motion in the body's frame, (…, 3) both."""
    middle = pose[..., 2] + motion[..., 2] / 2.0
    cosine, sine = np.cos(middle), np.sin(middle)
    x = pose[..., 0] + motion[..., 0] * cosine - motion[..., 1] * sine
    y = pose[..., 1] + motion[..., 0] * sine + motion[..., 1] * cosine
    return np.stack((x, y, pose[..., 2] + motion[..., 2]), axis=-1)
