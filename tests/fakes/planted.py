"""Logs that proxytune's own planar model could have driven, with the noise that the filter assumes; logs on disk."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from manoeuvres import RATE_HZ, make_drives
from numpy.typing import NDArray

from proxytune.diagnosis import Drives, Fit
from proxytune.diagnosis.motion import curve_offer, discrepancy, screening
from proxytune.diagnosis.motion.clocks import cut_into_blocks
from proxytune.diagnosis.motion.drives import gather
from proxytune.diagnosis.motion.fitting import fit
from proxytune.diagnosis.motion.innovations import TURN_WEIGHT, Noise
from proxytune.driving import drivetrain, read_robot
from proxytune.driving.plants import integrate
from proxytune.effects import FilterContext, effects_from
from proxytune.logs import COMMANDS, Log, LogEpisode

Array = NDArray[np.float64]
Theta = Mapping[str, float]

TICKS = 3
TICK_HZ = float(TICKS * RATE_HZ)
ROBOT = read_robot("duckiebot")
NOISE = Noise((0.02, 0.01, 0.08), (0.002, 0.005))
CALM = Noise((0.002, 0.001, 0.008), (0.002, 0.005))
"""Drives so even that the noise of their poses is all that is left."""

DECLARED = (("trim",), ("delay",))
TRUTH = {"trim": 0.03, "delay": 0.12}
FEW = ("dead_band", "motor_lag", "stiction", "turn_slip", "yaw_scrub")


def look_for_few(patch: pytest.MonkeyPatch, *more: str) -> None:
    """Let diagnoses try FEW of the shipped effects and these, on one plant, and few curves: answers' use is tested."""
    for name, fewer in {"DUTY_KNOTS": 10, "RAMPS_S": (0.0, 0.4), "MOST_CORNERS": 20, "GRID": (1, 2)}.items():
        patch.setattr(curve_offer, name, fewer)
    patch.setattr(discrepancy, "ROUNDS", 2)
    patch.setattr("proxytune.diagnosis.motion.diagnose.has_body", lambda _: False)
    tried, left_out = screening.motion_effects, set(screening.MOTION_EFFECTS) - {*FEW, *more}
    patch.setattr(screening, "motion_effects", lambda every: tuple(one for one in tried(every) if one not in left_out))


def planted_log(
    theta: Theta, *, seed: int = 1, episodes: int = 4, seconds: float = 20.0, noise: Noise | None = NOISE
) -> Log:
    """A Duckiebot with these effects, 20 rows per second, from rest."""
    drives = make_drives(seed, episodes, round(seconds * RATE_HZ))
    return driven_log(theta, drives.duties, drives.starts, seed=seed, noise=noise)


def driven_log(theta: Theta, duties: Array, starts: Array, *, seed: int = 1, noise: Noise | None = NOISE) -> Log:
    """The same with duties (episodes, rows, 2) and starting poses (episodes, 3) of one's own."""
    twists = _twists(theta, duties, starts)
    random = np.random.default_rng(seed)
    if noise is not None:
        twists = twists + _disturbance(twists, noise, random)
    poses = np.concatenate((starts[:, None], integrate(starts, twists, 1.0 / TICK_HZ)), axis=1)[:, :-1:TICKS]
    if noise is not None:
        poses = poses + random.standard_normal(poses.shape) * (noise.pose[0], noise.pose[0], noise.pose[1])
    times = np.arange(poses.shape[1]) / RATE_HZ
    rows = (LogEpisode(f"{e:02d}", times, duties[e], poses[e], None) for e in range(len(duties)))
    return Log("planted", "duckiebot", "duty", float(RATE_HZ), {}, tuple(rows))


def _twists(theta: Theta, duties: Array, starts: Array) -> Array:
    train = drivetrain(ROBOT, effects_from({**ROBOT.theta, **theta}, ROBOT.figures, ROBOT.catalogue))
    nominal = {**ROBOT.figures, "control_rate": float(RATE_HZ)}
    context = FilterContext(
        TICK_HZ, np.zeros((len(duties), 2)), nominal, headings=starts[:, 2:], places=starts[:, None, :2]
    )
    return train.apply(np.repeat(duties, TICKS, axis=1), train.begin(context))[0]


def _disturbance(twists: Array, noise: Noise, random: np.random.Generator) -> Array:
    """White noise whose variance grows with the way: what the filter takes drive noise to be."""
    way = (np.abs(twists[..., 0]) + TURN_WEIGHT * np.abs(twists[..., 2])) / TICK_HZ
    return random.standard_normal(twists.shape) * noise.drive * np.sqrt(way)[..., None] * TICK_HZ


def planted_drives(theta: Theta, **more: object) -> Drives:
    """Drives of such a log, in blocks."""
    return drives_of(planted_log(theta, **more))


def drives_of(log: Log) -> Drives:
    """All of a log's drives, in blocks."""
    return cut_into_blocks(gather(log, ROBOT, log.episodes))


def fitted(drives: Drives) -> Fit:
    """Trim and delay fitted, from their nominal values."""
    return fit(drives, {"trim": 0.0, "delay": 0.15}, DECLARED)


def with_poses(log: Log, change: object) -> Log:
    """The log with its poses (rows, 3) passed through a function."""
    return replace(log, episodes=tuple(replace(e, poses=change(e.poses)) for e in log.episodes))


def write_log(log: Log, folder: Path, **keys: float | str) -> Path:
    """The log as a folder with log.toml and samples.csv; `keys` are added to log.toml."""
    folder.mkdir(parents=True, exist_ok=True)
    stated = {"format": 1, "name": log.name, "robot": log.robot, "command": log.command, "rate_hz": log.rate_hz, **keys}
    lines = [f"{key} = {value!r}".replace("'", '"') for key, value in stated.items()]
    (folder / "log.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    pd.concat([_table(log, episode) for episode in log.episodes]).to_csv(folder / "samples.csv", index=False)
    return folder


def _table(log: Log, episode: LogEpisode) -> pd.DataFrame:
    columns = {"episode": episode.name, "time": episode.times.round(6)}
    columns |= dict(zip(COMMANDS[log.command], episode.commands.T, strict=True))
    columns |= dict(zip(("x", "y", "heading"), episode.poses.T, strict=True))
    if episode.wheels is not None:
        columns |= dict(zip(("wheel_left", "wheel_right"), episode.wheels.T, strict=True))
    return pd.DataFrame(columns)
