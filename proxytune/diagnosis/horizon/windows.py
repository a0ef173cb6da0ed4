"""Windows of prediction: the errors of a model that starts each window from the measured pose."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student
from scipy.stats import wilcoxon

from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, relative
from proxytune.diagnosis.model.replay import window_paths
from proxytune.diagnosis.rules import RULES
from proxytune.space import Theta

SHORTEST = 0.9
"""Windows that cover less of the horizon are left out: poses seldom end exactly at it, but a stub is no window."""


AT_ONCE = 300_000
"""About so many ticks of episodes are replayed together: memory is not to grow with the number of drives."""


class Windows(NamedTuple):
    """Windows (W,) over measured increments, and the increments in them (M,).

    Attributes:
        begin: The increment at whose beginning each window starts (W,).
        window: The window of each entry (M,).
        increment: The increment whose end is compared (M,).
    """

    begin: Whole
    window: Whole
    increment: Whole


def cut(drives: Drives, horizon_s: float) -> Windows:
    """Cut drives into windows one after another, each within an unbroken run of poses."""
    ticks = horizon_s * drives.tick_hz
    run = np.cumsum(~drives.linked) - 1
    start = drives.first[np.flatnonzero(~drives.linked)][run]
    number = np.ceil((drives.last - start) / ticks - 1e-9).astype(int) - 1
    _, label = np.unique(run * (number.max() + 1) + number, return_inverse=True)
    begin = np.flatnonzero(np.concatenate(([True], label[1:] != label[:-1])))
    covered = np.maximum.reduceat(drives.last, begin) - drives.first[begin]
    long = covered >= SHORTEST * ticks - 1e-9
    return select_windows(Windows(begin, label, np.arange(len(label))), long)


def select_windows(windows: Windows, kept: NDArray[np.bool_]) -> Windows:
    """Keep some of the windows (W,), renumbered."""
    entries = kept[windows.window]
    renumbered = np.cumsum(kept) - 1
    return Windows(windows.begin[kept], renumbered[windows.window[entries]], windows.increment[entries])


def blocks_of(drives: Drives, windows: Windows) -> Whole:
    """The block that each compared pose belongs to (M,)."""
    return np.asarray(drives.block[windows.begin][windows.window])


def pose_differences(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """The model's motion since each window's beginning less the measured one (M, 3): [m], [m], [rad]."""
    return predicted_motion(drives, theta, windows) - measured_motion(drives, windows)


def predicted_motion(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """The model's motion since each window's beginning (M, 3): [m], [m], [rad]."""
    return np.concatenate([_replayed(some, theta, own) for some, own in _batches(drives, windows)])


def _replayed(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    return motion_in(drives, window_paths(drives, theta, windows.begin, length_of(drives, windows)), windows)


def _batches(drives: Drives, windows: Windows) -> Iterator[tuple[Drives, Windows]]:
    """Windows of a few episodes at a time, with the drives that they are cut from; of few drives all at once."""
    episodes, ticks = drives.duties.shape[:2]
    count = max(1, AT_ONCE // ticks)
    if count >= episodes:
        yield drives, windows
        return
    for first in range(0, episodes, count):
        some = np.arange(first, min(first + count, episodes))
        own = select_windows(windows, np.isin(drives.episode[windows.begin], some))
        if len(own.begin):
            before = int(np.searchsorted(drives.episode, first))
            yield drives.some(some), Windows(own.begin - before, own.window, own.increment - before)


def length_of(drives: Drives, windows: Windows) -> int:
    """Ticks that the longest window takes."""
    ticks = drives.last[windows.increment] - drives.first[windows.begin][windows.window]
    return int(ticks.max()) + (drives.after is not None)


def motion_in(drives: Drives, walked: Floats, windows: Windows) -> Floats:
    """Motion along windows' own paths (W, length + 1, 3) since each window's beginning (M, 3)."""
    begin = windows.begin[windows.window]
    start = drives.first[begin]
    return relative(
        drives.along(walked, windows.window, begin, start, end=False),
        drives.along(walked, windows.window, windows.increment, start, end=True),
    )


def pose_errors(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """How far the model's pose is from the measured one (M, 2): distance [m], heading [rad]."""
    return _size(pose_differences(drives, theta, windows))


