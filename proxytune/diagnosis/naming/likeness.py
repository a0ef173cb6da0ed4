"""Are all drives of one robot, on one floor? Each wheel's gain, as every drive alone would have it."""

import math
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.measured.drives import Drives, Floats, sum_by
from proxytune.diagnosis.model.coordinates import Coordinate, span
from proxytune.diagnosis.model.fitting import KEPT_SOLVABLE, Fit, evaluate, slopes
from proxytune.diagnosis.model.innovations import HUBER, clip_outliers
from proxytune.diagnosis.rules import RULES

GAINS: tuple[Coordinate, ...] = (("wheel_gain.left",), ("wheel_gain.right",))


AT_ONCE = 100_000
"""About so many increments are looked at together: what is computed of each takes a kilobyte."""


class Unlike(NamedTuple):
    """Drives that fall in two groups.

    Attributes:
        wheel: "left" or "right", whichever tells them apart better.
        gains: Mean gain of that wheel in either group.
        groups: Numbers of the drives in either group.
    """

    wheel: str
    gains: tuple[float, float]
    groups: tuple[tuple[int, ...], tuple[int, ...]]


def two_robots(drives: Drives, model: Fit) -> Unlike | None:
    """The two groups that drives fall in by a wheel's gain, None where they are all alike.

    Effects of one robot that a model lacks spread the drives' gains too, but do not leave a gap between two groups.
    """
    episodes = np.unique(drives.episode)
    if len(episodes) < 2 * RULES.robot_drives:
        return None
    batches = np.array_split(episodes, math.ceil(len(drives.episode) / AT_ONCE))
    gains, deviations = np.concatenate([_own_gains(drives.some(batch), model) for batch in batches], axis=1)
    found = [_groups(episodes, gains[:, side], deviations[:, side]) for side in range(2)]
    clearest, side = max(((clear, side) for side, (clear, _) in enumerate(found)), key=lambda pair: pair[0])
    if clearest < 1.0:
        return None
    groups = found[side][1]
    means = [float(gains[np.isin(episodes, group), side].mean()) for group in groups]
    return Unlike(("left", "right")[side], (means[0], means[1]), groups)


def _own_gains(drives: Drives, model: Fit) -> tuple[Floats, Floats]:
    """Each drive's own gains and their deviations (E, 2): one Newton step from the gains of all."""
    neutral = {name: model.theta.get(name, 1.0) for (name,) in GAINS}
    whole, count = evaluate(drives, {**model.theta, **neutral}, (), model.noise), len(drives.duties)
    columns = slopes(drives, whole.theta, GAINS, whole.whiten)
    label = np.repeat(drives.episode, 3)
    z = whole.innovations
    pull = sum_by(label, columns * clip_outliers(z)[:, None], count)
    inner = columns * (np.abs(z) < HUBER)[:, None]
    curve = sum_by(label, columns[:, :, None] * inner[:, None, :], count) + KEPT_SOLVABLE * np.eye(2)
    loud = np.maximum(1.0, sum_by(label, clip_outliers(z) ** 2, count) / np.bincount(label))
    inverse = np.linalg.inv(curve)
    step = -np.einsum("eij,ej->ei", inverse, pull)
    low, high = np.array([span(coordinate, drives.robot) for coordinate in GAINS]).T
    here = np.array([whole.theta[name] for (name,) in GAINS])
    variances = np.diagonal(inverse, axis1=1, axis2=2) * loud[:, None]
    return here + step * (high - low), np.sqrt(variances) * (high - low)


def _groups(
    episodes: Floats, gains: Floats, deviations: Floats
) -> tuple[float, tuple[tuple[int, ...], tuple[int, ...]]]:
    """How clearly drives fall in two groups at the widest gap between sorted gains, 1 where just so; and the groups."""
    sure = np.flatnonzero(deviations < RULES.robot_gain_apart)
    order = sure[np.argsort(gains[sure])]
    least = max(RULES.robot_drives, math.ceil(RULES.robot_share * len(order)))
    places = np.arange(least, len(order) - least + 1)
    if not len(places):
        return 0.0, ((), ())
    sorted_gains = gains[order]
    at = int(places[np.argmax(sorted_gains[places] - sorted_gains[places - 1])])
    gap = float(sorted_gains[at] - sorted_gains[at - 1])
    within = max(float(sorted_gains[:at].std(ddof=1)), float(sorted_gains[at:].std(ddof=1)))
    unsure = max(within, float(np.median(deviations[order])))
    clear = gap / max(RULES.robot_gain_apart, RULES.robot_gap * unsure)
    one, other = (tuple(sorted(int(e) for e in episodes[part])) for part in (order[:at], order[at:]))
    return clear, (one, other)
