"""Innovations: a model's increments by replay, whitened by a Kalman filter in SE(2).

Every measured pose carries noise, and every metre driven adds some. An increment's error is its own drive noise plus
the pose noise of its two ends, which it shares with its neighbours. So the errors' covariance is block-tridiagonal, and
the whitened innovations of the Kalman filter that re-anchors the pose are z = L⁻¹e, with S = LLᵀ one banded Cholesky
factor, and the log-likelihood is −Σ huber(z) − ½ log|S|, which `fit_noise` maximises over drive and pose noise.

The increments e is taken from come by replay of the recorded commands: through the effects of a model to wheel speeds
and twists, dead-reckoned by the planar plant over whole batches of drives (`increments`, `paths`, `window_paths`).
A coordinate of a fit is one or several parameters of θ that share a value, within their range.
"""

import functools
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cholesky_banded
from scipy.linalg.lapack import dtbtrs
from scipy.optimize import minimize

from proxytune.arrays import compiled_loops
from proxytune.diagnosis.motion.drives import Drives, Floats, Whole, relative, rows_at
from proxytune.driving import Drivetrain, Robot, drivetrain
from proxytune.effects import (
    CATALOGUE,
    PARAMETERS,
    Chain,
    Draws,
    FilterContext,
    Learnt,
    LearntCommands,
    Stage,
    effect_of,
    effects_from,
    stage_chain,
)
from proxytune.space import Theta

BAND = 6
"""Rows of a lower banded matrix with two blocks of three side by side."""
TURN_WEIGHT = 0.1
"""A radian turned adds as much noise as this many metres driven."""
JITTER = np.array((1e-5, 1e-5, 1e-5)) ** 2
"""Smallest variance of an increment [m², m², rad²]: keeps noise-free logs solvable."""
THINNED = 2400
RUN = 12
"""Noise is fitted to about so many increments, in runs of so many: more hardly sharpen five values, and cost most."""
SMALLEST, LARGEST = 1e-6, 3.0
"""Noise lies between these, each value in its own unit."""
STEP = 1e-4
"""Finite differences step by this in the logarithm of a value of the noise."""
SMALLEST_TURN = 1e-300
"""A smaller turn within a tick [rad] is none: a quarter of it might be 0. Lags leave such turns after minutes."""
SMALL_DUTY = 0.02
"""What a unit of a learnt curve adds to commands is replayed with so much of it."""
HUBER = 3.0
"""Innovations beyond so many standard deviations count linearly."""


@dataclass(frozen=True)
class Noise:
    """The scatter of measured motion about a model that is right."""

    drive: tuple[float, float, float]  # standard deviation after one metre: forward [m], sideways [m], heading [rad]
    pose: tuple[float, float]  # standard deviation of a measured pose: position [m], heading [rad]


FIRST_GUESS = Noise((0.02, 0.01, 0.1), (0.003, 0.01))


@dataclass(frozen=True)
class Whitener:
    """The Cholesky factor of the errors' covariance, lower banded (6, 3N)."""

    factor: Floats

    @property
    def log_determinant(self) -> Floats:
        """The share of each increment in log|S|/2 (N,)."""
        return np.asarray(np.log(self.factor[0]).reshape(-1, 3).sum(axis=1))

    def whiten(self, errors: Floats) -> Floats:
        """Errors (N, 3) or (N, 3, columns) as innovations, (3N,) or (3N, columns)."""
        flat = errors.reshape(self.factor.shape[1], *errors.shape[2:])
        solved, trouble = dtbtrs(self.factor, flat if flat.ndim == 2 else flat[:, None], uplo="L")
        if trouble:
            raise LinAlgError("the covariance of the errors is singular")
        return np.asarray(solved if flat.ndim == 2 else solved[:, 0])

    def colour(self, innovations: Floats) -> Floats:
        """Innovations (3N,) back to errors (N, 3)."""
        coloured = np.zeros(len(innovations))
        for below, row in enumerate(self.factor):
            size = len(innovations) - below
            coloured[below:] += row[:size] * innovations[:size]
        return coloured.reshape(-1, 3)


def whitener(drives: Drives, noise: Noise) -> Whitener:
    """The whitener of these drives under this noise."""
    return _factor(_covariance(drives, np.square((*noise.drive, *noise.pose))))


def _factor(covariance: Floats) -> Whitener:
    """The whitener of errors with this covariance, in lower banded form (6 · 3N)."""
    band = covariance.reshape(BAND, -1)
    band.reshape(BAND, -1, 3)[0] += JITTER
    return Whitener(cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False))


