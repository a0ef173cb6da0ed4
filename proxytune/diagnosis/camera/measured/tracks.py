"""Where the robot was when pictures were taken: tracked poses, smoothed where it moves."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from proxytune.errors import LogError
from proxytune.logs import Frames, Log, LogEpisode

Floats = NDArray[np.float64]

WINDOW_S = 0.5
"""Poses are smoothed by parabolas over windows so long, which tell the speed too."""

ORDER = 2

LONGEST_GAP_S = 0.25
"""Frames within a longer gap between poses are left out."""

APART_S = 10.0
"""How far apart drives are put on the common axis of times, so that none reaches into the next."""


@dataclass(frozen=True)
class Tracks:
    """The poses of N frames, and those shortly before and after.

    Attributes:
        times: Times on an axis on which drives follow each other (K,) [s].
        poses: Poses at these times (K, 3): x, y [m], heading [rad, unwrapped].
        rates: Their rates (K, 3) [m/s, rad/s]; 0 where pictures were taken standing still.
        instants: When each frame was taken, on the same axis (N,) [s].
        begins: When the drive of each frame begins, on the same axis (N,) [s].
        share: How much of the tracker's scatter is left after smoothing.
    """

    times: Floats
    poses: Floats
    rates: Floats
    instants: Floats
    begins: Floats
    share: float

    def at(self, late_s: float) -> tuple[Floats, Floats]:
        """Poses and rates (N, 3) so long before each frame's instant."""
        when = np.maximum(self.instants - late_s, self.begins)
        columns = (self.poses.T, self.rates.T)
        poses, rates = (np.stack([np.interp(when, self.times, one) for one in column], axis=-1) for column in columns)
        return poses, rates

    def only(self, chosen: NDArray[np.intp]) -> "Tracks":
        """The tracks of some frames."""
        return replace(self, instants=self.instants[chosen], begins=self.begins[chosen])

    @property
    def moving(self) -> bool:
        """Whether any picture was taken in motion."""
        return bool(np.any(self.rates))


def track_frames(log: Log, frames: Frames) -> tuple[Tracks, NDArray[np.intp]]:
    """The tracks of a log's frames, and the numbers of those frames whose pose is known.

    Raises:
        LogError: If no frame's pose is known.
    """
    still = log.rate_hz == 0.0
    parts, offset, instants, begins = [], 0.0, np.full(len(frames.times), np.nan), np.zeros(len(frames.times))
    for number, episode in enumerate(log.episodes):
        own = np.flatnonzero(frames.drives == number)
        known = np.asarray(np.isfinite(episode.poses).all(axis=1))
        # A drive shorter than the window tells no speed
        if not known.any() or (not still and len(episode.times) < _samples(log.rate_hz)):
            continue
        shift = offset - episode.times[0]
        near = own[_within_poses(frames.times[own], episode.times[known], still)]
        instants[near], begins[own] = frames.times[near] + shift, episode.times[known][0] + shift
        parts.append((episode.times[known] + shift, *_smooth(episode, known, log.rate_hz)))
        offset += float(episode.times[-1] - episode.times[0]) + APART_S
    kept = np.flatnonzero(np.isfinite(instants))
    if not len(kept):
        raise LogError(f"{log.name}: no frame has a pose near its time; check that times are on the poses' clock")
    times, poses, rates = (np.concatenate(column) for column in zip(*parts, strict=True))
    share = 1.0 if still else float(np.sqrt((savgol_coeffs(_samples(log.poses_hz), ORDER) ** 2).sum()))
    return Tracks(times, poses, rates, instants[kept], begins[kept], share), kept


def _samples(rate_hz: float) -> int:
    """Samples of a window, an odd number that a parabola leaves something over from."""
    return max(2 * round(WINDOW_S * rate_hz / 2.0) + 1, ORDER + 3)


def _within_poses(times: Floats, known: Floats, still: bool) -> NDArray[np.bool_]:
    after = np.searchsorted(known, times)
    gap = known[np.clip(after, 0, len(known) - 1)] - known[np.clip(after - 1, 0, len(known) - 1)]
    inside = (times >= known[0]) & (times <= known[-1])
    exact = np.isclose(known[np.clip(after, 0, len(known) - 1)], times, atol=1e-6)
    return np.asarray(exact if still else inside & (exact | (gap <= LONGEST_GAP_S)))


def _smooth(episode: LogEpisode, known: NDArray[np.bool_], rate_hz: float) -> tuple[Floats, Floats]:
    """Smoothed poses and their rates, at the samples that have a pose."""
    poses = episode.poses[known]
    if not rate_hz:
        return poses, np.zeros_like(poses)
    window = _samples(rate_hz)
    filled = np.stack([np.interp(episode.times, episode.times[known], column) for column in poses.T], axis=-1)
    smooth = savgol_filter(filled, window, ORDER, axis=0)[known]
    rates = savgol_filter(filled, window, ORDER, deriv=1, delta=1.0 / rate_hz, axis=0)[known]
    return smooth, rates
