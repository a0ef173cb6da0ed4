"""The textbook model of a robot: trim, delay, a gain, lags, a track and Coulomb friction; its fit by least squares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from missing_effects.cases import Array, Drive
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.stats import t as student

STEP_S = 0.005
"""The model holds commands and speeds over steps of this length."""

Figures = Mapping[str, float]


def nominal(robot: Mapping[str, Any]) -> dict[str, float]:
    """The figures that the maker states, and neutral ones."""
    lag = robot["motor_time_constant_s"]
    if robot["drive"] == "differential":
        return {
            "trim": 0.0,
            "delay": robot["delay_s"],
            "gain": 1.0,
            "lag": lag,
            "track": robot["baseline_m"],
            "friction": 0.0,
        }
    steering = {"steering_lag": robot["steering_time_constant_s"], "steering_gain": 1.0}
    return {"offset": 0.0, "delay": robot["delay_s"], "gain": 1.0, "lag": lag, **steering, "friction": 0.0}


def twists(robot: Mapping[str, Any], figures: Figures, drive: Drive) -> Array:
    """Mean forward speed [m/s] and yaw rate [rad/s] of the model from each row to the next (T - 1, 2)."""
    per_row = round(drive.row_s / STEP_S)
    asked = np.repeat(shares(robot, drive.commands[:-1]), per_row, axis=0)
    arrived = _delayed(asked, figures["delay"])
    driven = np.sign(arrived) * np.maximum(0.0, np.abs(arrived) - figures["friction"])
    full = robot["full_speed_m_s"] * figures["gain"]
    if robot["drive"] == "differential":
        left, right = (_lagged(driven, figures["lag"]) * full * (1.0 - figures["trim"], 1.0 + figures["trim"])).T
        fine = np.stack(((left + right) / 2.0, (right - left) / figures["track"]), axis=1)
    else:
        speed = _lagged(driven[:, 0], figures["lag"]) * full
        steering = _lagged(arrived[:, 1], figures["steering_lag"]) * figures["steering_gain"] + figures["offset"]
        angle = np.clip(np.radians(robot["full_lock_deg"]) * steering, -1.4, 1.4)
        fine = np.stack((speed, speed * np.tan(angle) / robot["wheelbase_m"]), axis=1)
    return fine.reshape(-1, per_row, 2).mean(axis=1)


def shares(robot: Mapping[str, Any], commands: Array) -> Array:
    """Commands as shares of what the robot can do, in [-1, 1]."""
    if robot["command"] == "speed_steering":
        return commands / (robot["full_speed_m_s"], np.radians(robot["full_lock_deg"]))
    return commands


def in_force(robot: Mapping[str, Any], delay: float, drive: Drive) -> Array:
    """Mean share (T - 1, 2) that has arrived, from each row to the next."""
    per_row = round(drive.row_s / STEP_S)
    asked = np.repeat(shares(robot, drive.commands[:-1]), per_row, axis=0)
    return _delayed(asked, delay).reshape(-1, per_row, 2).mean(axis=1)


def _delayed(signal: Array, delay: float) -> Array:
    """A signal some seconds later, between steps a mixture; zero before its beginning."""
    whole, part = divmod(max(delay, 0.0) / STEP_S, 1.0)
    early, late = (_shifted(signal, int(whole) + more) for more in (0, 1))
    return (1.0 - part) * early + part * late


def _shifted(signal: Array, steps: int) -> Array:
    return np.concatenate((np.zeros_like(signal[:steps]), signal))[: len(signal)]


def _lagged(signal: Array, lag: float) -> Array:
    kept = np.exp(-STEP_S / max(lag, 1e-3))
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], signal, axis=0))


def poses_of(moved: Array, start: Array, row_s: float) -> Array:
    """Poses (T, 3) of forward speeds and yaw rates (T - 1, 2), each held over a row: arcs of circles."""
    turns = moved[:, 1] * row_s
    headings = start[2] + np.concatenate(([0.0], np.cumsum(turns)))
    chords = moved[:, 0] * row_s * np.sinc(turns / (2.0 * np.pi)) * np.exp(1j * (headings[:-1] + turns / 2.0))
    places = start[0] + 1j * start[1] + np.concatenate(([0.0], np.cumsum(chords)))
    return np.stack((places.real, places.imag, headings), axis=1)


def measured_twists(drive: Drive, rows: int) -> Array:
    """Mean forward speed and yaw rate measured over the next `rows` rows (T - rows, 2); NaN where a pose is missing."""
    start, end = drive.poses[:-rows], drive.poses[rows:]
    turn = np.angle(np.exp(1j * (end - start)[:, 2]))
    chord = (end - start)[:, :2] @ np.array((1.0, 1.0j)) * np.exp(-1j * (start[:, 2] + turn / 2.0))
    return np.stack((chord.real / np.sinc(turn / (2.0 * np.pi)), turn), axis=1) / (rows * drive.row_s)


RANGES: Mapping[str, tuple[float, float]] = {
    "trim": (-0.5, 0.5),
    "offset": (-0.5, 0.5),
    "delay": (0.0, 0.6),
    "gain": (0.3, 3.0),
    "lag": (0.005, 1.5),
    "track": (0.05, 1.0),
    "steering_lag": (0.005, 1.5),
    "steering_gain": (0.3, 3.0),
    "friction": (0.0, 0.4),
}
"""What may be fitted, and within what."""

WINDOWS_S, BETWEEN_S = (1.0, 2.0), 0.5
SCALE = (0.01, 0.01, 0.03)
"""The multistep error: over which times, how far apart, and what counts the same, ahead and left [m] and turn [rad]."""

SURE = 0.999
"""How sure it must be that a figure is not the maker's."""


