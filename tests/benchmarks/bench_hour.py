"""What much driving costs to diagnose: `python tests/benchmarks/bench_hour.py RATE [DRIVES]`, poses at 20 or 100 Hz."""

import resource
import sys
import time
from dataclasses import replace

import numpy as np
from planted import ROBOT, TRUTH, planted_log

from proxytune.diagnosis.motion.diagnose import declared_effects, diagnose
from proxytune.logs import Log, LogEpisode

HOUR, SECONDS = 60, 60.0
"""Drives, and how long each takes [s]."""
POSE_NOISE = np.array((0.002, 0.002, 0.005))
"""[m], [m], [rad]."""


def minutes(drives: int, rate_hz: int) -> Log:
    """So many drives of a minute by a robot with a dead band, its poses measured so often."""
    log = planted_log(
        {**TRUTH, "dead_band.width": 0.1, "dead_band.imbalance": 0.0}, episodes=drives, seconds=SECONDS, noise=None
    )
    random = np.random.default_rng(1)
    episodes = tuple(_measured(episode, rate_hz, random) for episode in log.episodes)
    return replace(log, rate_hz=float(rate_hz), episodes=episodes)


def _measured(episode: LogEpisode, rate_hz: int, random: np.random.Generator) -> LogEpisode:
    times = np.arange(0.0, episode.times[-1] + 1e-9, 1.0 / rate_hz)
    poses = np.stack([np.interp(times, episode.times, column) for column in episode.poses.T], axis=1)
    held = np.searchsorted(episode.times, times + 1e-6, side="right") - 1
    noisy = poses + POSE_NOISE * random.standard_normal(poses.shape)
    return replace(episode, times=times, commands=episode.commands[held], poses=noisy)


def main() -> None:
    """Diagnose, and print processor time and peak memory."""
    rate_hz, drives = (*map(int, sys.argv[1:]), HOUR)[:2]
    log = minutes(drives, rate_hz)
    begin, clock = time.process_time(), time.perf_counter()
    found = diagnose(log, ROBOT, declared_effects(ROBOT))
    spent, passed = time.process_time() - begin, time.perf_counter() - clock
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    names = ", ".join(effect.effect for effect in found.effects)
    cost = f"{spent:.0f} s of processor time, {passed:.0f} s, at most {peak:.0f} MiB"
    print(f"{drives} minutes at {rate_hz} Hz: {cost}; {found.verdict}: {names}")


if __name__ == "__main__":
    main()