def pose_errors_along(drives: Drives, walked: Floats, windows: Windows) -> Floats:
    """The errors (M, 2) of paths that were driven in one go (E, T + 1, 3)."""
    return _size(motion_along(drives, walked, windows) - measured_motion(drives, windows))


def motion_along(drives: Drives, walked: Floats, windows: Windows) -> Floats:
    """Motion along such paths since each window's beginning (M, 3)."""
    begin = windows.begin[windows.window]
    return relative(
        drives.along(walked, drives.episode[begin], begin, end=False),
        drives.along(walked, drives.episode[windows.increment], windows.increment, end=True),
    )


def measured_motion(drives: Drives, windows: Windows) -> Floats:
    """Measured motion since each window's beginning (M, 3)."""
    return relative(drives.poses[windows.begin[windows.window], 0], drives.poses[windows.increment, 1])


def _size(difference: Floats) -> Floats:
    return np.stack((np.hypot(difference[:, 0], difference[:, 1]), np.abs(difference[:, 2])), axis=1)


class Rmse(NamedTuple):
    """A root mean square with its 95 % interval."""

    value: float
    interval: tuple[float, float]


class Ratio(NamedTuple):
    """The ratio of two errors over the same windows.

    Attributes:
        value: The ratio of the two root mean squares.
        interval: Its 95 % interval, from leaving blocks out in turn.
        p_below: How likely chance makes so many blocks' ratios so far below 1 (Wilcoxon's signed ranks, one-sided).
        p_above: The same above 1.
    """

    value: float
    interval: tuple[float, float]
    p_below: float = 1.0
    p_above: float = 1.0

    @property
    def below(self) -> bool:
        """Whether it is shown to be below 1, by its interval or, where few blocks weigh most, by signed ranks."""
        return self.value < 1.0 and (self.interval[1] < 1.0 or self.p_below < RULES.ratio_p_value)

    @property
    def above(self) -> bool:
        """Whether it is shown to be above 1."""
        return self.value > 1.0 and (self.interval[0] > 1.0 or self.p_above < RULES.ratio_p_value)


def rmse(squares: Floats, blocks: Whole) -> Rmse:
    """The root mean square, with a t-interval on its logarithm from leaving blocks out in turn."""
    return _root(float(np.log(squares.mean())), _half_width(_log_means_without_each(squares, blocks)))


def ratio(after: Floats, before: Floats, blocks: Whole) -> Ratio:
    """The ratio of two root mean squares over the same windows, with its interval."""
    half = _half_width(_log_means_without_each(after, blocks) - _log_means_without_each(before, blocks))
    value, interval = _root(float(np.log(after.mean() / before.mean())), half)
    return Ratio(value, interval, *_signed_ranks(after, before, blocks))


def _signed_ranks(after: Floats, before: Floats, blocks: Whole) -> tuple[float, float]:
    """How likely chance makes the blocks' ratios so far below 1, and so far above."""
    _, label = np.unique(blocks, return_inverse=True)
    sums = np.stack([np.bincount(label, squares) for squares in (after, before)])
    logs = -np.diff(np.log(sums[:, (sums > 0.0).all(axis=0)]), axis=0)[0]
    if len(logs) < 2 or not logs.any():
        return 1.0, 1.0
    return float(wilcoxon(logs, alternative="less").pvalue), float(wilcoxon(logs, alternative="greater").pvalue)


def _root(log: float, half: float) -> Rmse:
    """The root of a square whose logarithm is known to within half a width."""
    value, low, high = (float(np.exp(end / 2.0)) for end in (log, log - half, log + half))
    return Rmse(value, (low, high))


def _log_means_without_each(squares: Floats, blocks: Whole) -> Floats:
    """Logarithm of the mean without each block."""
    _, label = np.unique(blocks, return_inverse=True)
    sums, counts = np.bincount(label, squares), np.bincount(label)
    if len(counts) < 2:
        return np.log(sums / counts)
    return np.asarray(np.log((sums.sum() - sums) / (counts.sum() - counts)))


def _half_width(logs: Floats) -> float:
    count = len(logs)
    if count < 2:
        return float("inf")
    spread = np.sqrt((count - 1) / count * ((logs - logs.mean()) ** 2).sum())
    return float(student.ppf(0.975, count - 1) * spread)