@dataclass(frozen=True)
class Fitted:
    """Figures of the textbook model, and which of them differ from the maker's beyond what chance would make of it."""

    figures: dict[str, float]
    other: frozenset[str]


def fit(robot: Mapping[str, Any], drives: Sequence[Drive]) -> Fitted:
    """Least squares on the multistep error, from the maker's figures on; intervals take each drive for one draw."""
    start = nominal(robot)
    names = tuple(start)
    low, high = np.array([RANGES[name] for name in names]).T
    begin = np.clip([start[name] for name in names], low + 1e-6, high - 1e-6)

    def misses(values: Array) -> Array:
        figures = dict(zip(names, values.tolist(), strict=True))
        return np.concatenate([_misses(drive, twists(robot, figures, drive)) for drive in drives])

    best = least_squares(misses, begin, bounds=(low, high), x_scale=np.maximum(np.abs(begin), 0.05), diff_step=1e-3)
    parts = np.array_split(np.arange(len(best.fun)), len(drives))
    slopes = np.array([best.jac[part].T @ best.fun[part] for part in parts])
    inverse = np.linalg.pinv(best.jac.T @ best.jac)
    spread = np.sqrt(np.diag(inverse @ (slopes.T @ slopes) @ inverse) * len(drives) / max(1, len(drives) - 1))
    reach = spread * student.ppf(0.5 + SURE / 2.0, max(1, len(drives) - 1))
    apart = np.abs(best.x - [start[name] for name in names]) > reach
    return Fitted(dict(zip(names, best.x.tolist(), strict=True)), frozenset(np.array(names)[apart].tolist()))


def _misses(drive: Drive, moved: Array) -> Array:
    poses, step = poses_of(moved, np.zeros(3), drive.row_s), round(BETWEEN_S / drive.row_s)
    both = ((_windows(one, round(s / drive.row_s), step) for one in (poses, drive.poses)) for s in WINDOWS_S)
    apart = np.concatenate([said - seen for said, seen in both])
    apart[:, 2] = np.angle(np.exp(1j * apart[:, 2]))
    return np.nan_to_num(apart / SCALE).ravel()


def _windows(poses: Array, rows: int, step: int) -> Array:
    """Motion over `rows` rows, ahead, left [m] and turn [rad], seen from where each window begins (W, 3)."""
    start, end = poses[:-rows:step], poses[rows::step]
    ahead = (end - start)[:, :2] @ np.array((1.0, 1.0j)) * np.exp(-1j * start[:, 2])
    return np.stack((ahead.real, ahead.imag, (end - start)[:, 2]), axis=1)


def error(predicted: Sequence[Array], drives: Sequence[Drive]) -> float:
    """Mean square of the multistep error of forward speeds and yaw rates of drives, to choose between models."""
    return float(np.mean([np.mean(_misses(d, moved) ** 2) for moved, d in zip(predicted, drives, strict=True)]))
