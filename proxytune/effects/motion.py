"""Effects between the motion that wheels ask of the body, the one that it makes, and the pose that is measured of it.

First how forward speed, sideways speed and yaw rate change each other; then what the floor does where the robot is;
last how the pose that is tracked differs from that of the axle's middle.
"""

from typing import NamedTuple

import numpy as np

from proxytune.effects.effect import (
    TURN,
    Cue,
    DeadReckoning,
    FilterContext,
    Form,
    LowPassState,
    Means,
    Panel,
    ShippedEffect,
    Signal,
    Stage,
    Trace,
    approach,
    effect,
    like,
    low_pass,
    low_pass_at,
    parameter,
    reckon,
    start_reckoning,
    starts_of,
)
from proxytune.space import Parameter

TURNING = (Cue.TURN_RATE, Cue.COMMAND_DIFFERENCE)


def _by_turn_rate(*panels: Panel) -> Means:
    return Means(Cue.TURN_RATE, panels)


@effect("yaw_scrub", Stage.MOTION)
class YawScrub(ShippedEffect):
    """Tyres that scrub turn the robot as if its wheels were `baseline` apart."""

    baseline: float = parameter("m", 0.03, 30.0, "effective_baseline", probes=(0.05, 0.08, 0.12, 0.2, 0.3, 0.5, 1.0),
        usual=(0.03, 3.0),
        source="wheel distance on hard tyres to a few times it with scrub: 0.16 m instead of 0.10 m on "
               "a Duckiebot")  # fmt: skip
    trace = Trace(TURNING, _by_turn_rate(Panel("turn", TURN, "turn")))

    def begin(self, context: FilterContext) -> float:
        """The factor on the yaw rate."""
        return context.nominal["effective_baseline"] / self.baseline

    def apply(self, signal: Signal, memory: float) -> tuple[Signal, float]:
        """Scale the yaw rate."""
        return np.stack((signal[..., 0], signal[..., 1], signal[..., 2] * memory), axis=-1), memory


@effect("turn_slip", Stage.MOTION)
class TurnSlip(ShippedEffect):
    """Turning costs forward speed: it shrinks by the factor 1 − loss · |yaw rate|."""

    loss: float = parameter("s/rad", 0.0, 15.0, probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8), usual=(0.0, 1.5),
        source="tyres in a bend: some hundredths of the speed at 1 rad/s, tracks up to half")  # fmt: skip
    trace = Trace(TURNING, _by_turn_rate(Panel("turn", TURN, "forward", share=True)))

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow the robot down in bends, at most to a stop."""
        kept = np.maximum(0.0, 1.0 - self.loss * np.abs(signal[..., 2]))
        return np.stack((signal[..., 0] * kept, signal[..., 1], signal[..., 2]), axis=-1), None


@effect("lateral_slip", Stage.MOTION)
class LateralSlip(ShippedEffect):
    """The robot slides outwards in bends, by `slip` times its forward speed and its yaw rate."""

    slip: float = parameter("s", -5.0, 5.0, probes=(-0.2, -0.08, -0.03, 0.03, 0.08, 0.2), usual=(-0.5, 0.5),
        source="slip angle of some degrees at 1 rad/s; a pose that is not measured at the axle looks "
               "the same")  # fmt: skip
    trace = Trace((Cue.TURN_RATE,), _by_turn_rate(Panel("bend", "forward speed times turn rate [m/s²]", "sideways")))

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slide to the right in a bend to the left."""
        outwards = self.slip * signal[..., 0] * signal[..., 2]
        return np.stack((signal[..., 0], signal[..., 1] - outwards, signal[..., 2]), axis=-1), None


@effect("cross_coupling", Stage.MOTION)
class CrossCoupling(ShippedEffect):
    """Turning pushes the robot forwards, and driving turns it, whichever way it turns and drives.

    The forward speed grows by `forward` times the square of the yaw rate, the yaw rate by `turn` times |forward speed|.
    """

    forward: float = parameter("m·s/rad²", -2.0, 2.0, probes=(-0.03, -0.01, -0.003, 0.003, 0.01, 0.03),
        usual=(-0.2, 0.2),
        source="a centre of turning some millimetres to centimetres off the middle of the axle")  # fmt: skip
    turn: float = parameter("rad/m", -20.0, 20.0, probes=(-0.6, -0.2, -0.06, 0.06, 0.2, 0.6), usual=(-2.0, 2.0),
        source="a dragging caster or a tyre that pulls: some degrees to tens of degrees a metre")  # fmt: skip
    trace = Trace(
        (Cue.TURN_RATE, Cue.DIRECTION, Cue.COMMAND_DIFFERENCE),
        _by_turn_rate(Panel("turn", TURN, "forward"), Panel("forward", "forward speed [m/s]", "turn")),
    )

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Add to each what comes of the other."""
        forward, yaw = signal[..., 0], signal[..., 2]
        pushed, turned = forward + self.forward * yaw**2, yaw + self.turn * np.abs(forward)
        return np.stack((pushed, signal[..., 1], turned), axis=-1), None


@effect("understeer", Stage.MOTION)
class Understeer(ShippedEffect):
    """The faster the robot drives the less it turns: the yaw rate is divided by 1 + gain · |forward speed|."""

    gain: float = parameter("s/m", 0.0, 50.0, probes=(0.03, 0.1, 0.3, 0.8, 2.0), usual=(0.0, 5.0),
        source="tyres that slip sideways: some tenths of the turn at 1 m/s, small robots more")  # fmt: skip
    trace = Trace(TURNING, _by_turn_rate(Panel("forward", "forward speed [m/s]", "turn", share=True)))

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Scale the yaw rate."""
        turned = signal[..., 2] / (1.0 + self.gain * np.abs(signal[..., 0]))
        return np.stack((signal[..., 0], signal[..., 1], turned), axis=-1), None


