"""Parameters fitted to windows of prediction, instead of to single steps.

Single steps tell most where the model is right. Where it lacks something, parameters that are best for one step can be
poor over seconds: fitted to windows they make up for what they can.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from proxytune.diagnosis.horizon.windows import (
    Ratio,
    Windows,
    blocks_of,
    cut,
    measured_motion,
    pose_errors,
    predicted_motion,
    ratio,
    select_windows,
)
from proxytune.diagnosis.measured.drives import Drives, Floats, Whole
from proxytune.diagnosis.measured.recent import Recent
from proxytune.diagnosis.model.coordinates import Coordinate, smooth_coordinates, span, theta_at
from proxytune.diagnosis.model.fitting import STEP, Fit, evaluate
from proxytune.diagnosis.rules import RULES
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


class Polish(NamedTuple):
    """The result of fitting parameters to windows.

    Attributes:
        horizon_s: Length of the windows [s].
        ratios: Held-out error of the new values by that of the old ones, by horizon [s].
        intervals: 95 % intervals of the new values, by name in θ; none of what was not fitted to windows.
    """

    horizon_s: float
    ratios: Mapping[float, Ratio]
    intervals: Mapping[str, tuple[float, float]]


def horizons(drives: Drives) -> tuple[float, ...]:
    """The horizons of which these drives have windows in enough blocks."""
    return tuple(h for h in HORIZONS_S if len(np.unique(drives.block[cut(drives, h).begin])) >= RULES.fewest_blocks)


def fit_windows(drives: Drives, theta: Theta, free: Sequence[Coordinate], windows: Windows) -> dict[str, float]:
    """Fit the free coordinates of θ to these windows: where the model misses their poses least.

    Args:
        drives: The measured drives.
        theta: Where to start.
        free: What is fitted, except where it changes the motion by steps: single steps tell that far more sharply.
        windows: Windows over the drives; long logs are thinned to MOST_WINDOWS of them.
    """
    fitted = smooth_coordinates(free, drives.robot)
    if not fitted or len(windows.begin) == 0:
        return dict(theta)
    problem = _problem(drives, theta, fitted, _thin(windows))
    found = least_squares(
        problem.left,
        problem.start,
        problem.slopes,
        (0.0, 1.0),
        loss="soft_l1",
        f_scale=problem.scale,
        ftol=1e-6,
        max_nfev=MOST_TRIALS,
    )
    return problem.at(np.clip(found.x, 0.0, 1.0))


class _Problem(NamedTuple):
    """A least-squares problem in fractions of the coordinates' ranges."""

    drives: Drives
    theta: Theta
    free: tuple[Coordinate, ...]
    windows: Windows
    measured: Floats
    weights: Floats
    misses: Recent[Floats]

    @property
    def start(self) -> Floats:
        low, high = np.array([span(coordinate, self.drives.robot) for coordinate in self.free]).T
        here = np.array([self.theta[coordinate[0]] for coordinate in self.free])
        return np.asarray(np.clip((here - low) / (high - low), 1e-6, 1.0 - 1e-6))

    @property
    def scale(self) -> float:
        return max(1e-6, ROBUST * float(np.median(np.abs(self.left(self.start)))))

    def at(self, fractions: Floats) -> dict[str, float]:
        low, high = np.array([span(coordinate, self.drives.robot) for coordinate in self.free]).T
        return theta_at(self.theta, self.free, low + fractions * (high - low))

    def left(self, fractions: Floats) -> Floats:
        return self.misses.get(fractions.tobytes(), lambda: self._misses(self.at(fractions)))

    def _misses(self, theta: Theta) -> Floats:
        apart = predicted_motion(self.drives, theta, self.windows) - self.measured
        misses = np.asarray((apart * self.weights).ravel())
        misses.setflags(write=False)
        return misses

    def slopes(self, fractions: Floats) -> Floats:
        here, columns = self.left(fractions), []
        for number in range(len(fractions)):
            step = STEP if fractions[number] + STEP <= 1.0 else -STEP
            moved = fractions.copy()
            moved[number] += step
            columns.append((self.left(moved) - here) / step)
        return np.stack(columns, axis=1)


def _problem(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], windows: Windows) -> _Problem:
    """The least-squares problem of these windows; a heading error counts as the way it makes over the median chord."""
    measured = measured_motion(drives, windows)
    chord = float(np.median(np.hypot(*measured[:, :2].T)))
    return _Problem(drives, theta, free, windows, measured, np.array((1.0, 1.0, max(chord, 1e-3))), Recent())


