"""The multistep fit: parameters refitted to the multi-step prediction error; and the least error a model could have.

Single steps tell most where the model is right. Where it lacks something, parameters that are best for one step can be
poor over seconds: fitted to windows of prediction they make up for what they can. `fit_multistep` keeps such values
only if held-out windows show that they help. `noise_floor` is the error that the noise of measured poses alone makes,
with that noise from third differences of the residual path, E|Δ³|² = 20 σ² + 6 q · lag (`pose_noise`), and
`bullet_pose_errors` measures on the bullet plant what the planar plant found.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares, nnls
from scipy.stats import chi2

from proxytune.diagnosis.motion.drives import SEVERAL, Drives, Floats, Recent
from proxytune.diagnosis.motion.fitting import STEP, Fit, evaluate, sandwich_intervals
from proxytune.diagnosis.motion.innovations import (
    Coordinate,
    difference_quotient,
    increments,
    smooth_coordinates,
    spans,
    theta_at,
    tracked,
    twists_of,
    values_at,
)
from proxytune.diagnosis.motion.prediction import (
    Ratio,
    Windows,
    blocks_of,
    count_blocks,
    cut,
    measured_motion,
    pose_errors_along,
    predicted_motion,
    ratio_over,
    select_windows,
    squared_distances,
)
from proxytune.driving import BulletPlant, has_pybullet
from proxytune.space import Theta

HORIZONS_S = (1.0, 2.0, 5.0)
"""Horizons at which errors are compared."""
FITTED_S = (5.0, 2.0)
"""Windows of these lengths are fitted to."""
FOLDS = 4
"""Blocks are dealt out to so many folds; each is predicted by what was fitted to the others."""
ROBUST = 1.5
"""Misses beyond so many times the median count linearly."""
MOST_WINDOWS = 400
MOST_TRIALS = 20
"""A fit takes no more windows, and looks no more often: it stays within seconds on long logs."""


class MultistepFit(NamedTuple):
    """The result of fitting parameters to windows."""

    horizon_s: float  # length of the windows [s]
    ratios: Mapping[float, Ratio]  # held-out error of the new values by the old ones', by horizon [s]
    intervals: Mapping[str, tuple[float, float]]  # of what was fitted to windows, by name in θ


def horizons(drives: Drives) -> tuple[float, ...]:
    """List the horizons of which these drives have windows in enough blocks."""
    return tuple(h for h in HORIZONS_S if count_blocks(drives, cut(drives, h)) >= drives.rules.fewest_blocks)


def fit_windows(drives: Drives, theta: Theta, free: Sequence[Coordinate], windows: Windows) -> dict[str, float]:
    """Fit the free coordinates to windows, but those that change the motion by steps; long logs are thinned."""
    fitted = smooth_coordinates(free, drives.robot)
    if not fitted or len(windows.begin) == 0:
        return dict(theta)

    def make() -> Theta:
        every = -(-len(windows.begin) // MOST_WINDOWS)
        thinned = select_windows(windows, np.arange(len(windows.begin)) % every == 0)
        problem = _problem(drives, theta, fitted, thinned)
        found = least_squares(
            problem.residuals,
            problem.start,
            problem.jacobian,
            (0.0, 1.0),
            loss="soft_l1",
            f_scale=problem.scale,
            ftol=1e-6,
            max_nfev=MOST_TRIALS,
        )
        return problem.at(np.clip(found.x, 0.0, 1.0))

    asked = (tuple(theta.items()), fitted, windows.begin.tobytes(), hash(windows.increment.tobytes()))
    return dict(drives.remember("windows", asked, make, SEVERAL))


class _Problem(NamedTuple):
    """A least-squares problem in fractions of the coordinates' ranges: θ, residuals and their slopes there."""

    at: Callable[[Floats], dict[str, float]]
    residuals: Callable[[Floats], Floats]
    jacobian: Callable[..., Floats]
    start: Floats
    scale: float


