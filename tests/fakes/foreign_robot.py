"""A differential-drive robot of nobody's, simulated in code of its own, and its recordings in every form.

It is told `cmd_vel` at about 10 Hz with jitter, obeys after a latency, has a dead band on its wheels, a weak left wheel
and a motor lag; a tracker measures it at about 100 Hz with jitter, noise and drop-outs, by a clock of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

BASELINE_M, RADIUS_M, FULL_SPEED_M_S = 0.16, 0.033, 0.5
DEAD_BAND_M_S, LEFT_GAIN, LAG_S, LATENCY_S = 0.03, 0.95, 0.12, 0.06
COMMAND_S, COMMAND_JITTER_S = 0.1, 0.02
POSE_S, POSE_JITTER_S, LOST = 0.01, 0.0015, 0.01
PLACE_NOISE_M, HEADING_NOISE_RAD = 0.001, 0.003
STEP_S = 0.001
FOREIGN_TRUTH = {
    "dead_band.width": DEAD_BAND_M_S / FULL_SPEED_M_S,
    "wheel_gain.left": LEFT_GAIN,
    "motor_lag.time_constant": LAG_S,
    "delay": LATENCY_S,
}
"""What a model of it must have, by the names of θ."""

FIGURES = {"wheel_radius_m": RADIUS_M, "baseline_m": BASELINE_M, "full_speed_m_s": FULL_SPEED_M_S}

BAGS = ("ros1", "sqlite3", "mcap")
FORMS = (*BAGS, "csv", "tum")

EPOCH_S = 1_700_000_000.0
"""Stamps count from 1970, as a bag's do."""


@dataclass(frozen=True)
class Recording:
    """One drive as it was recorded."""

    issued: np.ndarray  # stamps of the commands (M,) [s]
    twists: np.ndarray  # commands (M, 2) [m/s, rad/s]
    measured: np.ndarray  # stamps of the poses (N,) [s], by the tracker's clock
    poses: np.ndarray  # x, y [m], heading [rad] (N, 3)


def drive(seed: int, *, seconds: float = 50.0, offset_s: float = 0.0) -> Recording:
    """A drive whose tracker stamps poses so much later than the robot stamps commands."""
    random = np.random.default_rng((seed, 3))
    issued = np.arange(0.5, seconds, COMMAND_S)
    issued = issued + random.uniform(-COMMAND_JITTER_S, COMMAND_JITTER_S, len(issued))
    twists = _manoeuvre(random, issued)
    times = np.arange(0.0, seconds, STEP_S)
    path = _path(random, times, issued, twists)
    measured = np.arange(0.05, seconds - 0.05, POSE_S)
    measured = measured + random.uniform(-POSE_JITTER_S, POSE_JITTER_S, len(measured))
    measured = measured[random.random(len(measured)) >= LOST]
    poses = np.stack([np.interp(measured, times, column) for column in path.T], axis=1)
    poses = poses + random.standard_normal(poses.shape) * (PLACE_NOISE_M, PLACE_NOISE_M, HEADING_NOISE_RAD)
    start = EPOCH_S + 1000.0 * seed
    return Recording(_microseconds(start + issued), twists, _microseconds(start + measured + offset_s), poses)


def _microseconds(times: np.ndarray) -> np.ndarray:
    """Stamps that every form can hold alike."""
    return np.rint(times * 1e6) / 1e6


def _manoeuvre(random: np.random.Generator, times: np.ndarray) -> np.ndarray:
    """Held speeds and turns of a second or two, fast and slow, both ways round, with rests."""
    changes = np.cumsum(random.uniform(0.6, 2.5, 200))
    levels = np.stack((random.uniform(-0.05, 0.3, 200), random.uniform(-2.0, 2.0, 200)), axis=1)
    levels[random.random(200) < 0.15] = 0.0
    levels[random.random(200) < 0.25, 1] = 0.0
    return np.asarray(np.round(levels[np.searchsorted(changes, times)], 3))