def _covariance(drives: Drives, variances: Floats) -> Floats:
    """The errors' covariance in lower banded form (6 · 3N), linear in the variances of drive and pose noise."""
    own, shared = _blocks(drives, variances)
    band = np.zeros((BAND, len(own), 3))
    for column in range(3):
        for row in range(column, 3):
            band[row - column, :, column] = own[:, row, column]
        for row in range(3):
            band[3 + row - column, :-1, column] = shared[1:, row, column]
    return band.reshape(-1)


def _blocks(drives: Drives, variances: Floats) -> tuple[Floats, Floats]:
    """Each increment's own covariance, and that with the increment before it, (N, 3, 3) each."""
    place, turn = variances[3:]
    measured = drives.measured
    lever = np.stack((measured[:, 1], -measured[:, 0]), axis=1)
    way = drives.travel[:, 0] + TURN_WEIGHT * drives.travel[:, 1]
    own = np.zeros((len(lever), 3, 3))
    own[:, :2, :2] = turn * lever[:, :, None] * lever[:, None, :]
    own[:, :2, 2] = own[:, 2, :2] = -turn * lever
    own[:, range(3), range(3)] += variances[:3] * way[:, None] + 2.0 * np.array((place, place, turn))
    shared = np.zeros_like(own)
    back = np.roll(measured[:, 2], 1)
    cosine, sine = np.cos(back), np.sin(back)
    shared[:, :2, :2] = -place * np.stack((cosine, sine, -sine, cosine), axis=1).reshape(-1, 2, 2)
    shared[:, :2, 2] = turn * lever
    shared[:, 2, 2] = -turn
    return own, shared * drives.linked[:, None, None]


def huber(innovations: Floats) -> Floats:
    """The loss of each innovation: half its square, linear beyond HUBER."""
    size = np.abs(innovations)
    inner = np.minimum(size, HUBER)
    return np.asarray(inner * (size - 0.5 * inner))


def clip_outliers(innovations: Floats) -> Floats:
    """The slope of the loss: innovations, with outliers cut to HUBER."""
    return np.clip(innovations, -HUBER, HUBER)


def log_likelihood(errors: Floats, whiten: Whitener) -> float:
    """The log-likelihood of errors (N, 3), up to a constant."""
    return -float(huber(whiten.whiten(errors)).sum() + np.log(whiten.factor[0]).sum())


@functools.cache
def _by_numba() -> ModuleType | None:
    """The inner loops, compiled: a diagnosis pays for loading them many times over, a prediction would not."""
    return compiled_loops("proxytune.diagnosis.motion.compiled")


def fit_noise(drives: Drives, errors: Floats, start: Noise) -> Noise:
    """The noise under which errors (N, 3) are likeliest, looked for from `start` and from FIRST_GUESS."""
    # Multiples of the golden ratio spread runs evenly whatever their number, in step with nothing that drives repeat.
    number = np.arange(len(errors)) // RUN
    kept = np.asarray(number * 0.6180339887 % 1.0 < THINNED / max(len(errors), 1))
    if not kept.all():
        drives, errors = drives.only(kept), errors[kept]
    parts = np.stack([_covariance(drives, unit) for unit in np.eye(5)])
    # A start from a model that misses much can end where all noise is too large.
    found = [_fit_noise(parts, errors, noise) for noise in dict.fromkeys((start, FIRST_GUESS))]
    return min(found, key=lambda pair: pair[0])[1]


def _fit_noise(parts: Floats, errors: Floats, start: Noise) -> tuple[float, Noise]:
    """The same from one start, and what it loses; `parts` are what each variance of 1 adds to the covariance."""
    scale = np.concatenate((start.drive, start.pose))
    lowest, highest = np.log(SMALLEST / scale), np.log(LARGEST / scale)
    compiled = _by_numba()

    def with_slope(logs: Floats) -> tuple[float, Floats]:
        steps = np.where(logs + STEP <= highest, STEP, -STEP)
        covariances = np.square(scale * np.exp(logs + np.vstack((np.zeros(5), np.diag(steps))))) @ parts
        if compiled:
            bands = covariances.reshape(len(covariances), BAND, -1, 3)
            bands[:, 0] += JITTER
            losses = [compiled.loss(band, errors, HUBER) for band in bands]
        else:
            losses = [-log_likelihood(errors, _factor(covariance)) for covariance in covariances]
        here, *moved = np.array(losses) / len(errors)
        return here, (moved - here) / steps

    bounds = list(zip(lowest, highest, strict=True))
    found = minimize(
        with_slope, np.zeros(5), jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-9, "maxiter": 60}
    )
    values = (scale * np.exp(found.x)).tolist()
    return float(found.fun), Noise(tuple(values[:3]), tuple(values[3:]))


