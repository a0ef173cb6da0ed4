"""What predicts DART without a diagnosis: constant velocity, a kinematic bicycle fitted, and its authors' own physics.

The physics is `dyn_model_culomb_tires` of `DART_dynamic_models` in Lorenzo-Lyons/DART at commit 4b52523 (MIT licence),
with its steering friction and without pitch, every figure as given there, integrated by Euler steps as there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter

Array = NDArray[np.float64]

STEP_S = 0.01
WHEELBASE = 0.1735
"""Of the car, from its drawings [m]."""

AROUND = 5
"""Speeds are differences of poses so many samples before and after, as the authors take them."""


@dataclass(frozen=True)
class Drive:
    """A drive on a grid of 100 samples a second.

    Attributes:
        poses: Of the marker (rows, 3): x [m], y [m], heading [rad, unwrapped].
        throttle: As commanded, 0 where the driver's switch is off (rows,).
        steering: As commanded (rows,).
    """

    poses: Array
    throttle: Array
    steering: Array

    @cached_property
    def velocities(self) -> Array:
        """Velocity of the marker in the room and turn rate (rows, 3): [m/s], [m/s], [rad/s]."""
        return velocities(self.poses)


Yardstick = Callable[[Drive, NDArray[np.intp], int], Array]
"""The poses of the marker (W, 3) so many samples after starts (W,)."""


def velocities(poses: Array) -> Array:
    """Rates of poses (rows, 3) over ±50 ms."""
    padded = np.pad(poses, ((AROUND, AROUND), (0, 0)), mode="edge")
    return (padded[2 * AROUND :] - padded[: -2 * AROUND]) / (2 * AROUND * STEP_S)


def turned(x: Array, y: Array, angle: Array) -> tuple[Array, Array]:
    """Vectors turned by angles."""
    return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y


def constant_velocity(drive: Drive, starts: NDArray[np.intp], steps: int) -> Array:
    """The marker goes on straight at its velocity, and turns on."""
    return np.asarray(drive.poses[starts] + drive.velocities[starts] * (steps * STEP_S))


@dataclass(frozen=True)
class Bicycle:
    """A kinematic bicycle from the measured speed on, with a gain and a zero of throttle and of steering, and a lag.

    Attributes:
        gain: Speed by throttle beyond `zero` [m/s].
        zero: Throttle at which the car stands.
        lag_s: Time constant of the speed [s].
        angle: Angle of the front wheels by steering [rad].
        offset: Their angle at a steering of 0 [rad].
        ahead: Where the marker is, ahead of the rear axle [m].
    """

    gain: float = 8.0
    zero: float = 0.15
    lag_s: float = 0.3
    angle: float = 0.4
    offset: float = 0.0
    ahead: float = 0.1

    def __call__(self, drive: Drive, starts: NDArray[np.intp], steps: int) -> Array:
        """Poses of the marker (W, 3) after so many samples."""
        x, y, heading = drive.poses[starts].T
        speed, _ = turned(*drive.velocities[starts, :2].T, -heading)
        kept = np.exp(-STEP_S / self.lag_s)
        x, y = x - self.ahead * np.cos(heading), y - self.ahead * np.sin(heading)
        for step in range(steps):
            goal = self.gain * np.maximum(0.0, drive.throttle[starts + step] - self.zero)
            speed = goal + (speed - goal) * kept
            turn = speed * np.tan(self.angle * drive.steering[starts + step] + self.offset) / WHEELBASE * STEP_S
            x, y = x + STEP_S * speed * np.cos(heading + turn / 2), y + STEP_S * speed * np.sin(heading + turn / 2)
            heading = heading + turn
        return np.stack((x + self.ahead * np.cos(heading), y + self.ahead * np.sin(heading), heading), axis=-1)


def fitted_bicycle(drives: list[Drive], steps: int = 100) -> Bicycle:
    """The bicycle that places the marker best so many samples ahead."""
    every = [np.arange(AROUND, len(drive.poses) - steps, 25) for drive in drives]

    def gaps(figures: Array) -> Array:
        model = Bicycle(*figures)
        pairs = zip(drives, every, strict=True)
        return np.concatenate([(model(d, s, steps) - d.poses[s + steps])[:, :2].ravel() for d, s in pairs])

    first = Bicycle()
    start = [getattr(first, name) for name in Bicycle.__dataclass_fields__]
    low, high = [1.0, 0.0, 0.02, 0.05, -0.3, -0.3], [40.0, 0.4, 30.0, 1.2, 0.3, 0.3]
    return Bicycle(*least_squares(gaps, start, bounds=(low, high), x_scale=np.maximum(np.abs(start), 0.05)).x)


class Physics:
    """The authors' model: motor, rolling friction, friction of the steering, curve of it, tyres by Pacejka."""

    mass, front_mass, rear_mass = 1.580, 0.847, 0.733
    rear = WHEELBASE / (1 + rear_mass / front_mass)
    front = WHEELBASE - rear
    inertia = mass * (WHEELBASE**2 + 0.08**2) / 12
    marker_ahead, marker_left, turned_by = 0.115 - rear, -0.01, 0.00768628716468811
    motor, motor_fade, motor_zero, motor_lag_s = (
        25.35849952697754,
        4.815326690673828,
        0.16377617418766022,
        0.0843319296836853,
    )
    rolling = (1.2659882307052612, 7.666370391845703, 0.7393041849136353, -0.11231517791748047)
    left_curve, right_curve = (0.36576229333877563, 1.392930030822754), (0.5147881507873535, 1.0230425596237183)
    steering_zero, steering_lag_s = 0.0029959678649902344 - 0.03, 0.12851488590240479
    front_tyre = (-0.8406859636306763, 0.8407371044158936, 8.598039627075195)
    rear_tyre = (-0.8546739816665649, 0.959108829498291, 11.54928207397461)
    steering_friction = (-0.11826395988464355, 5.915864944458008, 0.22619032859802246, 0.7793111801147461)

    def __call__(self, drive: Drive, starts: NDArray[np.intp], steps: int) -> Array:
        """Poses of the marker (W, 3) after so many samples."""
        heading = drive.poses[:, 2]
        shift = turned(*np.broadcast_to([[self.marker_ahead], [self.marker_left]], (2, len(heading))), heading)
        centre = np.stack((*(drive.poses[:, :2] - np.stack(shift, axis=-1)).T, heading + self.turned_by), axis=-1)
        x, y, yaw = centre[starts].T
        rates = velocities(centre)[starts].T
        vx, vy = turned(rates[0], rates[1], -yaw)
        turn = rates[2]
        throttle, steering = _follow(drive.throttle, self.motor_lag_s), _follow(drive.steering, self.steering_lag_s)
        for step in range(steps):
            now = starts + step
            ax, ay, spin = self._accelerations(vx, vy, turn, throttle[now], self._angle(steering[now]))
            east, north = turned(vx, vy, yaw)
            x, y, yaw = x + east * STEP_S, y + north * STEP_S, yaw + turn * STEP_S
            vx, vy, turn = vx + ax * STEP_S, vy + ay * STEP_S, turn + spin * STEP_S
        yaw = yaw - self.turned_by
        ahead, left = turned(np.full_like(yaw, self.marker_ahead), np.full_like(yaw, self.marker_left), yaw)
        return np.stack((x + ahead, y + left, yaw), axis=-1)

    def _angle(self, steering: Array) -> Array:
        bent, share = steering + self.steering_zero, 0.5 * (np.tanh(30 * (steering + self.steering_zero)) + 1)
        left, right = (angle * np.tanh(bend * bent) for angle, bend in (self.left_curve, self.right_curve))
        return share * left + (1 - share) * right

    def _accelerations(self, vx: Array, vy: Array, turn: Array, throttle: Array, angle: Array) -> tuple[Array, ...]:
        beyond = throttle - self.motor_zero
        pull = (self.motor - self.motor_fade * vx) * 0.5 * (np.tanh(100 * beyond) + 1) * beyond
        a, b, c, d = self.rolling
        pull -= a * np.tanh(b * vx) + c * vx + d * vx**2
        a, b, d, e = self.steering_friction
        steered = a + b * angle * np.tanh(30 * angle)
        pull -= 0.5 * (1 + np.tanh(20 * (vx - 0.3))) * (e + d * (vx - 0.5)) * steered
        at_front, at_rear = pull * self.front_mass / self.mass, pull * self.rear_mass / self.mass
        along, across = turned(vx, vy + self.front * turn, -angle)
        slip_front = np.arctan2(across, along + np.exp(-3 * along**2))
        slip_rear = np.arctan2(vy - self.rear * turn, vx + np.exp(-3 * vx**2))
        side_front = _tyre(slip_front, self.front_mass, *self.front_tyre)
        side_rear = _tyre(slip_rear, self.rear_mass, *self.rear_tyre)
        cosine, sine = np.cos(angle), np.sin(angle)
        forward = at_front * cosine + at_rear - side_front * sine
        left = at_front * sine + side_front * cosine + side_rear
        moment = self.front * (at_front * sine + side_front * cosine) - self.rear * side_rear
        return forward / self.mass + turn * vy, left / self.mass - turn * vx, moment / self.inertia


def _tyre(slip: Array, mass: float, most: float, shape: float, stiffness: float) -> Array:
    return mass * 9.81 * most * np.sin(shape * np.arctan(stiffness * slip))


def _follow(signal: Array, lag_s: float) -> Array:
    share = STEP_S / lag_s
    followed: Array = lfilter([0.0, share], [1.0, share - 1.0], signal)
    return followed
