"""Measured logs of a Duckiebot with a hidden effect: another simulation than hidden.py's, with which it shares nothing.

The robot: messages → delay → duty → wheel speeds asked for, with trim → first-order motor (0.20 s) → forward speed and
yaw rate → pose, in steps of 2.5 ms that are integrated exactly (arcs of circles) or of 5 ms by Euler's rule. Driving
makes the pose walk at random; what is measured of it has heavy-tailed or coloured noise.
"""

from zlib import crc32

import numpy as np
import second_body as body
import second_drives as drives
import second_outside as outside
import second_wheels as wheels
from scipy.signal import lfilter
from second_cases import CLEAN, IN_FORM, LEVELS, OTHER_FORM, OUTSIDE, PAIRS, SHAPES, Case
from second_signals import BASELINE, FULL_SPEED, MOTOR_LAG, ROW_S, Array, Run, Table, lagging

from proxytune.logs import Log, LogEpisode

__all__ = ["CLEAN", "IN_FORM", "OTHER_FORM", "OUTSIDE", "PAIRS", "SHAPES", "Case", "driven", "make_log", "noisy"]

STEPS = {"exact": 20, "coarse": 10}
"""Steps per row of 50 ms."""

POSE_NOISE, COLOUR_S = (0.002, 0.002, 0.005), 0.15
"""Standard deviation of a measured pose [m], [m], [rad], and how long coloured noise remembers itself."""

PER_METRE, PER_RADIAN = (0.009, 0.002, 0.035), (0.001, 0.001, 0.02)
"""How far a pose has walked at random, forward, sideways and round, after a metre and after a radian: with √way."""

SENT: Table = {**wheels.SENT, **outside.SENT}
ARRIVED: Table = {**wheels.ARRIVED, **outside.ARRIVED}
DUTY: Table = {**wheels.DUTY, **outside.DUTY}
TARGET: Table = {**wheels.TARGET, **outside.TARGET}
MOTOR: Table = {**wheels.MOTOR, **outside.MOTOR}
WHEELS: Table = {**wheels.WHEELS, **outside.WHEELS}
TWIST: Table = {**body.TWIST, **outside.TWIST}
PLACES: Table = {**body.PLACES, **outside.PLACES}
TRACKED: Table = {**body.TRACKED, **outside.TRACKED}


def make_log(case: Case, *, episodes: int = 12, seconds: float = 60.0, noiseless: bool = False) -> Log:
    """What would have been measured of this robot, 20 rows per second, from rest."""
    course = drives.plan(case.seed, episodes, round(seconds / ROW_S))
    level = 0.0 if noiseless else LEVELS[case.noise.split()[0]]
    poses = _passed(TRACKED, case, driven(case, course, level))
    seen = poses + level * noisy(case, poses.shape)
    times = np.arange(poses.shape[1]) * ROW_S
    rows = (LogEpisode(f"{e:02d}", times, course.duties[e], seen[e], None) for e in range(episodes))
    return Log(case.name, "duckiebot", "duty", 1.0 / ROW_S, {}, tuple(rows))


def driven(case: Case, course: drives.Course, level: float) -> Array:
    """Poses (E, rows, 3) of the middle of the axle, with `level` times the normal random walk."""
    twists, run = twists_of(case, course.duties)
    twists = twists + level * _walk(case, twists)
    places = [(PLACES[name], figures) for name, figures in case.effects if name in PLACES]
    per_row = STEPS[case.integration]
    if not places:
        return _path(twists, course.starts, run)[:, ::per_row]
    poses = np.empty((len(twists), twists.shape[1] + 1, 3))
    poses[:, 0] = course.starts
    for step in range(twists.shape[1]):
        pose, twist = poses[:, step], twists[:, step]
        for effect, figures in places:
            twist = effect(twist, pose, step * run.step_s, **figures)
        poses[:, step + 1] = _moved(pose, twist, run)
    return poses[:, ::per_row]