def integrate_twists(twists: Floats, tick_s: float) -> Floats:
    """Dead-reckon planar poses (…, time + 1, 3) from body twists held for a tick each; headings are unwrapped.

    They are those of the planar plant but for rounding. Episodes are driven by the plant itself: they stay what they
    were to the last bit. The compiled way gives the same bits: it is taken once noise has been fitted.
    """
    if _by_numba.cache_info().currsize and (compiled := _by_numba()):
        return np.asarray(compiled.walk(twists, tick_s))
    poses = np.zeros((*twists.shape[:-2], twists.shape[-2] + 1, 3))
    turns = twists[..., 2] * tick_s
    headings = turns.cumsum(axis=-1)
    turns[np.abs(turns) <= SMALLEST_TURN] = np.finfo(float).eps
    # Tangents of half the angles, for numpy has a fast tangent: cos α = (1 − t²)/(1 + t²), sin α = 2t/(1 + t²).
    middle, quarter = np.tan(0.5 * headings - 0.25 * turns), np.tan(0.25 * turns)
    square = middle * middle
    chord = 4.0 * tick_s * quarter / ((1.0 + quarter * quarter) * (1.0 + square) * turns)
    forward, cosine, sine = twists[..., 0] * chord, 1.0 - square, 2.0 * middle
    x, y = forward * cosine, forward * sine
    if twists[..., 1].any():
        sideways = twists[..., 1] * chord
        x, y = x - sideways * sine, y + sideways * cosine
    for channel, way in enumerate((x, y)):
        way.cumsum(axis=-1, out=poses[..., 1:, channel])
    poses[..., 1:, 2] = headings
    return poses


RANDOM_EFFECTS: Mapping[str, Draws] = {
    name: effect.trace.draws for name, effect in CATALOGUE.items() if effect.trace and effect.trace.draws
}
"""Effects that draw, each of one parameter; to first order they make commands late by their mean lateness."""


def lateness(theta: Theta, rate_hz: float) -> float:
    """Mean time by which random effects delay commands [s], at this many commands per second."""
    drawn = ((draws, theta.get(name, 0.0)) for name, draws in RANDOM_EFFECTS.items())
    return sum((draws.lateness(value, rate_hz).mean_s for draws, value in drawn if value > 0.0), 0.0)


def expected_theta(theta: Theta, rate_hz: float) -> dict[str, float]:
    """θ without random effects, their mean lateness added to the delay."""
    late = lateness(theta, rate_hz)
    calm = {name: value for name, value in theta.items() if name not in RANDOM_EFFECTS}
    if late > 0.0:
        calm["delay"] = min(PARAMETERS["delay"].high, calm.get("delay", 0.0) + late)
    return calm


def paths(drives: Drives, theta: Theta, duties: Floats | None = None) -> Floats:
    """The measured poses that a model expects from the origin (E, T + 1, 3), each episode in one go."""
    return tracked_paths(drives, theta, twists_of(drives, theta, duties))


def twists_of(drives: Drives, theta: Theta, duties: Floats | None = None) -> Floats:
    """The motion that a model asks of the plant, tick by tick (E, T, 3): [m/s], [m/s], [rad/s]."""
    train, _ = _model(drives, theta)
    if duties is not None:
        return np.asarray(train.apply(duties, train.begin(_setting(drives)))[0])
    begun = train.motion.begin(_motion_setting(drives, train))
    return np.asarray(train.motion.apply(train.ideal(wheel_speeds(drives, theta)), begun)[0])


def arrived_commands(drives: Drives, theta: Theta) -> Floats:
    """The commands that reach the motors (E, T, 2): many models differ in what comes after that."""
    command = _model(drives, theta)[0].command

    def make() -> Floats:
        return np.asarray(command.apply(drives.duties, command.begin(_setting(drives)))[0])

    return drives.remember("arrived", _values(command), make)


