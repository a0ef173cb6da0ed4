"""Small logs with frames that proxytune's own camera could have taken, written as a user would have them."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from PIL import Image

from proxytune.driving import (
    GroundPlaneCamera,
    draw_floor,
    lane_point,
    lane_pose,
    mounted_camera,
    read_robot,
    shipped_map,
)
from proxytune.effects import effects_from
from proxytune.logs import Log

Array = NDArray[np.float64]

ROAD = shipped_map("small_loop")
ROBOT = read_robot("duckiebot")
LAP_M = 4.0
PICTURES = "frames/%06d.png"
ROLLED = {"camera_pitch": 19.15, "camera_roll": 4.0}


def pictures(theta: Mapping[str, float], poses: Array, columns: int = 160) -> NDArray[np.uint8]:
    """What a camera with these effects on its mounting sees from poses (n, 3)."""
    mounted = mounted_camera(ROBOT, effects_from(theta, ROBOT.figures))
    figures = replace(mounted, columns=columns, rows=columns * 3 // 4)
    return GroundPlaneCamera(figures, draw_floor(ROAD)).render(poses)


def lane_poses(count: int, seed: int = 1) -> Array:
    """Poses in both lanes, all the way round, a little aside and askew (count, 3)."""
    random = np.random.default_rng(seed)
    rows = []
    for number, along in enumerate(np.linspace(0.0, LAP_M, count, endpoint=False)):
        place, ahead = (np.array(lane_point(ROAD, number % 2 == 0, along + step)) for step in (0.0, 0.01))
        heading = np.arctan2(*(ahead - place)[::-1])
        heading = heading if lane_pose(ROAD, place, heading).counter_clockwise == (number % 2 == 0) else heading + np.pi
        rows.append((*place, heading))
    return np.array(rows) + random.normal(0.0, (0.02, 0.02, 0.15), (count, 3))


def write_still_frames(folder: Path, theta: Mapping[str, float], poses: Array, columns: int = 160) -> Path:
    """A log of frames taken standing still, one a row."""
    write_pictures(folder, pictures(theta, poses, columns))
    table = pd.DataFrame(poses, columns=["x", "y", "heading"])
    table.insert(0, "time", np.arange(len(poses), dtype=float))
    table.insert(0, "episode", "stills")
    table.to_csv(folder / "samples.csv", index=False)
    (folder / "log.toml").write_text(log_text('command = "none"'), encoding="utf-8")
    return folder


def write_pictures(folder: Path, shown: NDArray[np.uint8]) -> None:
    """Pictures, numbered from 0."""
    (folder / "frames").mkdir(parents=True)
    for number, picture in enumerate(shown):
        Image.fromarray(picture).save(folder / (PICTURES % number))


def log_text(more: str) -> str:
    """A log.toml of a Duckiebot with frames."""
    camera = (
        f'[camera]\nframes = "{PICTURES}"\nposes = {{ position_m = 0.002, heading_deg = 0.3 }}\nexposure = "fixed"\n'
    )
    return f'format = 1\nname = "pictured"\nrobot = "duckiebot"\nmap = "small_loop"\n{more}\n{camera}'


def add_frames(folder: Path, log: Log, theta: Mapping[str, float], every: int, columns: int = 96) -> Path:
    """Frames of every so many rows, added to a log's folder with its commands and poses."""
    rows = [(e.name, time, pose) for e in log.episodes for time, pose in zip(e.times, e.poses, strict=True)][::every]
    write_pictures(folder, pictures(theta, np.array([pose for _, _, pose in rows]), columns))
    table = pd.DataFrame({"frame": range(len(rows)), "episode": [row[0] for row in rows], "time": [r[1] for r in rows]})
    table.to_csv(folder / "frames.csv", index=False)
    more = f'command = "{log.command}"\nrate_hz = {log.rate_hz}'
    (folder / "log.toml").write_text(log_text(more), encoding="utf-8")
    return folder
