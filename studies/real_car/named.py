"""Say what each of DART's known faults is worth to a diagnosis, and write the two logs that it is given.

    python studies/real_car/named.py FOLDER OUTPUT

FOLDER has the recordings that README.md names. OUTPUT gets the logs `fitted` and `kept`, with poses at every fifth row
and every command at its own time, and worth.csv: all effects are fitted to `fitted` together, then all but some, and
the errors of both are compared on `kept`.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from real_car import ROBOT, START

from proxytune.diagnosis.motion.clocks import split
from proxytune.diagnosis.motion.drives import Drives
from proxytune.diagnosis.motion.fitting import Fit, fit, intervals
from proxytune.diagnosis.motion.innovations import increments, log_likelihood
from proxytune.diagnosis.motion.prediction import blocks_of, cut, pose_errors, ratio
from proxytune.diagnosis.motion.random_effects import random_effects
from proxytune.effects import effect_of
from proxytune.logs import read_log

LOGS = {"fitted": ("free_1", "circles_1", "ramp_left"), "kept": ("free_2", "circles_2", "ramp_right")}
COLUMNS = {"vicon x": "x", "vicon y": "y", "vicon yaw": "heading", "throttle": "throttle", "steering": "steering",
           "safety_value": "enabled"}  # fmt: skip
POSES, COMMANDS = ["x", "y", "heading"], ["throttle", "steering", "enabled"]
EVERY = 5
"""One pose of so many is kept."""
HORIZONS_S = (1.0, 2.0, 5.0)
SEED = 1
DELAY_S = 0.02
"""Where the delay is looked for from beside all effects."""
INSTEAD: dict[tuple[str, ...], dict[str, float]] = {
    ("dead_band",): {"rolling.friction": 3.0},
    ("motor_lag",): {},
    ("steering_lag",): {"delay": 0.1},
    ("delay",): {},
    ("delay", "steering_lag"): {},
    ("tyres",): {},
    ("steering_friction",): {},
    ("marker_offset",): {},
}
"""Effects that are left out together, and where what may take their place is looked for from."""


def write_log(folder: Path, output: Path, name: str) -> np.ndarray:
    """Write a log; return how late each command would be if only every fifth row had it [s]."""
    samples, commands, late = [], [], []
    for drive in LOGS[name]:
        recorded = pd.read_csv(folder / f"{drive}.csv")
        table = recorded[list(COLUMNS)].rename(columns=COLUMNS)
        table.insert(0, "episode", drive)
        table.insert(1, "time", recorded["vicon time"] - recorded["vicon time"].iloc[0])
        new = np.flatnonzero((table[COMMANDS].diff().fillna(1.0) != 0.0).any(axis=1))
        samples.append(table.iloc[::EVERY][["episode", "time", *POSES]])
        commands.append(table.iloc[new][["episode", "time", *COMMANDS]])
        shown = -(-new // EVERY) * EVERY
        times = table["time"].to_numpy()
        late.append((times[shown[shown < len(times)]] - times[new[shown < len(times)]])[1:])
    (output / name).mkdir(parents=True, exist_ok=True)
    text = f'format = 1\nname = "{name}"\nrobot = "dart"\ncommand = "ackermann"\n'
    (output / name / "log.toml").write_text(text, encoding="utf-8")
    pd.concat(samples).to_csv(output / name / "samples.csv", index=False)
    pd.concat(commands).to_csv(output / name / "commands.csv", index=False)
    return np.concatenate(late)


def squares(drives: Drives, fitted: Fit) -> list[np.ndarray]:
    """Squared distances from where the car was, at each horizon [m²]."""
    return [pose_errors(drives, fitted.theta, cut(drives, horizon))[:, 0] ** 2 for horizon in HORIZONS_S]


def nats(fitted: Fit) -> float:
    """The log-likelihood of what the model was fitted to."""
    return log_likelihood(fitted.drives.measured - increments(fitted.drives, fitted.theta), fitted.whiten)


def main(folder: Path, output: Path) -> None:
    """Write the logs; fit all effects, and all but some; print and write what is compared."""
    late = np.concatenate([write_log(folder, output, name) for name in LOGS])
    print(f"in every fifth row {len(late)} commands are late by {late.mean():.3f} ± {late.std():.3f} s")
    logs = {name: read_log(output / name) for name in LOGS}
    drives, kept = split(logs["fitted"], ROBOT, logs["kept"])
    start = {**START, "delay": DELAY_S}
    whole = fit(drives, start, tuple((name,) for name in start))
    for name, (low, high) in intervals(whole).items():
        print(f"{name:25} {whole.theta[name]:8.3f} ({low:.3f} to {high:.3f})")
    with_all, rows = squares(kept, whole), []
    errors = zip(HORIZONS_S, with_all, strict=True)
    print("all effects:", *(f"{np.sqrt(one.mean()):.3f} m at {horizon:g} s" for horizon, one in errors))
    for found in random_effects(whole, SEED):
        print(f"{found.effect}: {found.gain:.0f} nats at {found.value:.2f}, and {found.left:.1f} deviations are left")
    for left_out, instead in INSTEAD.items():
        theta = {name: value for name, value in whole.theta.items() if effect_of(name) not in left_out} | instead
        less = fit(drives, theta, tuple((name,) for name in theta), whole.noise)
        row: dict[str, str | float] = {"without": " and ".join(left_out), "nats": nats(whole) - nats(less)}
        for horizon, one, other in zip(HORIZONS_S, squares(kept, less), with_all, strict=True):
            found = ratio(one, other, blocks_of(kept, cut(kept, horizon)))
            row |= {f"error_{horizon:g}_s": float(np.sqrt(one.mean())), f"ratio_{horizon:g}_s": found.value}
            row |= {f"low_{horizon:g}_s": found.interval[0], f"high_{horizon:g}_s": found.interval[1]}
        rows.append(row)
        print(*(f"{key} {value:.3f}" if isinstance(value, float) else value for key, value in row.items()), flush=True)
        print("   ", *(f"{name} {less.theta[name]:.3f}" for name in (*instead, "rolling.inertia")))
    pd.DataFrame(rows).to_csv(output / "worth.csv", index=False, float_format="%.4f")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python studies/real_car/named.py FOLDER OUTPUT")
    main(Path(sys.argv[1]), Path(sys.argv[2]))