def _thin(windows: Windows) -> Windows:
    every = -(-len(windows.begin) // MOST_WINDOWS)
    return select_windows(windows, np.arange(len(windows.begin)) % every == 0)


def held_out_squares(drives: Drives, theta: Theta, free: Sequence[Coordinate], fitted_s: float) -> dict[float, Floats]:
    """Squared distance [m²] at every compared pose, by horizon [s].

    No pose is predicted by what was fitted to its own fold.

    Args:
        drives: The measured drives.
        theta: Where fits start.
        free: What is fitted.
        fitted_s: Length of the windows that are fitted to [s].
    """
    fold = _folds(drives)
    windows = cut(drives, fitted_s)
    asked = {horizon: cut(drives, horizon) for horizon in horizons(drives)}
    found = {horizon: np.zeros(len(one.increment)) for horizon, one in asked.items()}
    for own in range(fold.max() + 1):
        values = fit_windows(drives, theta, free, select_windows(windows, fold[windows.begin] != own))
        for horizon, one in asked.items():
            here = fold[one.begin] == own
            if here.any():
                found[horizon][here[one.window]] = pose_errors(drives, values, select_windows(one, here))[:, 0] ** 2
    return found


def _folds(drives: Drives) -> Whole:
    """The fold of each increment (N,)."""
    return np.asarray(drives.block % min(FOLDS, int(drives.block.max()) + 1))


def compare_errors(drives: Drives, one: Mapping[float, Floats], other: Mapping[float, Floats]) -> dict[float, Ratio]:
    """The ratio of two errors over the same windows, by horizon [s]."""
    return {h: ratio(squares, other[h], blocks_of(drives, cut(drives, h))) for h, squares in one.items()}


def polish_fit(fitted: Fit) -> tuple[Fit, Polish | None]:
    """Fit the parameters to windows, and keep that if held-out windows show that it helps and nowhere harms."""
    drives = fitted.drives
    plain = {h: pose_errors(drives, fitted.theta, cut(drives, h))[:, 0] ** 2 for h in horizons(drives)}
    best: tuple[float, float, dict[float, Ratio]] | None = None
    for length in [s for s in FITTED_S if s in plain]:
        ratios = compare_errors(drives, held_out_squares(drives, fitted.theta, fitted.free, length), plain)
        values = [one.value for one in ratios.values()]
        helps = min(values) < RULES.polish_helps and max(values) <= RULES.polish_harms
        if helps and (best is None or sum(values) < best[0]):
            best = (sum(values), length, ratios)
    if best is None:
        return fitted, None
    windows = cut(drives, best[1])
    theta = fit_windows(drives, fitted.theta, fitted.free, windows)
    polish = Polish(best[1], best[2], _intervals(drives, theta, smooth_coordinates(fitted.free, drives.robot), windows))
    return evaluate(drives, theta, fitted.free, fitted.noise), polish


def _intervals(
    drives: Drives, theta: Theta, free: tuple[Coordinate, ...], windows: Windows
) -> dict[str, tuple[float, float]]:
    """95 % intervals from the spread between blocks (sandwich)."""
    problem = _problem(drives, theta, free, windows)
    here = problem.start
    left, slopes, scale = problem.left(here), problem.slopes(here), problem.scale
    pull = slopes * (left / np.sqrt(1.0 + (left / scale) ** 2))[:, None]
    curve = (slopes / (1.0 + (left / scale) ** 2)[:, None] ** 1.5).T @ slopes
    _, block = np.unique(np.repeat(blocks_of(drives, windows), 3), return_inverse=True)
    pulls = np.stack([np.bincount(block, column) for column in pull.T], axis=1)
    inverse = np.linalg.pinv(curve, hermitian=True)
    spread = inverse @ (pulls.T @ pulls) @ inverse * len(pulls) / max(1, len(pulls) - len(free))
    found: dict[str, tuple[float, float]] = {}
    for coordinate, variance in zip(free, np.diag(spread), strict=True):
        low, high = span(coordinate, drives.robot)
        half = 1.96 * float(np.sqrt(variance)) * (high - low)
        found |= {name: (max(low, theta[name] - half), min(high, theta[name] + half)) for name in coordinate}
    return found