def twists_of(case: Case, messages: Array) -> tuple[Array, Run]:
    """Forward, sideways speed [m/s] and yaw rate [rad/s] (E, T, 3) that the wheels ask for, and the run."""
    exact, step_s = case.integration == "exact", ROW_S / STEPS[case.integration]
    duties = _in_force(case, messages, step_s, exact)
    run = Run(_random(case, "wheels"), step_s, exact, duties)
    asked = _passed(TARGET, case, _passed(DUTY, case, duties, run) * (1.0 - case.trim, 1.0 + case.trim), run)
    motors = [name for name, _ in case.effects if name in MOTOR]
    turning = _passed(MOTOR, case, asked, run) if motors else lagging(asked, MOTOR_LAG, run)
    left, right = np.moveaxis(_passed(WHEELS, case, turning, run), -1, 0) * FULL_SPEED
    twists = np.stack(((left + right) / 2.0, np.zeros_like(left), (right - left) / BASELINE), axis=-1)
    return _passed(TWIST, case, twists, run), run


def noisy(case: Case, shape: tuple[int, ...]) -> Array:
    """Normal noise of measured poses: Student's t with 5 degrees of freedom, or half of it coloured."""
    random = _random(case, "tracker")
    if case.noise.split()[1] == "heavy":
        return random.standard_t(5, shape) / np.sqrt(5.0 / 3.0) * POSE_NOISE
    kept = np.exp(-ROW_S / COLOUR_S)
    long = (shape[0], shape[1] + 100, shape[2])
    coloured = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], random.standard_normal(long), axis=1)[:, 100:]
    return np.sqrt(0.5) * (coloured + random.standard_normal(shape)) * POSE_NOISE


def _passed(table: Table, case: Case, signal: Array, *run: Run) -> Array:
    for name, figures in case.effects:
        if name in table:
            signal = table[name](signal, *run, **figures)
    return signal


def _random(case: Case, what: str) -> np.random.Generator:
    return np.random.default_rng([case.seed, crc32(what.encode()), 2])


def _in_force(case: Case, messages: Array, step_s: float, exact: bool) -> Array:
    """The duty in force in each step (E, T, 2): that of the newest message which has arrived by its beginning."""
    episodes, rows, _ = messages.shape
    run = Run(_random(case, "messages"), ROW_S, exact, messages)
    sent = np.concatenate((np.zeros((episodes, 1, 2)), _passed(SENT, case, messages, run)), axis=1)
    arrival = _passed(ARRIVED, case, np.tile(np.arange(rows) * ROW_S + case.delay, (episodes, 1)), run)
    starts = np.arange(round((rows - 1) * ROW_S / step_s)) * step_s + 1e-9
    number = np.stack([np.searchsorted(own, starts, side="right") for own in arrival])
    return np.take_along_axis(sent, number[..., None], axis=1)


def _walk(case: Case, twists: Array) -> Array:
    """Twists (E, T, 3) of a random walk, held over each row, that grows with the way and the turn of the row."""
    per_row = STEPS[case.integration]
    ways = np.abs(twists).reshape(len(twists), -1, per_row, 3).mean(axis=2) * ROW_S
    size = np.sqrt(ways[..., :1] * np.square(PER_METRE) + ways[..., 2:] * np.square(PER_RADIAN)) / ROW_S
    return np.repeat(size * _random(case, "walk").standard_normal(size.shape), per_row, axis=1)


def _path(twists: Array, starts: Array, run: Run) -> Array:
    """Poses (E, T + 1, 3): arcs of circles, or Euler's rule."""
    turns = twists[..., 2] * run.step_s
    headings = starts[:, None, 2] + np.cumsum(turns, axis=1)
    chord = np.sinc(turns / (2.0 * np.pi)) * np.exp(-0.5j * turns) if run.exact else np.exp(-1j * turns)
    moved = (twists[..., 0] + 1j * twists[..., 1]) * chord * np.exp(1j * headings) * run.step_s
    places = (starts[:, :1] + 1j * starts[:, 1:2]) + np.cumsum(moved, axis=1)
    later = np.stack((places.real, places.imag, headings), axis=-1)
    return np.concatenate((starts[:, None], later), axis=1)


def _moved(pose: Array, twist: Array, run: Run) -> Array:
    """The same for one step (E, 3), the chord of its arc to a ten-thousandth of a millionth."""
    forward, aside, turn = (twist * run.step_s).T
    middle = pose[:, 2] + turn / 2.0 if run.exact else pose[:, 2]
    chord = 1.0 - turn**2 / 24.0 if run.exact else 1.0
    east, north = np.cos(middle) * chord, np.sin(middle) * chord
    return pose + np.stack((forward * east - aside * north, forward * north + aside * east, turn), axis=1)