@effect("yaw_lag", Stage.MOTION)
class YawLag(ShippedEffect):
    """The yaw rate follows the one that the wheels ask for with a first-order lag; the forward speed does not."""

    time_constant: float = parameter("s", 0.0, 10.0, probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8), usual=(0.0, 1.0),
        source="a body that has to be turned on tyres that give: some hundredths to tenths of a second")  # fmt: skip
    trace = Trace((Cue.TRANSIENTS, Cue.TURN_RATE), _by_turn_rate(Panel("turn", TURN, "turn")))

    def begin(self, context: FilterContext) -> LowPassState:
        """The resting yaw rate has been reached."""
        return low_pass_at(np.asarray(context.rest, dtype=float)[..., 2:], self.time_constant * context.rate_hz)

    def apply(self, signal: Signal, memory: LowPassState) -> tuple[Signal, LowPassState]:
        """The mean yaw rate over each sample."""
        late, after = low_pass(signal[..., 2:], memory)
        return np.concatenate((signal[..., :2], late), axis=-1), after

    def recall(
        self, context: FilterContext, whole: FilterContext, signal: Signal, row: Signal, sample: Signal
    ) -> LowPassState:
        """The memory of windows (W, …) that begin at a sample (W,) of a row (W,) of longer signals (rows, time, 3)."""
        asked, state = signal[..., 2:], self.begin(whole)
        return state._replace(value=starts_of(asked, low_pass(asked, state)[0], state)[row, sample])


LEAST_DAMPING = 0.05
"""So much of the resistance to turning at rest is always left."""


class BodyState(NamedTuple):
    """The forward speed under way, the yaw rate (…,) at the end of the last sample, and samples per second."""

    forward: LowPassState
    yaw: Signal
    rate_hz: float