def wheel_speeds(drives: Drives, theta: Theta) -> Floats:
    """The wheel speeds of a model (E, T, 2), as fractions of full speed; read only."""
    train, _ = _model(drives, theta)

    def make() -> Floats:
        wheels = _turned(drives, train, arrived_commands(drives, theta))
        wheels.setflags(write=False)
        return wheels

    return drives.remember("wheels", (_values(train.command), _values(train.actuation)), make)


def _turned(drives: Drives, train: Drivetrain, arrived: Floats) -> Floats:
    """The wheel speeds (E, T, 2) that commands which reached the motors make."""
    memory = train.actuation.begin(_setting(drives))
    return np.asarray(train.actuation.apply(train.within_range(arrived), memory)[0])


def _values(chain: Chain) -> Hashable:
    """What a chain does, in numbers: effects of users need not be hashable, and what was learnt has no parameters."""
    return tuple(
        one if isinstance(one, LearntCommands) else (type(one), *(getattr(one, given.name) for given in one.parameters))
        for one in chain.effects
    )


def increments(drives: Drives, theta: Theta) -> Floats:
    """The motion between the measured poses (N, 3): forward, left [m], turn [rad], in the body frame; read only."""

    def make() -> Floats:
        made = increments_along(drives, paths(drives, theta))
        made.setflags(write=False)
        return made

    return drives.remember("increments", tuple(theta.items()), make)


def increments_along(drives: Drives, walked: Floats) -> Floats:
    """The increments of paths (E, T + 1, 3) between the measured poses."""
    every = np.arange(len(drives.episode))
    begins, ends = (drives.along(walked, drives.episode, every, end=end) for end in (False, True))
    return relative(begins, ends)


def increments_of_twists(drives: Drives, theta: Theta, twists: Floats) -> Floats:
    """The increments that these twists of every tick (E, T, 3) make, as a model's tracker sees them."""
    return increments_along(drives, tracked_paths(drives, theta, twists))


def disturbed_increments(drives: Drives, theta: Theta, extra: Floats) -> Floats:
    """The increments when something adds to the twist of every tick (E, T, 3)."""
    return increments_of_twists(drives, theta, twists_of(drives, theta) + extra)


def window_paths(drives: Drives, theta: Theta, begin: Whole, length: int) -> Floats:
    """Measured poses from windows' beginnings on, each from the origin (W, length + 1, 3).

    A window starts from the measured pose, and from measured wheel speeds where there are any. The commands before it
    count; nothing measured after it does. Commands after an episode's end are those at its end.
    """
    return tracked_paths(drives, theta, window_twists(drives, theta, begin, length))


def window_twists(drives: Drives, theta: Theta, begin: Whole, length: int, added: Floats | None = None) -> Floats:
    """The motion asked of the plant in such windows (W, length, 3), with what is `added` to commands (E, T, 2)."""
    train, _ = _model(drives, theta)
    whole, wheels = _window_wheels(drives, theta, begin, length, added)
    if not train.motion.effects:
        return train.ideal(wheels)
    settings = _window_setting(drives, begin), _motion_setting(drives, train)
    past = train.motion.begin_amid(*settings, train.ideal(whole), drives.episode[begin], drives.first[begin])
    return np.asarray(train.motion.apply(train.ideal(wheels), past)[0])


def _window_wheels(
    drives: Drives, theta: Theta, begin: Whole, length: int, added: Floats | None
) -> tuple[Floats, Floats]:
    """Wheel speeds in whole drives (E, T, 2), and in windows (W, length, 2), there from measured ones on if any are."""
    train, _ = _model(drives, theta)
    if added is None:
        whole = wheel_speeds(drives, theta)
    else:
        whole = _turned(drives, train, arrived_commands(drives, theta) + added)
    episode, start = drives.episode[begin], drives.first[begin]
    ticks = np.minimum(start[:, None] + np.arange(length), whole.shape[1] - 1)
    modelled = rows_at(whole, episode[:, None], ticks)
    lags: list[Any] = [effect for effect in train.actuation.effects if effect.name == "motor_lag"]
    if drives.wheels is None or not lags:
        return whole, modelled
    # What else a drivetrain recalls, its heat, its play, its battery, is the model's; the lag forgets a difference.
    before = np.where(start[:, None] > 0, whole[episode, start - 1], drives.rest[episode])
    off = replace(_setting(drives), rest=drives.wheels[episode, start] - (before + modelled[:, 0]) / 2.0)
    return whole, modelled + lags[0].apply(np.zeros_like(modelled), lags[0].begin(off))[0]