def _problem(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], windows: Windows) -> _Problem:
    """The least-squares problem of these windows; a heading error counts as the way it makes over the median chord."""
    measured, recent = measured_motion(drives, windows), Recent[Floats]()
    weights = np.array((1.0, 1.0, max(float(np.median(np.hypot(*measured[:, :2].T))), 1e-3)))
    low, high = spans(free, drives)

    def at(fractions: Floats) -> dict[str, float]:
        return theta_at(theta, free, low + fractions * (high - low))

    def misses(values: Theta) -> Floats:
        def make() -> Floats:
            made = np.asarray(((predicted_motion(drives, values, windows) - measured) * weights).ravel())
            made.setflags(write=False)
            return made

        return recent.get(tuple(values.items()), make)

    def residuals(fractions: Floats) -> Floats:
        return misses(at(fractions))

    def jacobian(fractions: Floats, *, across_ticks: bool = False) -> Floats:
        here = at(fractions)
        columns = (difference_quotient(misses, drives, here, one, STEP, across_ticks=across_ticks) for one in free)
        return np.stack(list(columns), axis=1)

    start = np.clip((values_at(theta, free) - low) / (high - low), 1e-6, 1.0 - 1e-6)
    return _Problem(at, residuals, jacobian, start, max(1e-6, ROBUST * float(np.median(np.abs(residuals(start))))))


def held_out_squares(drives: Drives, theta: Theta, free: Sequence[Coordinate], fitted_s: float) -> dict[float, Floats]:
    """Squared distances of compared poses from measured ones [m²], by horizon [s], as fitted to other folds alone."""
    fold = np.asarray(drives.block % min(FOLDS, int(drives.block.max()) + 1))
    windows = cut(drives, fitted_s)
    asked = {horizon: cut(drives, horizon) for horizon in horizons(drives)}
    found = {horizon: np.zeros(len(one.increment)) for horizon, one in asked.items()}
    for own in range(fold.max() + 1):
        values = fit_windows(drives, theta, free, select_windows(windows, fold[windows.begin] != own))
        for horizon, one in asked.items():
            here = fold[one.begin] == own
            if here.any():
                found[horizon][here[one.window]] = squared_distances(drives, values, select_windows(one, here))
    return found


def compare_errors(drives: Drives, one: Mapping[float, Floats], other: Mapping[float, Floats]) -> dict[float, Ratio]:
    """Divide two errors over the same windows, by horizon [s]."""
    return {h: ratio_over(drives, cut(drives, h), squares, other[h]) for h, squares in one.items()}


def squared_errors(drives: Drives, theta: Theta) -> dict[float, Floats]:
    """Squared distances of a model's poses from measured ones [m²], by horizon [s]."""
    return {h: squared_distances(drives, theta, cut(drives, h)) for h in horizons(drives)}


def fit_multistep(fitted: Fit) -> tuple[Fit, MultistepFit | None]:
    """Fit the parameters to windows, and keep that if held-out windows show that it helps and nowhere harms."""
    drives = fitted.drives
    plain = squared_errors(drives, fitted.theta)
    best: tuple[float, float, dict[float, Ratio]] | None = None
    for length in [s for s in FITTED_S if s in plain]:
        ratios = compare_errors(drives, held_out_squares(drives, fitted.theta, fitted.free, length), plain)
        values = [one.value for one in ratios.values()]
        helps = min(values) < drives.rules.multistep_helps and max(values) <= drives.rules.multistep_harms
        if helps and (best is None or sum(values) < best[0]):
            best = (sum(values), length, ratios)
    if best is None:
        return fitted, None
    windows = cut(drives, best[1])
    theta = fit_windows(drives, fitted.theta, fitted.free, windows)
    # 95 % intervals come from the spread between blocks.
    free = smooth_coordinates(fitted.free, drives.robot)
    problem = _problem(drives, theta, free, windows)
    here = problem.start
    left, slopes, scale = problem.residuals(here), problem.jacobian(here, across_ticks=True), problem.scale
    gradient = slopes * (left / np.sqrt(1.0 + (left / scale) ** 2))[:, None]
    hessian = (slopes / (1.0 + (left / scale) ** 2)[:, None] ** 1.5).T @ slopes
    _, block = np.unique(np.repeat(blocks_of(drives, windows), 3), return_inverse=True)
    sums = np.stack([np.bincount(block, column) for column in gradient.T], axis=1)
    known = sandwich_intervals(theta, free, drives, sums, hessian)
    return evaluate(drives, theta, fitted.free, fitted.noise), MultistepFit(best[1], best[2], known)