@effect("inertia", Stage.MOTION)
class Inertia(ShippedEffect):
    """The body follows its wheels with lags; the floor resists turning, the more the faster the robot drives.

    dv/dt = (asked − v) / forward, d yaw/dt = (asked − damping · yaw) / turn, damping = 1 + linear · v + square · v².
    Source: the dynamic model of a Duckiebot by Ercan and others, with 1 / u1, 1 / w1 and w3 / w1 for the first three.
    """

    forward: float = parameter("s", 0.0, 10.0, probes=(0.1, 0.1, 0.2, 0.2, 0.1, 0.4), usual=(0.0, 1.0),
        source="a body on tyres that give: some hundredths to tenths of a second")  # fmt: skip
    turn: float = parameter("s", 0.0, 10.0, probes=(0.1, 0.1, 0.3, 0.3, 0.1, 0.3), usual=(0.0, 1.0),
        source="a body that has to be turned on tyres that give: some hundredths to tenths of a second")  # fmt: skip
    linear: float = parameter("s/m", -50.0, 50.0, probes=(0.3, 1.0, 0.3, 1.0, -0.3, -0.3), usual=(-5.0, 5.0),
        source="tyres that slip sideways: some tenths at 1 m/s; backwards the other way")  # fmt: skip
    square: float = parameter("s²/m²", -200.0, 200.0, probes=(0.5, 2.0, 0.5, 2.0, -0.5, -0.5), usual=(-20.0, 20.0),
        source="understeer of cars is some thousandths, that of a small robot with soft tyres some units")  # fmt: skip
    trace = Trace(
        (*TURNING, Cue.TRANSIENTS),
        _by_turn_rate(Panel("forward", "forward speed [m/s]", "turn", share=True)),
        forms=tuple(Form((("forward",), ("turn",), (by,)), f"turning is resisted by {name}") for by, name in
                    (("linear", "speed"), ("square", "the square of speed"))),
        contains=("motor_lag", "yaw_lag", "understeer"),
    )  # fmt: skip

    def begin(self, context: FilterContext) -> BodyState:
        """The resting motion has been reached."""
        rest = np.asarray(context.rest, dtype=float)
        forward = low_pass_at(rest[..., :1], self.forward * context.rate_hz)
        return BodyState(forward, rest[..., 2] / self._damping(rest[..., 0]), context.rate_hz)

    def apply(self, signal: Signal, memory: BodyState) -> tuple[Signal, BodyState]:
        """The mean motion over each sample; turning is resisted by the mean forward speed of that sample."""
        pushed, after = low_pass(signal[..., :1], memory.forward)
        turned, _, yaw = self._turned(signal[..., 2], pushed[..., 0], memory)
        return np.stack((pushed[..., 0], signal[..., 1], turned), axis=-1), memory._replace(forward=after, yaw=yaw)

    def recall(
        self, context: FilterContext, whole: FilterContext, signal: Signal, row: Signal, sample: Signal
    ) -> BodyState:
        """The memory of windows (W, …) that begin at a sample (W,) of a row (W,) of longer signals (rows, time, 3)."""
        body = self.begin(whole)
        pushed, _ = low_pass(signal[..., :1], body.forward)
        forward = starts_of(signal[..., :1], pushed, body.forward)
        _, yaw, _ = self._turned(signal[..., 2], pushed[..., 0], body)
        return body._replace(forward=body.forward._replace(value=forward[row, sample]), yaw=yaw[row, sample])

    def _turned(self, asked: Signal, forward: Signal, body: BodyState) -> tuple[Signal, Signal, Signal]:
        """The yaw rate on average over each sample and at its start (…, time), and at the end of the last (…,)."""
        damping = self._damping(forward)
        steady = asked / damping
        if not self.turn:
            return steady, steady, body.yaw
        samples = self.turn * body.rate_hz / damping
        kept = np.exp(-1.0 / samples)
        starts, end = approach(steady, kept, body.yaw)
        return steady + samples * (1.0 - kept) * (starts - steady), starts, end

    def _damping(self, forward: Signal) -> Signal:
        return np.maximum(LEAST_DAMPING, 1.0 + self.linear * forward + self.square * forward**2)


REST_SPEED = 0.02
"""Below this forward speed [m/s] static friction takes up more and more of the slope."""
RIM_M = 0.1
"""A patch begins to be felt over this way: a robot is not a point."""
SLOPE = Parameter(name="slope", unit="m/s", low=-3.0, high=3.0, neutral=0.0, usual=(-0.3, 0.3),
                  probes=(-0.1, -0.04, -0.015, 0.015, 0.04, 0.1),
                  source="speed that a small robot loses on a floor some degrees from level")  # fmt: skip


@effect("floor_slope", Stage.MOTION)
class FloorSlope(ShippedEffect):
    """The floor rises along x and y: uphill the robot is slower, downhill faster, and at rest it stays.

    The forward speed shrinks by (x · cos heading + y · sin heading) · min(1, |forward speed| / REST_SPEED); across the
    slope the robot slides downhill by `push` times what the slope would take from it along its heading.
    """

    x: float = like(SLOPE)
    y: float = like(SLOPE)
    push: float = parameter("", 0.0, 2.0, probes=(0.25, 0.5, 1.0, 1.0, 0.5, 0.25),
        source="0 for tyres that hold sideways, 1 for a robot that slides as easily across as along",
        shape=True)  # fmt: skip
    trace = Trace(
        (Cue.HEADING,),
        Means(Cue.HEADING, tuple(Panel("heading", "heading [deg]", motion) for motion in ("forward", "sideways"))),
    )

    def begin(self, context: FilterContext) -> DeadReckoning:
        """With the headings that are known beforehand."""
        return start_reckoning(context.headings, context)

    def apply(self, signal: Signal, memory: DeadReckoning) -> tuple[Signal, DeadReckoning]:
        """Slow the robot down by the slope along its heading at the start of each sample."""
        forward, sideways, yaw = np.moveaxis(signal, -1, 0)
        headings, after = reckon(yaw, memory)
        cosine, sine = np.cos(headings), np.sin(headings)
        moving = np.minimum(1.0, np.abs(forward) / REST_SPEED)
        slowed = forward - (self.x * cosine + self.y * sine) * moving
        pushed = sideways + self.push * (self.x * sine - self.y * cosine) * moving
        return np.stack((slowed, pushed, yaw), axis=-1), after


class PoseReckoning(NamedTuple):
    """Poses known beforehand (…, n, 3), number of the next sample, the pose at its start (…, 3), samples per second."""

    known: Signal
    next: int
    pose: Signal
    rate_hz: float