LearntMotion = list[tuple[Floats, Floats]]
"""What weights of a curve add: features (W, length, knots), and the twist (3,) of one unit of them, part by part."""


def window_features(drives: Drives, theta: Theta, learnt: Learnt, begin: Whole, length: int) -> Iterator[LearntMotion]:
    """Motion that each weight of a learnt effect beside a model adds in such windows, those over commands last."""
    whole, asked = twists_of(drives, theta), window_twists(drives, theta, begin, length)
    settings = _window_setting(drives, begin), _motion_setting(drives, _model(drives, theta)[0])
    past = learnt.recall(*settings, whole, drives.episode[begin], drives.first[begin])
    yield from ([one] for one in learnt.features(asked, past))
    # Every weight over commands is a replay of the drives.
    arrived, before = arrived_commands(drives, theta), learnt.commands.begin(_setting(drives))
    for features in learnt.commands.features(arrived, before):
        moved = np.empty((3, features.shape[-1], *asked.shape[:2]))
        for number, column in enumerate(np.moveaxis(features, -1, 0)):
            twists = window_twists(drives, theta, begin, length, SMALL_DUTY * column)
            np.divide(np.moveaxis(twists - asked, -1, 0), SMALL_DUTY, out=moved[:, number])
        yield [(np.moveaxis(part, 0, -1), unit) for part, unit in zip(moved, np.eye(3), strict=True)]


def tracked_paths(drives: Drives, theta: Theta, twists: Floats) -> Floats:
    """Measured poses, from the origin on, that twists lead to (W, length + 1, 3)."""
    return tracked(drives, theta, integrate_twists(twists, 1.0 / drives.tick_hz))


def tracked(drives: Drives, theta: Theta, walked: Floats) -> Floats:
    """Paths (…, 3) as a model's tracker sees them."""
    _, measurement = _model(drives, theta)
    if not measurement.effects:
        return walked
    rest = replace(_setting(drives), rest=walked[:, 0])
    return np.asarray(measurement.apply(walked, measurement.begin(rest))[0])


def _motion_setting(drives: Drives, train: Drivetrain) -> FilterContext:
    """The setting of motion effects in whole drives."""
    return replace(_setting(drives), rest=train.resting_twist(_setting(drives)))


def _window_setting(drives: Drives, begin: Whole) -> FilterContext:
    """The setting of motion effects in windows: the place where each begins, and the angles of its wheels."""
    episode, start = drives.episode[begin], drives.first[begin]
    return replace(
        _setting(drives),
        rest=np.zeros((len(begin), 3)),
        headings=drives.poses[begin, 0, 2:],
        places=drives.poses[begin, :1, :2],
        angles=drives.angles[episode, start][:, None],
    )


def drawn_wheel_speeds(drives: Drives, theta: Theta, seed: int) -> Floats:
    """The wheel speeds (E, T, 2) with random effects as one seed draws them, instead of as expected."""
    train, _ = _chains(drives, {**drives.robot.theta, **theta})
    memory = train.begin(replace(_setting(drives), seed=seed))
    arrived, _ = train.command.apply(drives.duties, memory.command)
    return np.asarray(train.actuation.apply(train.within_range(arrived), memory.actuation)[0])


def drawn_paths(drives: Drives, theta: Theta, seed: int) -> Floats:
    """The paths (E, T + 1, 3) with random effects as one seed draws them, instead of as expected."""
    train, _ = _chains(drives, {**drives.robot.theta, **theta})
    twists, _ = train.apply(drives.duties, train.begin(replace(_setting(drives), seed=seed)))
    return tracked_paths(drives, theta, np.asarray(twists))


def _model(drives: Drives, theta: Theta) -> tuple[Drivetrain, Chain]:
    """A model's drivetrain and its tracker, what is drawn in it as expected."""

    def make() -> tuple[Drivetrain, Chain]:
        return _chains(drives, expected_theta({**drives.robot.theta, **theta}, drives.rate_hz))

    return drives.remember("model", tuple(theta.items()), make)


def _chains(drives: Drives, theta: Theta) -> tuple[Drivetrain, Chain]:
    effects = effects_from(theta, drives.robot.figures, drives.robot.catalogue)
    return drivetrain(drives.robot, effects), stage_chain(effects, Stage.MEASUREMENT)


