"""Prediction over windows, each started from a measured pose, and how far it is from what was measured.

`cut` cuts drives into windows of a horizon, `pose_errors` replays them open-loop, and `ratio` divides root mean squares
of two models over the same windows, with a t-interval on its logarithm from leaving blocks out in turn. `predict` gives
the poses of any log. `slopes_of` linearises windows in the weights of learnt curves. `compare_repeats` takes manoeuvres
that were driven several times from the same commands: no model can predict what differs between them.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t as student, wilcoxon

from proxytune.diagnosis.answer import RULES
from proxytune.diagnosis.motion import innovations
from proxytune.diagnosis.motion.drives import (
    Drives,
    Floats,
    Recent,
    Whole,
    as_measured,
    cosine_and_sine,
    gather,
    path_between,
    relative,
    sum_by,
)
from proxytune.driving import Robot
from proxytune.effects import Learnt, is_learnt
from proxytune.errors import LogError
from proxytune.logs import Log, LogEpisode
from proxytune.space import Theta

SHORTEST = 0.9
"""Windows that cover less of the horizon are left out: poses seldom end exactly at it, but a stub is no window."""
AT_ONCE = 300_000
"""About so many ticks of episodes are replayed together: memory is not to grow with the number of drives."""


class Windows(NamedTuple):
    """Windows, begun by an increment (W,), and the increments in them whose ends are compared (M,)."""

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


def count_blocks(drives: Drives, windows: Windows) -> int:
    """Count the blocks that windows begin in."""
    return len(np.unique(drives.block[windows.begin]))


def predicted_motion(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """The model's motion since each window's beginning (M, 3): [m], [m], [rad]."""
    return np.concatenate(
        [
            motion_in(some, innovations.window_paths(some, theta, own.begin, length_of(some, own)), own)
            for some, own in _batches(drives, windows)
        ]
    )


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


def motion_in(drives: Drives, walked: Floats, windows: Windows, *, in_one_go: bool = False) -> Floats:
    """Motion (M, 3) since windows' beginnings, along paths of their own (W, length + 1, 3) or episodes in one go."""
    begin = windows.begin[windows.window]
    path, start = (drives.episode[begin], 0) if in_one_go else (windows.window, drives.first[begin])
    ends = ((begin, False), (windows.increment, True))
    return relative(*(drives.along(walked, path, increment, start, end=end) for increment, end in ends))