def start_poses(context: FilterContext) -> PoseReckoning:
    """Poses known beforehand, as far as both their places and their headings are."""
    places, headings = np.asarray(context.places, dtype=float), np.asarray(context.headings, dtype=float)
    count = min(places.shape[-2], headings.shape[-1])
    shape = np.broadcast_shapes(places.shape[:-2], headings.shape[:-1], np.shape(context.rest)[:-1])
    parts = (places[..., :count, 0], places[..., :count, 1], headings[..., :count])
    known = np.stack([np.broadcast_to(part, (*shape, count)) for part in parts], axis=-1)
    return PoseReckoning(known, 0, known[..., 0, :], context.rate_hz)


PLACE = Parameter(name="place", unit="m", low=-20.0, high=20.0, neutral=0.0, probes=(-1.0, -0.5, 0.5, 1.0),
                  source="where the robot drives; a diagnosis looks over all places that were driven through",
                  shape=True)  # fmt: skip


@effect("slippery_patch", Stage.MOTION)
class SlipperyPatch(ShippedEffect):
    """In a round part of the map the wheels slip: the robot loses a share of its motion there.

    The part's rim is RIM_M wide, and half of the loss is felt in its middle, `radius` away from (x, y).
    """

    loss: float = parameter("", 0.0, 0.9, probes=(0.05, 0.1, 0.2, 0.4),
        source="carpet, dust and wet floors: some hundredths to half of the motion")  # fmt: skip
    x: float = like(PLACE)
    y: float = like(PLACE)
    radius: float = parameter("m", 0.1, 5.0, 0.5, probes=(0.3, 0.8, 1.5, 2.5), source="from a puddle to a carpet",
        shape=True)  # fmt: skip
    trace = Trace(
        (Cue.POSITION,),
        Means(Cue.POSITION, tuple(Panel(axis, f"{axis} [m]", "forward", share=True) for axis in ("x", "y"))),
        placed=True,
    )

    def begin(self, context: FilterContext) -> PoseReckoning:
        """With the poses that are known beforehand."""
        return start_poses(context)

    def apply(self, signal: Signal, memory: PoseReckoning) -> tuple[Signal, PoseReckoning]:
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
            pose = pose_after(pose, moved[..., sample, :] / memory.rate_hz)
        return moved, memory._replace(next=memory.next + length, pose=pose)

    def _kept(self, poses: Signal) -> Signal:
        """The share of the motion that is kept at each pose (…)."""
        away = np.hypot(poses[..., 0] - self.x, poses[..., 1] - self.y)
        return np.asarray(1.0 - self.loss * np.clip((self.radius - away) / RIM_M + 0.5, 0.0, 1.0))


def pose_after(pose: Signal, motion: Signal) -> Signal:
    """The pose after a small motion in the body's frame, (…, 3) both."""
    middle = pose[..., 2] + motion[..., 2] / 2.0
    cosine, sine = np.cos(middle), np.sin(middle)
    x = pose[..., 0] + motion[..., 0] * cosine - motion[..., 1] * sine
    y = pose[..., 1] + motion[..., 0] * sine + motion[..., 1] * cosine
    return np.stack((x, y, pose[..., 2] + motion[..., 2]), axis=-1)


ASIDE = Parameter(name="aside", unit="m", low=-3.0, high=3.0, neutral=0.0, usual=(-0.3, 0.3),
                  probes=(-0.1, -0.04, -0.015, 0.015, 0.04, 0.1),
                  source="a marker is anywhere on the robot: up to half its length")  # fmt: skip


@effect("marker_offset", Stage.MEASUREMENT)
class MarkerOffset(ShippedEffect):
    """The point that is tracked lies ahead of the middle of the axle and to the left of it."""

    forward: float = like(ASIDE)
    left: float = like(ASIDE)
    trace = Trace((Cue.TURN_RATE,), _by_turn_rate(Panel("turn", TURN, "forward"), Panel("turn", TURN, "sideways")))

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Move each pose to the tracked point."""
        x, y, heading = signal[..., 0], signal[..., 1], signal[..., 2]
        cosine, sine = np.cos(heading), np.sin(heading)
        tracked_x = x + self.forward * cosine - self.left * sine
        tracked_y = y + self.forward * sine + self.left * cosine
        return np.stack((tracked_x, tracked_y, heading), axis=-1), None


@effect("heading_offset", Stage.MEASUREMENT)
class HeadingOffset(ShippedEffect):
    """The marker is stuck on turned: measured headings are off by a constant angle."""

    angle: float = parameter("deg", -180.0, 180.0, probes=(-20.0, -8.0, -3.0, 3.0, 8.0, 20.0), usual=(-45.0, 45.0),
        source="a marker stuck on by hand: some degrees; more where its axes are another's")  # fmt: skip
    trace = Trace((Cue.TURN_RATE,), _by_turn_rate(Panel("forward", "forward speed [m/s]", "sideways")))

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Add the angle to each heading."""
        return signal + np.array((0.0, 0.0, np.radians(self.angle))), None
