"""Logs of a domain instance: manoeuvres driven and measured as a robot's would be."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import tomlkit

from proxytune.diagnosis.manoeuvres import LIBRARY
from proxytune.diagnosis.measured.drives import Floats
from proxytune.driving.lane_following import LaneFollowing
from proxytune.driving.recording import follow
from proxytune.driving.robot import read_robot
from proxytune.logs import Frames, Log, LogEpisode

POSITION_NOISE_M = 0.002
HEADING_NOISE_RAD = 0.005
"""White noise of a measured pose, as a tracker above the floor has it."""

HEADING_NOISE_DEG = math.degrees(HEADING_NOISE_RAD)

PICTURES = "frames/%06d.png"
"""Where a log's pictures lie in its folder."""

CAMERA = {
    "frames": PICTURES,
    "exposure": "fixed",
    "poses": {"position_m": POSITION_NOISE_M, "heading_deg": round(HEADING_NOISE_DEG, 4)},
}
"""What log.toml states of the pictures: no effect adjusts the exposure from one to the next."""


def record(family: LaneFollowing, *, name: str, repeats: int, seconds: float, seed: int) -> Log:
    """Drive every manoeuvre so many times, each time at another size and to the other side.

    Args:
        family: The domain; its effects are what is recorded.
        name: What the log is called.
        repeats: Drives of each manoeuvre.
        seconds: Length of a drive [s].
        seed: Of sizes, starts and noise.
    """
    rate = read_robot(family.robot, family.folder).figures["control_rate"]
    times = np.arange(round(seconds * rate)) / rate
    episodes = []
    for number in range(repeats * len(LIBRARY)):
        random = np.random.default_rng((seed, number))
        duties = _vary(LIBRARY[number % len(LIBRARY)][2](times), random, number // len(LIBRARY))
        poses = _drive(family, duties, random, number)
        episodes.append(LogEpisode(str(number), times, duties, poses, None))
    return Log(name, family.robot, "duty", rate, {}, tuple(episodes))


def _vary(duties: Floats, random: np.random.Generator, repeat: int) -> Floats:
    sized = duties * random.uniform(0.75, 1.0)
    return np.round(sized if repeat % 2 == 0 else sized[:, ::-1], 4)


def _drive(family: LaneFollowing, duties: Floats, random: np.random.Generator, number: int) -> Floats:
    start = np.array((0.0, 0.0, random.uniform(-np.pi, np.pi)))
    instance = family.instance({})
    with family.plant_at(instance.robot, start) as plant:
        poses = follow(instance, plant, start, duties, number)
    return tracked(poses, random)


def tracked(poses: Floats, random: np.random.Generator) -> Floats:
    """Poses (rows, 3) as a tracker measures them: with white noise."""
    noise = random.standard_normal(poses.shape) * (POSITION_NOISE_M, POSITION_NOISE_M, HEADING_NOISE_RAD)
    return np.asarray(poses + noise)


def log_text(log: Log, source: str) -> str:
    """A log.toml for a recorded log."""
    pose = f"x, y with {POSITION_NOISE_M:g} m, heading with {HEADING_NOISE_RAD:g} rad of white noise (1 sigma)"
    facts = {"format": 1, "name": log.name, "robot": log.robot, "command": log.command, "rate_hz": log.rate_hz}
    facts |= {"pose": pose, "measured": False, "source": source}
    facts |= {"map": Path(log.frames.road).name} if log.frames else {}
    return tomlkit.dumps(facts | ({"camera": CAMERA} if log.frames else {}))


def samples_text(log: Log) -> str:
    """A samples.csv for a log of duties."""
    columns = ("time", "left", "right", "x", "y", "heading")
    tables = [
        pd.DataFrame(np.column_stack((e.times, e.commands, e.poses)), columns=columns).assign(episode=e.name)
        for e in log.episodes
    ]
    return pd.concat(tables)[["episode", *columns]].to_csv(index=False, float_format="%.4f", lineterminator="\n")


def frames_text(log: Log, frames: Frames, numbers: Sequence[int], float_format: str | None = None) -> str:
    """A frames.csv for pictures of these of a log's frames, numbered as they come, from 0."""
    chosen = list(numbers)
    names = [log.episodes[drive].name for drive in frames.drives[chosen]]
    table = pd.DataFrame({"frame": chosen, "episode": names, "time": frames.times[chosen]})
    return table.to_csv(index=False, float_format=float_format, lineterminator="\n")