def _path(random: np.random.Generator, times: np.ndarray, issued: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """True poses at every time (T, 3)."""
    held = np.concatenate((np.zeros((1, 2)), twists))[np.searchsorted(issued + LATENCY_S, times, side="right")]
    turn = held[:, 1] * BASELINE_M / 2.0
    wheels = np.stack((held[:, 0] - turn, held[:, 0] + turn), axis=1)
    wheels = wheels - np.clip(wheels, -DEAD_BAND_M_S, DEAD_BAND_M_S)
    wheels[:, 0] *= LEFT_GAIN
    speed = np.zeros_like(wheels)
    for step in range(1, len(times)):
        speed[step] = speed[step - 1] + (wheels[step] - speed[step - 1]) * STEP_S / LAG_S
    forward, yaw = speed.mean(axis=1), (speed[:, 1] - speed[:, 0]) / BASELINE_M
    heading = random.uniform(-np.pi, np.pi) + np.cumsum(yaw) * STEP_S
    x, y = np.cumsum(forward * np.cos(heading)) * STEP_S, np.cumsum(forward * np.sin(heading)) * STEP_S
    return np.stack((x, y, heading), axis=1)


def write_own_times(folder: Path, recordings: Sequence[Recording]) -> Path:
    """A log's folder, as `import` would write it."""
    samples, commands = [], []
    for number, one in enumerate(recordings):
        samples.append(_table(number, one.measured, one.poses, ["x", "y", "heading"]))
        commands.append(_table(number, one.issued, one.twists, ["v", "omega"]))
    pd.concat(samples).to_csv(folder / "samples.csv", index=False)
    pd.concat(commands).to_csv(folder / "commands.csv", index=False)
    facts = "".join(f"{key} = {value}\n" for key, value in FIGURES.items())
    (folder / "log.toml").write_text(f'format = 1\nrobot = "nobodys"\ncommand = "twist"\n{facts}', encoding="utf-8")
    return folder


def _table(number: int, times: np.ndarray, values: np.ndarray, names: list[str]) -> pd.DataFrame:
    table = pd.DataFrame(values, columns=names)
    table.insert(0, "time", times)
    table.insert(0, "episode", f"run{number}")
    return table


def write_csv(folder: Path, number: int, recording: Recording) -> None:
    """One table of both, in nanoseconds, millimetres and degrees, wrapped."""
    poses = pd.DataFrame(recording.poses * (1e3, 1e3, 180.0 / np.pi), columns=["pos_x_mm", "pos_y_mm", "yaw_deg"])
    poses["yaw_deg"] = (poses["yaw_deg"] + 180.0) % 360.0 - 180.0
    poses.insert(0, "stamp_ns", _nanoseconds(recording.measured))
    commands = pd.DataFrame(recording.twists, columns=["cmd_lin", "cmd_ang"])
    commands.insert(0, "stamp_ns", _nanoseconds(recording.issued))
    table = pd.concat((poses, commands)).sort_values("stamp_ns", kind="stable")
    table.to_csv(folder / f"run{number}.csv", index=False, float_format="%.9g")


def _nanoseconds(times: np.ndarray) -> np.ndarray:
    return np.rint(times * 1e6).astype(np.int64) * 1000


def write_tum(folder: Path, number: int, recording: Recording) -> None:
    """A trajectory, and its commands in a file of their own beside it."""
    half = recording.poses[:, 2] / 2.0
    zero = np.zeros(len(half))
    columns = (recording.measured, *recording.poses[:, :2].T, zero, zero, zero, np.sin(half), np.cos(half))
    np.savetxt(folder / f"run{number}.tum", np.stack(columns, axis=1), fmt=["%.6f", *["%.9f"] * 7])
    commands = pd.DataFrame(recording.twists, columns=["v", "omega"])
    commands.insert(0, "time", [f"{time:.6f}" for time in recording.issued])
    commands.to_csv(folder / f"run{number}_cmd.csv", index=False)


def write_form(home: Path, form: str, recordings: Sequence[Recording]) -> Path:
    """The drives as one of FORMS, in a folder of that name."""
    folder = home / form
    folder.mkdir(parents=True)
    for number, one in enumerate(recordings):
        if form in BAGS:
            from bags import write_bag

            path = folder / (f"run{number}.bag" if form == "ros1" else f"run{number}")
            write_bag(path, form, (one.issued, one.twists), (one.measured, one.poses))
        elif form == "csv":
            write_csv(folder, number, one)
        else:
            write_tum(folder, number, one)
    return folder
