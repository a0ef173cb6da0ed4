"""The likelihood of θ: how well it explains the target's outputs, given Gaussian processes of every output.

An output is an agent's mean of a metric. PRPV is a count and jumps; the metrics that it compares change smoothly with
θ. Each output has a Gaussian process of its own, all with one kernel (Matérn 5/2, a length scale per parameter, one
share of noise for what no smooth function follows), fitted to the trials that have every output. How far an output's
predictions are off when trials are left out one at a time scales its variance, so an output that the kernel does not
suit is trusted less.

With y_k the target's outputs, m_k(θ) and v_k(θ) the predicted mean and variance (roughness and placement noise
included), z_k = (y_k − m_k) / √v_k, and Student's distribution of ν = 4 degrees of freedom,

    log L(θ) = −(1/κ) Σ_k [ (ν + 1)/2 · log(1 + z_k²/ν) + ½ log v_k ]

Outputs of one trial go up and down together (an agent that crashes early drives less far), and so do their errors.
Taken for independent they would promise far too much: on simulated targets whose θ was known, a 95 % region then held
it in 3 to 6 of 12 cases. The log likelihood is therefore tempered by κ, which follows from how errors of left-out
trials correlate: with p outputs that are all one, κ is p.

Where trials of a cheaper proxy are known too, the Gaussian processes are of the difference to what those predict
(Kennedy and O'Hagan, Predicting the output from a complex computer code when fast approximations are available,
Biometrika 87(1), 2000, with a scale of 1). Trials left out then say how far that can be trusted.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats, one_thread
from proxytune.errors import RunError
from proxytune.search.loop import Goal, Trial
from proxytune.search.surrogate import most_probable, prior_kernel, unit_array
from proxytune.space import Space

if TYPE_CHECKING:
    from sklearn.gaussian_process.kernels import Kernel

# Loading scikit-learn takes longer than all else that a figure needs, so it waits for the first fit.

Rows = NDArray[np.intp]

PRIOR_TRIALS = 4.0
"""The kernel's own variance of an output counts as so many trials beside those left out."""
MOST_FOR_KERNEL = 128
"""At most so many trials, spread over the box, tell the kernel: its few numbers need no more; time is their cube."""
FEWEST = 3
"""Trials that must know an output for it to be modelled."""


@dataclass(frozen=True, eq=False)
class OutputGroup:
    """Outputs (columns) known at the same trials (rows), and so sharing all that depends on these alone.

    The kernel's matrix at these, in the unit cube, has the inverse; weights (trials, columns) are that times the
    outputs, standardised by their middle and scale.
    """

    columns: Rows
    rows: Rows
    visited: Floats
    inverse: Floats
    weights: Floats
    middle: Floats
    scale: Floats

    def mean(self, near: Floats) -> Floats:
        """The outputs (n, columns) at points whose covariance with the trials is (n, trials)."""
        return np.asarray(self.middle + self.scale * (near @ self.weights))

    @cached_property
    def left_out(self) -> Floats:
        """Errors of predicting each trial from the others, in the kernel's standard deviations, (trials, columns)."""
        return np.asarray(self.weights / np.sqrt(np.diag(self.inverse))[:, None])

    @cached_property
    def inflation(self) -> Floats:
        """The factor by which the kernel's variance of each output is to be multiplied."""
        return np.asarray((PRIOR_TRIALS + (self.left_out**2).sum(axis=0)) / (PRIOR_TRIALS + len(self.visited)))