def pose_errors(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """Measure the errors of the model's poses (M, 2): distance [m], heading [rad]."""
    return _lengths(predicted_motion(drives, theta, windows) - measured_motion(drives, windows))


def squared_distances(drives: Drives, theta: Theta, windows: Windows) -> Floats:
    """Squared distances of the model's places from measured ones (M,) [m²]."""
    return np.asarray(pose_errors(drives, theta, windows)[:, 0] ** 2)


def pose_errors_along(drives: Drives, walked: Floats, windows: Windows) -> Floats:
    """The errors (M, 2) of paths that were driven in one go (E, T + 1, 3)."""
    return _lengths(motion_in(drives, walked, windows, in_one_go=True) - measured_motion(drives, windows))


def measured_motion(drives: Drives, windows: Windows) -> Floats:
    """Measured motion since each window's beginning (M, 3)."""
    return relative(drives.poses[windows.begin[windows.window], 0], drives.poses[windows.increment, 1])


def _lengths(difference: Floats) -> Floats:
    return np.stack((np.hypot(difference[:, 0], difference[:, 1]), np.abs(difference[:, 2])), axis=1)


class Rmse(NamedTuple):
    """A root mean square with its 95 % interval."""

    value: float
    interval: tuple[float, float]


class Ratio(NamedTuple):
    """The ratio of two errors over the same windows."""

    value: float  # the ratio of the two root mean squares
    interval: tuple[float, float]  # its 95 % interval, from leaving blocks out in turn
    # how likely chance makes so many blocks' ratios so far below 1 (Wilcoxon's signed ranks, one-sided)
    p_below: float = 1.0
    p_above: float = 1.0  # the same above 1
    shown_at: float = RULES.ratio_p_value  # the chance below which it is shown to be off 1

    @property
    def below(self) -> bool:
        """Tell whether it is shown to be below 1, by its interval or, where few blocks weigh most, by signed ranks."""
        return self.value < 1.0 and (self.interval[1] < 1.0 or self.p_below < self.shown_at)

    @property
    def above(self) -> bool:
        """Tell whether it is shown to be above 1."""
        return self.value > 1.0 and (self.interval[0] > 1.0 or self.p_above < self.shown_at)


def rmse(squares: Floats, blocks: Whole) -> Rmse:
    """The root mean square, with a t-interval on its logarithm from leaving blocks out in turn."""
    return _root(float(np.log(squares.mean())), jackknife_half_width(_log_means_without_each(squares, blocks)))


def ratio(after: Floats, before: Floats, blocks: Whole, shown_at: float = RULES.ratio_p_value) -> Ratio:
    """Divide two root mean squares over the same windows, with an interval and the chance of a ratio so far off 1."""
    half = jackknife_half_width(_log_means_without_each(after, blocks) - _log_means_without_each(before, blocks))
    value, interval = _root(float(np.log(after.mean() / before.mean())), half)
    return Ratio(value, interval, *_signed_ranks(after, before, blocks), shown_at)


def ratio_over(drives: Drives, windows: Windows, after: Floats, before: Floats) -> Ratio:
    """Divide the root mean squares of two errors over windows, shown to be off 1 by the rules of the drives."""
    return ratio(after, before, blocks_of(drives, windows), drives.rules.ratio_p_value)


def _signed_ranks(after: Floats, before: Floats, blocks: Whole) -> tuple[float, float]:
    """The chance of blocks' ratios so far below 1, and so far above."""
    _, label = np.unique(blocks, return_inverse=True)
    sums = np.stack([np.bincount(label, squares) for squares in (after, before)])
    logs = -np.diff(np.log(sums[:, (sums > 0.0).all(axis=0)]), axis=0)[0]
    if len(logs) < 2 or not logs.any():
        return 1.0, 1.0
    # Blocks that are alike have no rank; SciPy would go through all their signs one by one.
    logs = logs[logs != 0.0]
    return float(wilcoxon(logs, alternative="less").pvalue), float(wilcoxon(logs, alternative="greater").pvalue)


def _root(log: float, half: float) -> Rmse:
    """The root of a square whose logarithm is known to within half a width."""
    value, low, high = (float(np.exp(end / 2.0)) for end in (log, log - half, log + half))
    return Rmse(value, (low, high))


def _log_means_without_each(squares: Floats, blocks: Whole) -> Floats:
    _, label = np.unique(blocks, return_inverse=True)
    sums, counts = np.bincount(label, squares), np.bincount(label)
    if len(counts) < 2:
        return np.log(sums / counts)
    return np.asarray(np.log((sums.sum() - sums) / (counts.sum() - counts)))


def jackknife_half_width(values: Floats) -> float:
    """Half of the 95 % interval, from the values without each block in turn; infinite of one block alone."""
    count = len(values)
    if count < 2:
        return float("inf")
    spread = np.sqrt((count - 1) / count * ((values - values.mean()) ** 2).sum())
    return float(student.ppf(0.975, count - 1) * spread)


def predict(log: Log, robot: Robot, theta: Theta, horizon_s: float) -> pd.DataFrame:
    """Predicted poses, one row for every row of the log that a window covers.

    In each window the model starts from the measured pose, and the measured wheel speeds where the log has them, and is
    driven by the recorded commands, those before the window included. Windows follow one another; each begins at the
    first measured pose after the one before it. A drive with one pose alone is predicted from it, over one window.

    Returns:
        Columns `episode, start_time, time, x, y, heading` [s], [s], [s], [m], [m], [rad].

    Raises:
        LogError: If the log has no commands, no poses, or no room for a window.
    """
    if not horizon_s * log.rate_hz >= 1.0:
        raise LogError(f"{log.name}: a horizon of {horizon_s:g} s is shorter than a sample of {1.0 / log.rate_hz:g} s")
    whole = gather(log, robot, log.episodes, compared=False)
    longest = max(len(episode.times) for episode in log.episodes)
    reach = int(np.floor(min(horizon_s * log.rate_hz, longest) + 1e-9))
    starts = [_starts(episode, reach) for episode in log.episodes]
    if not any(len(rows) for rows in starts):
        raise LogError(f"{log.name}: no measured pose to start a window from; add x, y and heading")
    ticks = round(whole.tick_hz / log.rate_hz)
    # Drives whose increments are the windows' beginnings alone.
    first = np.concatenate(starts) * ticks + whole.lead
    number = np.repeat(np.arange(len(starts)), [len(rows) for rows in starts])
    begins = [as_measured(one)[0][rows] for one, rows in zip(log.episodes, starts, strict=True)]
    both, block = np.repeat(np.concatenate(begins)[:, None], 2, axis=1), np.zeros_like(first)
    windows = replace(whole, episode=number, first=first, last=first, poses=both, block=block)
    walked = innovations.window_paths(windows, theta, np.arange(len(windows.first)), reach * ticks)
    poses = _place_at(windows.poses[:, 0], *_at_samples(walked, log.episodes, starts, ticks))
    cuts = np.cumsum([len(rows) for rows in starts])[:-1]
    parts = zip(log.episodes, starts, np.split(poses, cuts), strict=True)
    return pd.concat([_rows(*part) for part in parts if len(part[1])], ignore_index=True)


def _rows(episode: LogEpisode, starts: Whole, poses: Floats) -> pd.DataFrame:
    """The predicted poses (W, rows, 3) of an episode's windows, as far as the episode goes, at its poses' own times."""
    covered = starts[:, None] + np.arange(poses.shape[1])
    inside = covered < len(episode.times)
    known = np.minimum(covered, len(episode.times) - 1)
    stamps = episode.times + as_measured(episode)[1]
    if episode.measured is not None:
        inside &= np.isin(known, episode.measured.rows)
        stamps[episode.measured.rows] = episode.measured.times
    start = np.broadcast_to(stamps[starts, None], covered.shape)
    times = stamps[known]
    columns = {"start_time": start, "time": times, "x": poses[..., 0], "y": poses[..., 1], "heading": poses[..., 2]}
    return pd.DataFrame({"episode": episode.name} | {name: values[inside] for name, values in columns.items()})


def _at_samples(
    walked: Floats, episodes: Sequence[LogEpisode], starts: Sequence[Whole], ticks: int
) -> tuple[Floats, Floats]:
    """Windows' paths at their samples (W, rows, 3), and at their beginnings (W, 3), when those were measured."""
    rows = np.arange((walked.shape[1] - 1) // ticks + 1)
    after = [as_measured(e)[1] * ticks / float(np.diff(e.times[:2])[0]) for e in episodes]
    late = np.concatenate(
        [one[np.minimum(s[:, None] + rows, len(one) - 1)] for one, s in zip(after, starts, strict=True)]
    )
    window = np.arange(len(walked))
    return path_between(walked, window[:, None], rows * ticks + late), path_between(walked, window, late[:, 0])


def _starts(episode: LogEpisode, reach: int) -> Whole:
    """Rows at which windows begin: measured ones, at least `reach` apart, not the last row."""
    known = np.flatnonzero(np.isfinite(episode.poses[:-1]).all(axis=1))
    starts: list[int] = []
    at = 0
    while (later := int(np.searchsorted(known, at))) < len(known):
        starts.append(int(known[later]))
        at = starts[-1] + reach
    return np.array(starts, dtype=int)


def _place_at(start: Floats, walked: Floats, origin: Floats) -> Floats:
    """Paths (W, rows, 3) put where they start (W, 3); their own beginnings are the origins (W, 3)."""
    turn = start[:, None, 2] - origin[:, None, 2]
    cosine, sine = np.cos(turn), np.sin(turn)
    moved = walked[..., :2] - origin[:, None, :2]
    x = start[:, None, 0] + cosine * moved[..., 0] - sine * moved[..., 1]
    y = start[:, None, 1] + sine * moved[..., 0] + cosine * moved[..., 1]
    return np.stack((x, y, walked[..., 2] + turn), axis=-1)


class Agreement(NamedTuple):
    """The errors of predicted poses over windows of the horizon."""

    place: float  # RMSE of position [m], 0 where nothing can be compared
    turn: float  # RMSE of heading [rad], 0 where nothing can be compared
    poses: int  # how many poses were compared
    windows: int  # in how many windows


def agreement(table: pd.DataFrame, log: Log, horizon_s: float) -> Agreement:
    """Compare predicted poses, as `predict` gives them, with those measured after each window's start.

    Windows in which measured poses reach no further than a stub of the horizon are left out.
    """
    measured = pd.concat(
        [
            pd.DataFrame(poses, columns=["x", "y", "heading"]).assign(episode=e.name, time=times)
            for e in log.episodes
            for times, poses in [(e.times, e.poses) if e.measured is None else e.measured[:2]]
        ]
    )
    both = table[table.time > table.start_time].merge(measured, on=["episode", "time"], suffixes=("", "_measured"))
    both = both.dropna()
    window = both.groupby(["episode", "start_time"])
    both = both[window.time.transform("max") - both.start_time >= SHORTEST * horizon_s - 1e-9]
    if both.empty:
        return Agreement(0.0, 0.0, 0, 0)
    place = (both.x - both.x_measured) ** 2 + (both.y - both.y_measured) ** 2
    turn = both.heading - both.heading_measured
    count = len(both[["episode", "start_time"]].drop_duplicates())
    return Agreement(float(np.sqrt(place.mean())), float(np.sqrt((turn**2).mean())), len(both), count)


FITTED_S = 2.0
"""What is learnt is fitted to windows of this length [s]."""
POSES = 8
"""No more poses are compared in a window."""
MOST_WINDOWS = 600
"""No more windows are fitted, spread evenly over the drives."""
STEP = 5e-3
"""Slopes of the model's own values come from steps of this share of their range."""


class Slopes(NamedTuple):
    """Windows' poses (M, 3) as they are compared, in metres: forward, left, and heading times the median way."""

    residuals: Floats
    columns: Floats  # change of the prediction per weight (M, 3, weights), curve by curve, free coordinates last
    block: Whole


def choose_windows(drives: Drives) -> Windows:
    """Choose the windows and poses that are fitted: few enough, and evenly spread."""
    windows = cut(drives, FITTED_S)
    step = int(np.ceil(len(windows.begin) / MOST_WINDOWS))
    windows = select_windows(windows, np.arange(len(windows.begin)) % step == 0)
    tick = drives.last[windows.increment] - drives.first[windows.begin][windows.window]
    part = windows.window * POSES + np.minimum(POSES - 1, tick * POSES // (FITTED_S * drives.tick_hz)).astype(int)
    last = np.concatenate((part[1:] != part[:-1], [True]))
    return Windows(windows.begin, windows.window[last], windows.increment[last])


def slopes_of(drives: Drives, theta: Theta, offered: Learnt, free: Sequence[innovations.Coordinate] = ()) -> Slopes:
    """Linearise windows in the weights of the curves offered, around a model that may have a learnt effect itself.

    Columns of free coordinates come last, by the share of their range.
    """
    windows = choose_windows(drives)
    begin, window = windows.begin, windows.window
    tick = drives.last[windows.increment] - drives.first[begin][window]
    length = length_of(drives, windows)
    named = {name: value for name, value in theta.items() if not is_learnt(name)}

    def walk(values: Theta) -> tuple[Floats, Floats, Floats]:
        twists = innovations.window_twists(drives, values, begin, length)
        walked = innovations.tracked_paths(drives, values, twists)
        return twists, walked, motion_in(drives, walked, windows)

    twists, walked, predicted = walk(theta)
    measured = measured_motion(drives, windows)
    way = float(np.median(np.hypot(measured[:, 0], measured[:, 1])))
    features = innovations.window_features(drives, named, offered, begin, length)
    changes = _pose_slopes(twists, walked, features, (window, tick - 1), 1.0 / drives.tick_hz)
    # Seen from the frame in which each window's tracked place begins.
    cosine, sine = (part[:, None] for part in cosine_and_sine(-walked[window, 0, 2]))
    x = cosine * changes[:, 0] - sine * changes[:, 1]
    y = sine * changes[:, 0] + cosine * changes[:, 1]
    columns, scale = [np.stack((x, y, way * changes[:, 2]), axis=1)], (1.0, 1.0, way)
    known = Recent[Floats]()
    known.get(tuple(theta.items()), lambda: predicted)

    def motion_at(values: Theta) -> Floats:
        return known.get(tuple(values.items()), lambda: walk(values)[2])

    for coordinate in free:
        slope = innovations.difference_quotient(motion_at, drives, theta, coordinate, STEP)
        columns.append((slope * scale)[..., None])
    return Slopes((measured - predicted) * scale, np.concatenate(columns, axis=2), drives.block[begin[window]])


def _pose_slopes(
    twists: Floats, walked: Floats, features: Iterable[innovations.LearntMotion], at: tuple[Whole, Whole], tick_s: float
) -> Floats:
    """Change of poses `at` windows and ticks (M, 3, weights) per weight, to first order; places as complex numbers."""
    poses = innovations.integrate_twists(twists, tick_s)
    cosine, sine = cosine_and_sine(poses[:, 1:, 2] - twists[..., 2] * (tick_s / 2.0))
    axle = 0.5 * (poses[:, 1:] + poses[:, :-1])
    # The way of 1 m/s within a tick; how far a turn of 1 rad/s in it moves places, less what a turn after it moves.
    along, about = (cosine + 1j * sine) * tick_s, (axle[..., 1] - 1j * axle[..., 0]) * tick_s
    after = 1j * walked[:, 1:, 0] - walked[:, 1:, 1]
    # Sums over the ticks up to each pose as products of matrices, a window each.
    window, tick = at
    number = np.arange(len(window)) - np.searchsorted(window, window)
    until = np.zeros((len(twists), int(number.max(initial=0)) + 1, twists.shape[1]))
    until[window, number] = np.arange(twists.shape[1]) <= tick[:, None]

    def change(basis: Floats, unit: Floats) -> Floats:
        if not basis.any():
            return np.zeros((len(window), 3, basis.shape[-1]))
        place = ((unit[0] + 1j * unit[1]) * along + unit[2] * about)[:, None]
        x, y = ((until * weight @ basis)[window, number] for weight in (place.real, place.imag))
        turned = (until @ basis)[window, number] * (unit[2] * tick_s) if unit[2] else np.zeros_like(x)
        moved = x + 1j * y + after[at][:, None] * turned
        return np.stack((moved.real, moved.imag, turned), axis=1)

    return np.concatenate([sum(change(basis, unit) for basis, unit in parts) for parts in features], axis=-1)


FEWEST = 20
"""Of fewer windows that were driven several times nothing is said."""
ALIKE = 1e-6
"""Commands that differ by less than this [duty] are the same."""
ALIKE_AT_START = 0.1
"""Drives that begin in motion repeat each other if they begin about so equally fast [duty]."""


class Repeated(NamedTuple):
    """The scatter of drives from the same commands: what they do not repeat."""

    share: Ratio  # of the model's error over the same windows: 1 where the model predicts all that repeats
    apart: float  # RMSE of position [m]
    part: float  # so many of all windows have repeats


def compare_repeats(drives: Drives, theta: Theta, horizon_s: float) -> Repeated | None:
    """Compare a model's error with what drives do not repeat; None where too little was driven twice, or was copied."""
    windows = cut(drives, horizon_s)
    if len(windows.begin) < FEWEST:
        return None
    label, counts = _label_repeats(drives, windows)
    kept = counts[label] > 1
    if len(np.unique(windows.window[kept])) < FEWEST:
        return None
    # Squared distance of each motion from the mean of its repeats, as if that were known without error.
    moved = measured_motion(drives, windows)[:, :2]
    mean = sum_by(label, moved, len(counts)) / counts[:, None]
    known = np.maximum(1, counts - 1)[label] / counts[label]
    apart = np.asarray(np.square(moved - mean[label]).sum(axis=1) / known)
    if not apart[kept].any():
        # Copies of drives to the last digit: they say nothing of what a robot does not repeat.
        return None
    missed = squared_distances(drives, theta, windows)
    # Each drive of the log is one block: windows of repeats begin together.
    first = np.flatnonzero(np.diff(windows.window, prepend=-1))
    share = ratio(apart[kept], missed[kept], label[first][windows.window][kept])
    return Repeated(share, float(np.sqrt(apart[kept].mean())), float(kept.mean()))


def _label_repeats(drives: Drives, windows: Windows) -> tuple[Whole, Whole]:
    """Label compared poses (M,), alike where time, all commands and start were the same; count how often each is."""
    begin, end = drives.first[windows.begin][windows.window], drives.last[windows.increment]
    # A number for all commands up to each tick: equal ones have the same, and no commands have 0.
    rounded = np.round(drives.duties / ALIKE).astype(np.int64)
    weights = np.random.default_rng(1).integers(1, 2**62, size=rounded.shape[1:])
    started = np.round(drives.rest / ALIKE_AT_START).astype(np.int64) @ weights[-1]
    histories = np.asarray(np.cumsum((rounded * weights).sum(axis=-1), axis=1)) + started[:, None]
    past = histories[drives.episode[windows.increment], end - 1]
    alone = np.where(past == 0, np.arange(len(past)) + 1, 0)
    _, label, counts = np.unique(np.stack((past, begin, end, alone)), axis=1, return_inverse=True, return_counts=True)
    return label.ravel(), counts
