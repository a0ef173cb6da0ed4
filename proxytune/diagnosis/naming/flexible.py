"""The flexible judge: how much of what is left any curve over one signal can explain."""

from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.measured.drives import Floats
from proxytune.diagnosis.model.fitting import (
    Fit,
    held_out_innovations,
    held_out_log_likelihood,
    replace_noise,
    slopes_by_block,
)
from proxytune.diagnosis.model.innovations import fit_noise, huber
from proxytune.diagnosis.model.replay import increments, increments_of_twists, twists_of
from proxytune.diagnosis.naming.signals import SignalGroup, signal_groups

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


def fit_curves(fitted: Fit) -> list[Curve]:
    """Every signal group fitted to what the model leaves over, best first.

    The best few are fitted again with the noise that they leave: a candidate's noise is fitted too.
    """
    plain = float(held_out_log_likelihood(fitted).sum())
    found = [_fit_curve(fitted, group, _columns(fitted, group), plain) for group in signal_groups(fitted)]
    found.sort(key=lambda curve: -curve.gain)
    promising = [curve for curve in found[:REFITTED] if curve.gain > 0.0]
    again = [_fit_with_own_noise(fitted, curve, plain) for curve in promising]
    return sorted(again + found[len(promising) :], key=lambda curve: -curve.gain)


def _fit_with_own_noise(fitted: Fit, curve: Curve, plain: float) -> Curve:
    changes = _columns(fitted, curve.group)
    left = fitted.drives.measured - increments(fitted.drives, fitted.theta) + changes @ curve.weights
    quieter = replace_noise(fitted, fit_noise(fitted.drives, left, fitted.noise))
    better = _fit_curve(quieter, curve.group, changes, plain)
    return better if better.gain > curve.gain else curve


def _fit_curve(fitted: Fit, group: SignalGroup, changes: Floats, plain: float) -> Curve:
    columns = fitted.whiten.whiten(changes)
    both = np.concatenate((fitted.slopes, columns), axis=1)
    size = np.sqrt((both**2).sum(axis=0)) + 1e-12
    unit = both / size
    sums = slopes_by_block(fitted, unit)
    flexible = np.arange(both.shape[1]) >= fitted.slopes.shape[1]
    fits = [_ridge(fitted, unit, sums, flexible * ridge) for ridge in RIDGES]
    gain, weights = max(fits, key=lambda found: found[0])
    return Curve(group, gain - plain, (weights / size)[flexible])


def _columns(fitted: Fit, group: SignalGroup) -> Floats:
    """Change of the errors per weight of each basis function (N, 3, columns)."""
    drives, theta = fitted.drives, fitted.theta
    twists = twists_of(drives, theta)
    here = increments_of_twists(drives, theta, twists)
    added = group.twists
    parts = (added[..., column] for column in range(added.shape[-1]))
    return np.stack([here - increments_of_twists(drives, theta, twists + part) for part in parts], axis=-1)


def _ridge(fitted: Fit, unit: Floats, sums: tuple[Floats, Floats], ridge: Floats) -> tuple[float, Floats]:
    """The predictive log-likelihood with a ridge on each weight, and the weights."""
    penalty = np.diag(ridge + 1e-9)
    pull, curve = sums
    weights = -np.linalg.solve(curve.sum(axis=0) + penalty, pull.sum(axis=0))
    loss = huber(held_out_innovations(fitted, unit, sums, penalty)).sum() + fitted.whiten.log_determinant.sum()
    return -float(loss), weights
