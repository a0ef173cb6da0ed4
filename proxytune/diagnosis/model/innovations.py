"""From increments to white innovations: the filter of the pose error, as one banded Cholesky factor.

Every measured pose carries noise, and every metre driven adds some. An increment's error is its own drive noise plus
the pose noise of its two ends, which it shares with its neighbours. So the errors' covariance is block-tridiagonal, and
the whitened innovations of the Kalman filter that re-anchors the pose are L⁻¹e, L its Cholesky factor.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky_banded
from scipy.linalg.lapack import dtbtrs
from scipy.optimize import minimize

from proxytune.diagnosis.measured.drives import Drives, Floats

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

HUBER = 3.0
"""Innovations beyond so many standard deviations count linearly."""


@dataclass(frozen=True)
class Noise:
    """How far measured motion strays from a model that is right.

    Attributes:
        drive: Standard deviation after one metre: forward [m], sideways [m], heading [rad].
        pose: Standard deviation of a measured pose: position [m], heading [rad].
    """

    drive: tuple[float, float, float]
    pose: tuple[float, float]


FIRST_GUESS = Noise((0.02, 0.01, 0.1), (0.003, 0.01))


@dataclass(frozen=True)
class Whitener:
    """The Cholesky factor of the errors' covariance, lower banded (6, 3N)."""

    factor: Floats

    @property
    def log_determinant(self) -> Floats:
        """What each increment adds to log|S|/2 (N,)."""
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


def _parts(drives: Drives) -> Floats:
    """What a unit of each variance of a noise adds to the errors' covariance (5, 6 · 3N), in lower banded form."""
    return np.stack([_covariance(drives, unit) for unit in np.eye(5)])


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
    drive = variances[:3] * way[:, None] + 2.0 * np.array((place, place, turn))
    own[:, range(3), range(3)] += drive
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


def fit_noise(drives: Drives, errors: Floats, start: Noise) -> Noise:
    """The noise under which errors (N, 3) are likeliest, looked for from `start` and from FIRST_GUESS.

    A start from a model that misses much can end where all noise is too large. Of long drives a part is taken, the same
    for every model.
    """
    kept = _choose_part(len(errors))
    if not kept.all():
        drives, errors = drives.only(kept), errors[kept]
    found = [_fit_noise(drives, errors, noise) for noise in dict.fromkeys((start, FIRST_GUESS))]
    return min(found, key=lambda pair: pair[0])[1]


def _choose_part(count: int) -> NDArray[np.bool_]:
    """Runs of increments, spread evenly but in step with nothing that drives repeat."""
    # Multiples of the golden ratio are spread evenly whatever their number.
    number = np.arange(count) // RUN
    return np.asarray(number * 0.6180339887 % 1.0 < THINNED / max(count, 1))


def _fit_noise(drives: Drives, errors: Floats, start: Noise) -> tuple[float, Noise]:
    scale = np.concatenate((start.drive, start.pose))
    lowest, highest = np.log(SMALLEST / scale), np.log(LARGEST / scale)
    parts = _parts(drives)

    def surprise(logs: Floats) -> float:
        return -log_likelihood(errors, _factor(np.square(scale * np.exp(logs)) @ parts)) / len(errors)

    def with_slope(logs: Floats) -> tuple[float, Floats]:
        here, steps = surprise(logs), np.where(logs + STEP <= highest, STEP, -STEP)
        return here, np.array([surprise(moved) - here for moved in logs + np.diag(steps)]) / steps

    bounds = list(zip(lowest, highest, strict=True))
    found = minimize(
        with_slope, np.zeros(5), jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-9, "maxiter": 60}
    )
    values = (scale * np.exp(found.x)).tolist()
    return float(found.fun), Noise(tuple(values[:3]), tuple(values[3:]))