@dataclass(frozen=True, eq=False)
class OutputModel:
    """The posterior of every output given the finished trials, in groups by where they are known.

    The kernel is the covariance of a standardised output over the unit cube: its smooth course, and noise round that.
    `constant` is each output's mean over the trials that know it (outputs,), NaN where none does; `visited` are all
    trials that know any (trials, parameters). With a `base`, of a cheaper proxy, groups are of the difference to it.
    """

    space: Space
    kernel: "Kernel"
    groups: tuple[OutputGroup, ...]
    constant: Floats
    visited: Floats
    base: "OutputModel | None" = None

    @property
    def outputs(self) -> int:
        """The number of outputs; those in no group do not change, or are known too seldom."""
        return len(self.constant)

    @property
    def roughness(self) -> float:
        """Variance of a standardised output round its smooth course."""
        return float(self.kernel.k2.noise_level)

    @cached_property
    def modelled(self) -> Rows:
        """The outputs that are modelled, in rising order."""
        return np.sort(np.concatenate([np.empty(0, dtype=np.intp), *(group.columns for group in self.groups)]))

    def predict(self, points: Floats) -> tuple[Floats, Floats]:
        """Mean and variance (n, outputs) of every output's smooth course at points of the cube; NaN if not modelled."""
        mean, variance = (np.full((len(points), self.outputs), np.nan) for _ in range(2))
        smooth = self.kernel.k1
        with one_thread():
            for group in self.groups:
                near = smooth(points, group.visited)
                left = smooth.diag(points) - np.einsum("ij,jk,ik->i", near, group.inverse, near, optimize=True)
                mean[:, group.columns] = group.mean(near)
                variance[:, group.columns] = np.outer(np.maximum(left, 0.0), group.inflation * group.scale**2)
        return (mean + self.base.course(points) if self.base else mean), variance

    def course(self, points: Floats) -> Floats:
        """The mean of every output (n, outputs) at points of the cube; 0 if it is not modelled."""
        mean = np.zeros((len(points), self.outputs))
        with one_thread():
            for group in self.groups:
                mean[:, group.columns] = group.mean(self.kernel.k1(points, group.visited))
        return mean

    @cached_property
    def left_out(self) -> Floats:
        """Errors of predicting each trial from the others, in deviations as predicted (trials, outputs), or NaN."""
        found = np.full((len(self.visited), self.outputs), np.nan)
        for group in self.groups:
            found[np.ix_(group.rows, group.columns)] = group.left_out / np.sqrt(group.inflation)
        return found

    @cached_property
    def rough(self) -> Floats:
        """Variance of one trial's output round the smooth course, shape (outputs,)."""
        found = np.full(self.outputs, np.nan)
        for group in self.groups:
            found[group.columns] = self.roughness * group.inflation * group.scale**2
        return found


def fit_outputs(space: Space, trials: Sequence[Trial], kernel: "Kernel | None" = None) -> OutputModel:
    """Fit the model to the trials that have outputs: same trials in any order, same model to the last bit.

    Without a kernel, it is fitted too. Refused if no trial of this proxy has an outcome.
    """
    with_outcome = [(t.low_fidelity, (t.values, t.outcome, t.placement)) for t in trials if t.outcome is not None]
    known, low = (sorted(one for cheap, one in with_outcome if cheap == wanted) for wanted in (False, True))
    if not known:
        raise RunError("no trial has an outcome, so there is nothing to learn from")
    return _fitted(space, known, kernel, _base(space, tuple(low)) if low else None)


Known = tuple[tuple[float, ...], tuple[float, ...], int]
"""Where a trial was, what it came to, and under which placement."""


@lru_cache(maxsize=8)
def _base(space: Space, known: tuple[Known, ...]) -> OutputModel:
    """The model of a cheaper proxy, the same all through a search."""
    return _fitted(space, known, None, None)


def _fitted(space: Space, known: Sequence[Known], kernel: "Kernel | None", base: OutputModel | None) -> OutputModel:
    visited, outputs = unit_array(space, [one[0] for one in known]), np.array([one[1] for one in known])
    placement, seen = np.array([one[2] for one in known]), ~np.isnan(outputs)
    with np.errstate(invalid="ignore"):
        constant = np.where(seen, outputs, 0.0).sum(axis=0) / seen.sum(axis=0)
    outputs = outputs - base.course(visited) if base else outputs
    with one_thread():
        kernel = kernel or _fitted_kernel(visited, outputs)
        groups = _groups(kernel, visited, outputs, placement)
    return OutputModel(space, kernel, groups, constant, visited, base)