def _setting(drives: Drives) -> FilterContext:
    nominal: Mapping[str, float] = {**drives.robot.figures, "control_rate": drives.rate_hz}
    setting = FilterContext(drives.tick_hz, drives.rest, nominal)
    return replace(setting, headings=drives.headings, places=drives.places, angles=drives.angles)


Coordinate = tuple[str, ...]
"""Parameters of θ that share one value."""


def span(coordinate: Coordinate, drives: Drives) -> tuple[float, float]:
    """Lowest and highest value that is looked for of a coordinate."""
    name = coordinate[0]
    return drives.ranges.get(name) or drives.robot.catalogue.parameters[name].usual_range


def spans(free: Sequence[Coordinate], drives: Drives) -> Floats:
    """Lowest and highest values that are looked for (2, coordinates)."""
    return np.reshape([span(coordinate, drives) for coordinate in free], (-1, 2)).T


def values_at(theta: Theta, free: Sequence[Coordinate]) -> Floats:
    """The values that θ has of free coordinates (coordinates,)."""
    return np.array([theta[name] for name, *_ in free])


def theta_at(theta: Theta, free: Sequence[Coordinate], values: Sequence[float] | Floats) -> dict[str, float]:
    """θ with its free coordinates at these values."""
    given = {name: float(value) for names, value in zip(free, values, strict=True) for name in names}
    return {**theta, **given}


def difference_quotient(
    function: Callable[[Theta], Floats],
    drives: Drives,
    theta: Theta,
    coordinate: Coordinate,
    share: float,
    *,
    across_ticks: bool = False,
) -> Floats:
    """Differentiate a function of θ by a coordinate, as a fraction of its range, of which it is moved by a `share`.

    The loss has a kink at every tick in times by which commands are late: the slope `across_ticks` is that over one
    either way.
    """
    here, (low, high) = theta[coordinate[0]], span(coordinate, drives)
    if across_ticks and is_lateness(coordinate, drives.robot):
        below, above = max(low, here - 1.0 / drives.tick_hz), min(high, here + 1.0 / drives.tick_hz)
    else:
        # Downwards where the range ends: a function may remember what it gave at θ itself.
        above = here + share * (high - low)
        below, above = (here, above) if above <= high else (here - share * (high - low), here)
    lower, upper = (theta_at(theta, (coordinate,), (value,)) for value in (below, above))
    return (function(upper) - function(lower)) * ((high - low) / (above - below))


def is_lateness(coordinate: Coordinate, robot: Robot) -> bool:
    """Tell whether a coordinate is a time by which commands are late."""
    effect, parameter = robot.catalogue.effect(effect_of(coordinate[0])), robot.catalogue.parameters[coordinate[0]]
    return effect.stage is Stage.COMMAND and parameter.unit == "s"


def at_edge(name: str, value: float, drives: Drives) -> bool:
    """Tell whether a value lies at an end of its parameter's range where it does something.

    It does nothing where it is neutral, or, of what a robot has by its nominal figures, at 0.
    """
    parameter = drives.robot.catalogue.parameters[name]
    harmless = (parameter.neutral_value(drives.robot.figures), *((0.0,) if isinstance(parameter.neutral, str) else ()))
    return drives.rules.at_end(value, span((name,), drives), *harmless)


def widened(drives: Drives, theta: Theta, free: Sequence[Coordinate]) -> Drives:
    """The drives with ranges twice as wide where a value lies at an end of one, as far as physics allows."""
    ranges = dict(drives.ranges)
    for name in (name for names in free for name in names if at_edge(name, theta[name], drives)):
        parameter, (low, high) = drives.robot.catalogue.parameters[name], span((name,), drives)
        size, lower = high - low, theta[name] < 0.5 * (low + high)
        ends = (max(parameter.low, low - size), high) if lower else (low, min(parameter.high, high + size))
        if ends != (low, high):
            ranges[name] = ends
    return drives if ranges == drives.ranges else replace(drives, ranges=ranges)


def is_stepwise(coordinate: Coordinate, robot: Robot) -> bool:
    """Tell whether a coordinate changes the motion by steps: no slope leads to its best value, which is scanned for."""
    trace = robot.catalogue.effect(effect_of(coordinate[0])).trace
    return trace is not None and trace.stepwise


def smooth_coordinates(free: Sequence[Coordinate], robot: Robot) -> tuple[Coordinate, ...]:
    """The coordinates that change the motion smoothly, so that a slope leads to their best values."""
    return tuple(coordinate for coordinate in free if not is_stepwise(coordinate, robot))
