"""What much work costs: processor time and peak memory of one command on a large input.

    python benchmarks/loads.py diagnose RATE [DRIVES]
    python benchmarks/loads.py score AGENTS EPISODES [PROXIES [MISSING]]

RATE is how often poses are measured [Hz], DRIVES take a minute each, an hour of them if not said. MISSING is of how
many tables one episode is missing, the target's first: agents are then resampled each by itself.
"""

import json
import resource
import sys
import tempfile
import time
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "fakes"))

from planted import ROBOT, TRUTH, planted_log

from proxytune.cli.main import main as proxytune
from proxytune.diagnosis.motion.diagnose import declared_effects, diagnose
from proxytune.logs import Log, LogEpisode

HOUR, SECONDS = 60, 60.0
"""Drives, and how long each takes [s]."""
POSE_NOISE = np.array((0.002, 0.002, 0.005))
"""[m], [m], [rad]."""
METRICS = "abc"


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


def diagnose_much(rate_hz: int, drives: int = HOUR) -> None:
    """Diagnose, and print processor time and peak memory."""
    log = minutes(drives, rate_hz)
    begin, clock = time.process_time(), time.perf_counter()
    found = diagnose(log, ROBOT, declared_effects(ROBOT))
    spent, passed = time.process_time() - begin, time.perf_counter() - clock
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    names = ", ".join(effect.effect for effect in found.effects)
    cost = f"{spent:.0f} s of processor time, {passed:.0f} s, at most {peak:.0f} MiB"
    print(f"{drives} minutes at {rate_hz} Hz: {cost}; {found.verdict}: {names}")


def write_scores(path: Path, skills: np.ndarray, episodes: int, random: np.random.Generator) -> None:
    """A file of agents of these skills (agents, metrics), each episode off by as much as skills differ."""
    scores = skills[:, None] + random.standard_normal((len(skills), episodes, len(METRICS)))
    rows = (
        f"A{agent},{episode},{','.join(f'{value:.6f}' for value in scores[agent, episode])}\n"
        for agent in range(len(skills))
        for episode in range(episodes)
    )
    path.write_text(f"agent,episode,{','.join(METRICS)}\n{''.join(rows)}")


def score_much(agents: int, episodes: int, proxies: int = 1, missing: int = 0) -> None:
    """Score generated tables as the command does, and print processor time and peak memory."""
    random = np.random.default_rng(0)
    skills = random.standard_normal((agents, len(METRICS)))
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{name}.csv" for name in ("target", *map(str, range(proxies)))]
        for place, path in enumerate(files):
            shift = 0.3 * random.standard_normal(skills.shape) if place else 0.0
            write_scores(path, skills + shift, episodes, random)
            if place < missing:
                path.write_text(path.read_text().rpartition("A")[0])
        target, *others = map(str, files)
        sides = ["--target", target, *(word for name in others for word in ("--proxy", name))]
        begin, out = time.process_time(), StringIO()
        with redirect_stdout(out):
            proxytune(["score", *sides, *(word for name in METRICS for word in ("--metric", f"{name}:max")), "--json"])
        spent = time.process_time() - begin
    document = json.loads(out.getvalue())
    found = [one["prpv"] for one in document.get("proxies", [document])]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    compared = f"{agents} agents × {episodes} episodes, {proxies} proxies, {missing} tables incomplete"
    print(f"{compared}: {spent:.1f} s, {peak:.0f} MiB; PRPV {found[:3]}")


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    {"diagnose": diagnose_much, "score": score_much}[sys.argv[1]](*map(int, sys.argv[2:]))