def _fitted_kernel(visited: Floats, outputs: Floats) -> "Kernel":
    """The kernel of highest posterior density given the trials that have every output, or the most of them."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor

    columns = _worth_modelling(outputs)
    whole = ~np.isnan(outputs[:, columns]).any(axis=1)
    if whole.sum() < FEWEST or not columns.size:
        return prior_kernel(visited.shape[1])
    standardised = outputs[np.ix_(whole, columns)]
    spread = standardised.std(axis=0)
    chosen = standardised[:, spread > 0.0]
    if not chosen.size:
        return prior_kernel(visited.shape[1])
    rows = np.unique(np.linspace(0, len(chosen) - 1, MOST_FOR_KERNEL).round().astype(int))
    model = GaussianProcessRegressor(prior_kernel(visited.shape[1]), optimizer=most_probable)
    with warnings.catch_warnings():
        # A hyperparameter at its bound is an answer, not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(visited[whole][rows], ((chosen - chosen.mean(axis=0)) / chosen.std(axis=0))[rows])
    return model.kernel_


def _worth_modelling(outputs: Floats) -> Rows:
    """The outputs that are known often enough, and change by more than rounding."""
    seen = ~np.isnan(outputs)
    often = seen.sum(axis=0) >= FEWEST
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # outputs that no trial knows
        changes = np.nanmax(outputs, axis=0) - np.nanmin(outputs, axis=0)
        largest = np.nanmax(np.abs(outputs), axis=0)
    return np.flatnonzero(often & (np.nan_to_num(changes) > 1e-9 * np.nan_to_num(largest)))


def _groups(kernel: "Kernel", visited: Floats, outputs: Floats, placement: Rows) -> tuple[OutputGroup, ...]:
    by_rows: dict[bytes, list[int]] = {}
    seen = ~np.isnan(outputs)
    for column in _worth_modelling(outputs):
        by_rows.setdefault(seen[:, column].tobytes(), []).append(int(column))
    return tuple(_group(kernel, visited, outputs, placement, np.array(columns)) for columns in by_rows.values())


def _group(kernel: "Kernel", visited: Floats, outputs: Floats, placement: Rows, columns: Rows) -> OutputGroup:
    rows = ~np.isnan(outputs[:, columns[0]])
    known = outputs[np.ix_(rows, columns)]
    middle, scale = known.mean(axis=0), known.std(axis=0)
    matrix, placed = kernel(visited[rows]), placement[rows]
    if np.ptp(placed):
        # What a placement does to an output all trials share that were driven under it; roughness is much the same.
        matrix += kernel.k2.noise_level * (placed[:, None] == placed)
    inverse = np.linalg.inv(matrix)
    weights = inverse @ ((known - middle) / scale)
    return OutputGroup(columns, np.flatnonzero(rows), visited[rows], inverse, weights, middle, scale)


FREEDOM = 4.0
"""Degrees of freedom of Student's distribution: an output that is far off counts for less than a normal's would."""
LEAST_NOISE = 1e-6
"""Of an output's variance over the trials: without any, a deterministic target would be a spike."""


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The tempered log likelihood of the target's outputs given θ."""

    model: OutputModel
    goal: Goal

    @cached_property
    def columns(self) -> Rows:
        """The outputs that are modelled and known of the target."""
        modelled = self.model.modelled
        return modelled[~np.isnan(self.goal.values[modelled])]

    @cached_property
    def kappa(self) -> float:
        """The divisor of the log likelihood, at least 1."""
        return temper(self.model.left_out[:, self.columns])

    def standardised(self, points: Floats) -> tuple[Floats, Floats]:
        """The distance of the target from predictions (n, columns) in deviations, and their variance in units."""
        mean, variance = self.model.predict(points)
        chosen = self.columns
        least = LEAST_NOISE * self.model.rough[chosen] / self.model.roughness
        total = variance[:, chosen] + self.model.rough[chosen] + self.goal.noise[chosen] + least
        return (self.goal.values[chosen] - mean[:, chosen]) / np.sqrt(total), total

    def log(self, points: Floats) -> Floats:
        """The tempered log likelihood (n,) at points (n, parameters) of the unit cube, up to a constant."""
        distance, variance = self.standardised(points)
        against = deviance(distance) + 0.5 * np.log(variance)
        return np.asarray(-against.sum(axis=1) / self.kappa)


def deviance(distance: Floats) -> Floats:
    """Student's negative log density, up to a constant, of distances in standard deviations; 0 where there is none."""
    return np.asarray(0.5 * (FREEDOM + 1.0) * np.log1p(distance**2 / FREEDOM))


def temper(errors: Floats) -> float:
    """κ: how many outputs count as one, by the correlation of the errors of left-out trials (trials, outputs).

    With C the correlations of p outputs, κ = 1 + Σ_{j≠k} (C_jk² − 1/n_jk) / p, at least 1: n_jk trials know both, and
    two independent outputs correlate with a mean square of 1/n_jk by chance. Errors are NaN where a trial does not
    know.
    """
    known = ~np.isnan(errors)
    filled = np.where(known, errors, 0.0)
    size: Floats = np.sqrt((filled**2).sum(axis=0) / known.sum(axis=0))
    both = known.astype(float).T @ known
    filled = filled / np.where(size > 0.0, size, 1.0)
    excess = ((filled.T @ filled) ** 2 / np.maximum(both, 1.0) - 1.0) / np.maximum(both, 1.0)
    np.fill_diagonal(excess, 0.0)
    columns: int = errors.shape[1]
    return 1.0 + max(0.0, float(np.sum(excess))) / max(1, columns)