LAGS = (1, 2, 3, 4, 6)
"""Third differences are taken over so many samples."""
NOISE_WEIGHT, WALK_WEIGHT = 20.0, 6.0
"""What third differences make of white noise and of a walk: 1² + 3² + 3² + 1², and of its steps 1² + 2² + 1²."""
CUT = 9.0
"""Squares beyond so many times the median are cut: motion that a model misses for a moment is not noise."""
FEWEST = 20
"""With fewer third differences a lag says nothing."""


class PoseNoise(NamedTuple):
    """White noise of measured poses, one standard deviation: of x and of y [m], of the heading [rad]."""

    place: float
    turn: float


def pose_noise(drives: Drives, theta: Theta) -> PoseNoise:
    """The noise of measured poses, from third differences of the path of what a model leaves over."""
    left = drives.measured - increments(drives, theta)
    heading = drives.poses[:, 0, 2]
    along = (left[:, 0] + 1j * left[:, 1]) * np.exp(1j * heading)
    steps = np.stack((along.real, along.imag, left[:, 2]), axis=1)
    # A model's slow errors, and a robot's drift, vanish in them or grow with the lag; a pose's noise does neither.
    differences = {lag: _third_differences(drives, steps, lag) for lag in LAGS}
    enough = {lag: rows for lag, rows in differences.items() if len(rows) >= FEWEST}
    return PoseNoise(_white(enough, slice(0, 2)), _white(enough, slice(2, 3)))


def _third_differences(drives: Drives, steps: Floats, lag: int) -> Floats:
    """Third differences of the path that these steps make, over runs of unbroken poses (rows, 3)."""
    path = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    start = np.arange(len(steps) - 3 * lag + 1)
    run = np.cumsum(~drives.linked)
    start = start[run[start] == run[start + 3 * lag - 1]]
    return np.asarray(path[start + 3 * lag] - 3.0 * path[start + 2 * lag] + 3.0 * path[start + lag] - path[start])


def _white(differences: dict[int, Floats], columns: slice) -> float:
    """The standard deviation of white noise in one coordinate: E|Δ³|² = 20 σ² + 6 q · lag, both fitted."""
    if not differences:
        return 0.0
    means = np.array([_mean_square(rows[:, columns]) for rows in differences.values()])
    terms = np.array([(NOISE_WEIGHT, WALK_WEIGHT * lag) for lag in differences])
    weights = 1.0 / np.maximum(means, 1e-18)
    (square, _), _ = nnls(terms * weights[:, None], means * weights)
    return float(np.sqrt(square))


def _mean_square(rows: Floats) -> float:
    """Mean square of a coordinate; large ones are cut, and what the cut takes from Gaussian ones is given back."""
    count = rows.shape[1]
    squares = (rows**2).sum(axis=1)
    limit = CUT * float(np.median(squares))
    end = CUT * float(chi2.ppf(0.5, count))
    kept = chi2.cdf(end, count + 2) + end / count * chi2.sf(end, count)
    return float(np.minimum(squares, limit).mean() / kept / count)


def noise_floor(drives: Drives, windows: Windows, noise: PoseNoise) -> tuple[float, float]:
    """The error that the noise of poses alone makes over windows: RMSE of position [m] and heading [rad]."""
    # Both ends of a motion are measured, each in x and y; the heading at its beginning turns all of it.
    chords = np.square(measured_motion(drives, windows)[:, :2]).sum(axis=1).mean()
    place = 4.0 * noise.place**2 + noise.turn**2 * chords
    return float(np.sqrt(place)), float(np.sqrt(2.0) * noise.turn)


def has_body(drives: Drives) -> bool:
    """Tell whether the bullet plant is installed and has a body for this robot."""
    return drives.robot.urdf is not None and has_pybullet()


def bullet_pose_errors(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """Measure errors of the bullet plant's poses (M, 2): distance [m], heading [rad]; episodes are driven in one go."""
    twists = twists_of(drives, theta)
    walked = np.zeros((len(twists), twists.shape[1] + 1, 3))
    for episode in np.unique(drives.episode):
        last = int(drives.last[drives.episode == episode].max())
        with BulletPlant(drives.robot, np.zeros(3), 1.0 / drives.tick_hz) as plant:
            walked[episode, 1 : last + 1], _ = plant.move(twists[episode, :last])
    return pose_errors_along(drives, tracked(drives, theta, walked), windows)
