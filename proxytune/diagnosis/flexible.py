"""The flexible judge: how much of what is left any curve over one signal can explain."""

from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.drives import Floats
from proxytune.diagnosis.fitting import Fit, by_block, predictive, renoised
from proxytune.diagnosis.innovations import HUBER, clipped, fit_noise, huber
from proxytune.diagnosis.replay import disturbed, increments
from proxytune.diagnosis.signals import SignalGroup, signal_groups

RIDGES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""Pulls towards no curve at all that are tried, as fractions of what a basis function's weight is held by."""

REFITTED = 3
"""How many groups are fitted again."""


class Curve(NamedTuple):
    """What a signal group explains.

    Attributes:
        group: The group.
        gain: Its gain in log-likelihood on blocks that it was not fitted to [nats].
        weights: Weight of each of its basis functions.
    """

    group: SignalGroup
    gain: float
    weights: Floats


def curves(fitted: Fit) -> list[Curve]:
    """Every signal group fitted to what the model leaves over, best first.

    The best few are fitted again with the noise that they leave: a candidate's noise is fitted too.
    """
    plain = float(predictive(fitted).sum())
    found = [_curve(fitted, group, _columns(fitted, group), plain) for group in signal_groups(fitted)]
    found.sort(key=lambda curve: -curve.gain)
    promising = [curve for curve in found[:REFITTED] if curve.gain > 0.0]
    again = [_with_own_noise(fitted, curve, plain) for curve in promising]
    return sorted(again + found[len(promising) :], key=lambda curve: -curve.gain)


def _with_own_noise(fitted: Fit, curve: Curve, plain: float) -> Curve:
    changes = _columns(fitted, curve.group)
    left = fitted.drives.measured - increments(fitted.drives, fitted.theta) + changes @ curve.weights
    quieter = renoised(fitted, fit_noise(fitted.drives, left, fitted.noise))
    better = _curve(quieter, curve.group, changes, plain)
    return better if better.gain > curve.gain else curve


def _curve(fitted: Fit, group: SignalGroup, changes: Floats, plain: float) -> Curve:
    columns = fitted.whiten.whiten(changes)
    both = np.concatenate((fitted.slopes, columns), axis=1)
    fits = [_ridge(fitted, both, columns.shape[1], ridge) for ridge in RIDGES]
    gain, weights = max(fits, key=lambda found: found[0])
    return Curve(group, gain - plain, weights)


def _columns(fitted: Fit, group: SignalGroup) -> Floats:
    """Change of the errors per weight of each basis function (N, 3, columns)."""
    here = increments(fitted.drives, fitted.theta)
    parts = np.moveaxis(group.twists, -1, 0)
    return np.stack([here - disturbed(fitted.drives, fitted.theta, twist) for twist in parts], axis=-1)


def _ridge(fitted: Fit, both: Floats, flexible: int, ridge: float) -> tuple[float, Floats]:
    """The predictive log-likelihood with a ridge on the flexible weights, and those weights."""
    z = fitted.innovations
    inner = (np.abs(z) < HUBER)[:, None]
    scale = np.concatenate((np.zeros(both.shape[1] - flexible), np.ones(flexible)))
    size = np.sqrt((both**2).sum(axis=0)) + 1e-12
    unit = both / size
    penalty = np.diag(scale * ridge + 1e-9)
    pull = by_block(fitted.drives, unit * clipped(z)[:, None])
    curve = _blockwise(fitted, unit, unit * inner)
    weights = -np.linalg.solve(curve.sum(axis=0) + penalty, pull.sum(axis=0))
    left_out = -np.linalg.solve(curve.sum(axis=0) - curve + penalty, (pull.sum(axis=0) - pull)[:, :, None])[:, :, 0]
    shifted = z + np.einsum("nc,nc->n", unit, np.repeat(left_out[fitted.drives.block], 3, axis=0))
    loss = huber(shifted).sum() + fitted.whiten.log_determinant.sum()
    return -float(loss), (weights / size)[-flexible:]


def _blockwise(fitted: Fit, left: Floats, right: Floats) -> Floats:
    """leftᵀ right over the innovations of each block (blocks, columns, columns)."""
    label = np.repeat(fitted.drives.block, 3)
    blocks = range(int(label.max()) + 1)
    return np.stack([left[label == b].T @ right[label == b] for b in blocks])
