"""Models that are learnt from drives: of accelerations (PySINDy), and of what the fitted textbook model leaves over.

Each function takes a case and the textbook model fitted to it, and gives forward speeds [m/s] and yaw rates [rad/s]
(T - 1, 2) of every held-out drive.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from missing_effects.cases import Array, Case, Drive
from missing_effects.models import Fitted, error, in_force, measured_twists, twists

MEASURED_OVER = 4
"""Rows over which a speed is measured: of fewer, noise of the poses is most of it."""

SEED = 1
FASTEST = 3.0
"""A learnt model is held to so many times the greatest speed measured."""


def accelerations_by_pysindy(case: Case, fitted: Fitted) -> list[Array]:
    """SINDy with control: dv/dt and dω/dt as sparse polynomials of v, ω and the commands in force.

    The threshold is the best of four on every third drive; then all drives are fitted.
    """
    delay = fitted.figures["delay"]
    signals = [_signals(case, drive, delay) for drive in case.drives]
    kept = [one for number, one in enumerate(signals) if number % 3 != 2]
    tried = {}
    for threshold in (0.01, 0.03, 0.1, 0.3):
        model = _sindy(kept, case.drives[0].row_s, threshold)
        said = _rolled(case, model, case.drives[2::3], delay, _limit(signals))
        tried[threshold] = error(said, case.drives[2::3])
    best = _sindy(signals, case.drives[0].row_s, min(tried, key=lambda one: tried[one]))
    return _rolled(case, best, case.held_out, delay, _limit(signals))


def _signals(case: Case, drive: Drive, delay: float) -> tuple[Array, Array]:
    """Measured speeds and commands in force at the same rows, each over MEASURED_OVER rows."""
    speeds = measured_twists(drive, MEASURED_OVER)
    known = np.isfinite(speeds).all(axis=1)
    rows = np.arange(len(speeds))
    filled = np.stack([np.interp(rows, rows[known], column[known]) for column in speeds.T], axis=1)
    return filled, _averaged(in_force(case.robot, delay, drive))


def _limit(signals: list[tuple[Array, Array]]) -> Array:
    return FASTEST * np.max([np.abs(speeds).max(axis=0) for speeds, _ in signals], axis=0)


def _sindy(signals: list[tuple[Array, Array]], row_s: float, threshold: float) -> Any:
    import pysindy

    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=threshold, alpha=0.05),
        feature_library=pysindy.PolynomialLibrary(degree=2),
        differentiation_method=pysindy.SmoothedFiniteDifference(),
    )
    speeds, commands = map(list, zip(*signals, strict=True))
    return model.fit(speeds, t=row_s, u=commands)


def _rolled(case: Case, model: Any, drives: tuple[Drive, ...], delay: float, limit: Array) -> list[Array]:
    """Speeds from rest, all drives side by side, by the midpoint rule.

    The polynomials are evaluated here: `model.predict` takes milliseconds a call, and there is one for every row.
    """
    commands, slopes = np.stack([in_force(case.robot, delay, drive) for drive in drives]), model.coefficients().T
    speeds, row_s = np.zeros((len(drives), 2)), drives[0].row_s
    means = np.empty_like(commands)
    for row in range(commands.shape[1]):
        means[:, row] = np.clip(speeds + row_s / 2.0 * (quadratic(speeds, commands[:, row]) @ slopes), -limit, limit)
        speeds = np.clip(speeds + row_s * (quadratic(means[:, row], commands[:, row]) @ slopes), -limit, limit)
    return list(means)


def quadratic(speeds: Array, commands: Array) -> Array:
    """The terms (E, 15) of PolynomialLibrary(degree=2), in its order."""
    both = np.concatenate((speeds, commands), axis=1)
    first, second = np.triu_indices(both.shape[1])
    return np.concatenate((np.ones((len(both), 1)), both, both[:, first] * both[:, second]), axis=1)


def residual_by_gplearn(case: Case, fitted: Fitted) -> list[Array]:
    """Symbolic regression of what is left over of v and ω."""

    def learn(seen: Array, left: Array) -> Callable[[Array], Array]:
        from gplearn.genetic import SymbolicRegressor

        programs = [
            SymbolicRegressor(
                population_size=500,
                generations=15,
                function_set=("add", "sub", "mul", "div", "abs", "max", "min"),
                parsimony_coefficient=0.001,
                random_state=SEED,
            ).fit(*_some(seen, column, 1200))
            for column in left.T
        ]
        return lambda features: np.stack([program.predict(features) for program in programs], axis=1)

    return _with_residual(case, fitted, learn)


def residual_by_gaussian_process(case: Case, fitted: Fitted) -> list[Array]:
    """A Gaussian process of what is left over of v and ω, each with length scales of its own, and its noise."""

    def learn(seen: Array, left: Array) -> Callable[[Array], Array]:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

        kernel = RBF(np.ones(seen.shape[1]), (0.1, 100.0)) * ConstantKernel(1.0) + WhiteKernel(1.0)
        both = [GaussianProcessRegressor(kernel, random_state=SEED).fit(*_some(seen, column, 500)) for column in left.T]
        return lambda features: np.stack([one.predict(features) for one in both], axis=1)

    return _with_residual(case, fitted, learn)


def residual_by_neural_network(case: Case, fitted: Fitted) -> list[Array]:
    """A network of two layers of 32 of what is left over of v and ω, stopped early."""

    def learn(seen: Array, left: Array) -> Callable[[Array], Array]:
        from sklearn.neural_network import MLPRegressor

        network = MLPRegressor(
            hidden_layer_sizes=(32, 32), alpha=1e-3, early_stopping=True, max_iter=200, random_state=SEED
        )
        found: Callable[[Array], Array] = network.fit(seen, left).predict
        return found

    return _with_residual(case, fitted, learn)


def _with_residual(
    case: Case, fitted: Fitted, learn: Callable[[Array, Array], Callable[[Array], Array]]
) -> list[Array]:
    """The textbook model, and what a learner says that it leaves over; both ends are scaled for the learner."""
    seen, left = [], []
    for drive in case.drives:
        model = twists(case.robot, fitted.figures, drive)
        apart = measured_twists(drive, MEASURED_OVER) - _averaged(model)
        known = np.isfinite(apart).all(axis=1)
        known[np.arange(len(known)) % MEASURED_OVER > 0] = False
        seen.append(_averaged(_features(case, fitted, drive, model))[known])
        left.append(apart[known])
    inputs, outputs = np.concatenate(seen), np.concatenate(left)
    middle, width, size = inputs.mean(axis=0), inputs.std(axis=0) + 1e-9, outputs.std(axis=0)
    predict = learn((inputs - middle) / width, outputs / size)
    answers = []
    for drive in case.held_out:
        model = twists(case.robot, fitted.figures, drive)
        answers.append(model + size * predict((_features(case, fitted, drive, model) - middle) / width))
    return answers


def _features(case: Case, fitted: Fitted, drive: Drive, model: Array) -> Array:
    """What a residual may depend on (T - 1, 5): the model's speeds, the commands in force, and time since the start."""
    times = (drive.times[:-1] - drive.times[0])[:, None]
    return np.concatenate((model, in_force(case.robot, fitted.figures["delay"], drive), times), axis=1)


def _averaged(rows: Array) -> Array:
    """Means over the next MEASURED_OVER rows."""
    sums = np.concatenate((np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)))
    return (sums[MEASURED_OVER:] - sums[:-MEASURED_OVER]) / MEASURED_OVER


def _some(seen: Array, left: Array, count: int) -> tuple[Array, Array]:
    """So many rows, drawn at random."""
    rows = np.random.default_rng(SEED).permutation(len(seen))[:count]
    return seen[rows], left[rows]
