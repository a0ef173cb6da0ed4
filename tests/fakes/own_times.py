"""A Duckiebot whose commands are issued at jittering times of their own: logged so, or put onto the poses' grid."""

from dataclasses import replace
from typing import NamedTuple

import hidden_cases as hidden
import numpy as np
from manoeuvres import RATE_HZ, make_drives

from proxytune.logs import Log, LogEpisode

COMMAND_S, JITTER_S, LOST = 0.1, 0.03, 0.03


class Sent(NamedTuple):
    """A drive's commands: when they were issued (M,) [s], and duties (M, 2)."""

    times: np.ndarray
    duties: np.ndarray


def own_times_log(seed: int, *, episodes: int, seconds: float, gridded: bool) -> Log:
    """Drives with commands at 10 Hz, each early or late by up to JITTER_S, some left out; poses at 20 Hz.

    The robot obeys at once after its delay, without a jitter of its own.
    """
    case = replace(hidden.CLEAN[0], seed=seed)
    rows = round(seconds * RATE_HZ)
    drives = make_drives(seed, episodes, rows)
    random = np.random.default_rng((seed, 7))
    sent = [_sent(random, duties, seconds) for duties in drives.duties]
    fine = np.arange(rows * hidden.PER_ROW) / hidden.FINE_HZ
    arrived = np.stack([_in_force(one, fine - case.delay) for one in sent])
    target = hidden._lagged(arrived * (1.0 - case.trim, 1.0 + case.trim))
    twists = np.zeros((*target.shape[:2], 3))
    twists[..., 0] = target.sum(axis=-1) * hidden.FULL_SPEED / 2.0
    twists[..., 2] = (target[..., 1] - target[..., 0]) * hidden.FULL_SPEED / hidden.BASELINE
    paths = hidden._integrated(hidden.disturbed(twists, case, 1.0), drives.starts)[:, : -1 : hidden.PER_ROW]
    poses = hidden.measured(paths, case, 1.0)
    times = np.arange(rows) / RATE_HZ
    made = [
        LogEpisode(f"{e:02d}", times, _in_force(one, times), poses[e], None)
        if gridded
        else LogEpisode(f"{e:02d}", times, one.duties, poses[e], None, one.times)
        for e, one in enumerate(sent)
    ]
    return Log("own times", "duckiebot", "duty", float(RATE_HZ), {}, tuple(made))


def _sent(random: np.random.Generator, duties: np.ndarray, seconds: float) -> Sent:
    times = np.arange(0.05, seconds - 0.1, COMMAND_S)
    times = times + random.uniform(-JITTER_S, JITTER_S, len(times))
    times = times[random.random(len(times)) >= LOST]
    return Sent(times, duties[np.floor(times * RATE_HZ).astype(int)])


def _in_force(sent: Sent, times: np.ndarray) -> np.ndarray:
    """The newest command at each time, none before the first."""
    return np.concatenate((np.zeros((1, 2)), sent.duties))[np.searchsorted(sent.times, times + 1e-9, side="right")]
