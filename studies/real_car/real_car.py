"""Fit DART's effects and compare with three yardsticks on drives kept aside: figures and tables of this study.

    python studies/real_car/real_car.py FOLDER OUTPUT

FOLDER has the recordings that README.md names. OUTPUT gets model.toml, errors.csv, effects.csv and errors.png.
"""

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from scipy.optimize import least_squares
from yardsticks import AROUND, STEP_S, Array, Drive, Physics, Yardstick, constant_velocity, fitted_bicycle, turned

from proxytune.diagnosis.motion.innovations import integrate_twists
from proxytune.driving import drivetrain, read_robot
from proxytune.effects import FilterContext, Model, effects_from, model_text

matplotlib.use("Agg")
from matplotlib import pyplot as plt

FITTED = ("free_1", "circles_1", "circles_2", "ramp_left")
KEPT = ("free_2", "ramp_right")
OTHER_FLOOR = "tape_and_tiles"
HORIZONS_S = (1.0, 2.0)
MOVED_M = 0.05
"""Windows in which the car moves less are no prediction."""

EVERY, SCALE, TURN = 25, 0.05, 0.15
"""Samples between windows, error at which one counts less [m], and metres that a radian counts as."""

START: Mapping[str, float] = {
    "dead_band": 0.16, "motor_lag": 0.08, "rolling.inertia": 0.3, "rolling.freewheel": 0.9, "rolling.friction": 0.7,
    "rolling.drag": 0.3, "steering_lag": 0.13, "steering_offset": -0.02, "steering_curve.left": 20.0,
    "steering_curve.right": 23.0, "steering_curve.left_bend": 1.2, "steering_curve.right_bend": 1.0,
    "steering_friction": 0.1, "tyres.slide": 0.1, "tyres.rear_slip": 0.01, "marker_offset.forward": 0.11,
    "marker_offset.left": 0.0, "heading_offset": 0.0,
}  # fmt: skip
FLOORS = ("steering_friction", "tyres.slide", "tyres.rear_slip")
"""What another floor may change."""

AUTHORS = {
    "dead_band": "0.164, and friction holds the car up to 0.22",
    "motor_lag": "0.084",
    "steering_lag": "0.129",
    "tyres.slide": "0.125: their front tyres hold 8.0 m/s²",
    "steering_friction": "0.5 at a throttle of 0.4",
    "marker_offset.forward": "0.115",
    "marker_offset.left": "-0.010",
    "heading_offset": "-0.44",
    "steering_offset": "-0.027",
    "steering_curve.left": "18.5",
    "steering_curve.right": "22.7",
}
"""Of the effects that they measured or fitted, in the same units."""

ROBOT = read_robot("dart")
Theta = Mapping[str, float]


def read(folder: Path, name: str) -> Drive:
    """A recording on a grid of 100 samples a second; the switch cuts the throttle."""
    table = pd.read_csv(folder / f"{name}.csv")
    times = table["vicon time"].to_numpy() - table["vicon time"].iloc[0]
    grid = np.arange(0.0, times[-1], STEP_S)
    poses = (table["vicon x"], table["vicon y"], np.unwrap(table["vicon yaw"]))
    row = np.searchsorted(times, grid + 1e-9, side="right") - 1
    throttle = (table["throttle"] * table["safety_value"]).to_numpy()
    moved = np.stack([np.interp(grid, times, column) for column in poses], axis=-1)
    return Drive(moved, throttle[row], table["steering"].to_numpy()[row])


def model_of(theta: Theta) -> Yardstick:
    """What θ predicts: commands alone from the drive's beginning, placed at the measured pose of the window's."""

    def predicted(drive: Drive, starts: Array, steps: int) -> Array:
        train = drivetrain(ROBOT, effects_from(theta, ROBOT.figures, ROBOT.catalogue))
        setting = FilterContext(rate_hz=1.0 / STEP_S, rest=np.zeros((1, 2)), nominal=ROBOT.figures)
        commands = np.stack((drive.throttle, drive.steering), axis=-1)[None]
        walked = integrate_twists(train.apply(commands, train.begin(setting))[0], STEP_S)[0]
        shift = [np.full(len(walked), theta.get(f"marker_offset.{side}", 0.0)) for side in ("forward", "left")]
        marker = walked[:, :2] + np.stack(turned(*shift, walked[:, 2]), axis=-1)
        rotation = drive.poses[starts, 2] - walked[starts, 2] - np.radians(theta.get("heading_offset", 0.0))
        x, y = turned(*(marker[starts + steps] - marker[starts]).T, rotation)
        turn = walked[starts + steps, 2] - walked[starts, 2]
        return drive.poses[starts] + np.stack((x, y, turn), axis=-1)

    return predicted


def windows(drive: Drive, steps: int) -> Array:
    """Samples at which windows start."""
    return np.arange(AROUND, len(drive.poses) - steps, EVERY)


def fit(drives: Iterable[Drive], theta: Theta, free: Iterable[str]) -> dict[str, tuple[float, float, float]]:
    """Values and 95 % intervals of parameters, fitted to windows of 0.3 s and 1 s; blocks of 5 s are independent."""
    drives, free = list(drives), tuple(free)
    bounds = np.array([(ROBOT.catalogue.parameters[n].low, ROBOT.catalogue.parameters[n].high) for n in free]).T
    span = bounds[1] - bounds[0]
    cuts = [(drive, windows(drive, steps), steps) for steps in (30, 100) for drive in drives]

    def gaps(values: Array) -> Array:
        model = model_of({**theta, **dict(zip(free, values, strict=True))})
        parts = [(model(d, s, n) - d.poses[s + n]) * (1.0, 1.0, TURN) / (n * STEP_S) for d, s, n in cuts]
        return np.concatenate([part.ravel() for part in parts])

    start = np.clip([theta[name] for name in free], bounds[0] + 1e-3 * span, bounds[1] - 1e-3 * span)
    found = least_squares(
        gaps, start, bounds=bounds, x_scale=span / 20, loss="soft_l1", f_scale=SCALE, max_nfev=40, diff_step=1e-3
    )
    block = np.concatenate(
        [np.repeat(1000 * (number % len(drives)) + s // 500, 3) for number, (_, s, _) in enumerate(cuts)]
    )
    # scipy's Jacobian carries the loss' own scale
    square = 1.0 + (found.fun / SCALE) ** 2
    pulls = found.jac * (square**0.75 * found.fun / np.sqrt(square))[:, None]
    sums = np.array([pulls[block == one].sum(axis=0) for one in np.unique(block)])
    inverse = np.linalg.pinv(found.jac.T @ found.jac)
    half = 1.96 * np.sqrt(np.diag(inverse @ (sums.T @ sums) @ inverse))
    triples = zip(found.x, found.x - half, found.x + half, strict=True)
    return {name: tuple(map(float, triple)) for name, triple in zip(free, triples, strict=True)}


def error(model: Yardstick, drives: Iterable[Drive], horizon_s: float) -> float:
    """Root mean square error of the place at a horizon [m], over windows in which the car moves."""
    steps, far = round(horizon_s / STEP_S), []
    for drive in drives:
        starts = windows(drive, steps)
        moved = np.hypot(*(drive.poses[starts + steps] - drive.poses[starts])[:, :2].T) > MOVED_M
        far.append(np.hypot(*(model(drive, starts, steps) - drive.poses[starts + steps])[:, :2].T)[moved])
    return float(np.sqrt(np.mean(np.concatenate(far) ** 2)))


def draw(table: pd.DataFrame, path: Path) -> None:
    """Bars of errors at 2 s, the drives that were kept aside."""
    own = table[table.horizon_s == HORIZONS_S[-1]].set_index("drive")[list(table.columns[2:])].loc[[*KEPT]]
    figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    own.plot.barh(ax=axes, color=("#bbbbbb", "#88aacc", "#ddaa55", "#cccc66", "#227744"), width=0.8)
    axes.set(xlabel=f"error after {HORIZONS_S[-1]:g} s [m]", ylabel="", xscale="log")
    ticks = (0.2, 0.5, 1.0, 2.0, 5.0)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=120)


def main(folder: Path, output: Path) -> None:
    """Fit, compare, and write."""
    output.mkdir(parents=True, exist_ok=True)
    drives = {name: read(folder, name) for name in (*FITTED, *KEPT, OTHER_FLOOR)}
    found = fit([drives[name] for name in FITTED], START, START)
    theta = {name: value for name, (value, _, _) in found.items()}
    models: dict[str, Yardstick] = {
        "constant velocity": constant_velocity,
        "bicycle, fitted": fitted_bicycle([drives[name] for name in FITTED]),
        "authors' physics": Physics(),
        "robot.toml alone": model_of({}),
        "with its effects": model_of(theta),
    }
    judged = {name: [drive] for name, drive in drives.items()} | {" and ".join(KEPT): [drives[name] for name in KEPT]}
    rows = [
        {"drive": name, "horizon_s": horizon, **{m: error(model, some, horizon) for m, model in models.items()}}
        for name, some in judged.items()
        for horizon in HORIZONS_S
    ]
    table = pd.DataFrame(rows)
    table.to_csv(output / "errors.csv", index=False, float_format="%.3f")
    tiles = fit([drives[OTHER_FLOOR]], theta, FLOORS)
    blank = ("", "", "")
    effects = [(n, *found[n], *tiles.get(n, blank), AUTHORS.get(n, "")) for n in found]
    columns = ["parameter", "rubber", "low", "high", "tiles", "tiles_low", "tiles_high", "authors"]
    pd.DataFrame(effects, columns=columns).to_csv(output / "effects.csv", index=False, float_format="%.4f")
    comment = f"fitted to {', '.join(FITTED)} of DART"
    model = Model(ROBOT.name, None, theta, {})
    (output / "model.toml").write_text(model_text(model, [comment], ROBOT.catalogue), encoding="utf-8")
    draw(table, output / "errors.png")
    print(
        table.round(3).to_string(index=False), pd.DataFrame(effects, columns=columns).to_string(index=False), sep="\n\n"
    )
    changed = model_of({**theta, **{name: value for name, (value, _, _) in tiles.items()}})
    print(
        "\ntape and tiles with its own floor:", *(f"{error(changed, [drives[OTHER_FLOOR]], h):.3f}" for h in HORIZONS_S)
    )


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python studies/real_car/real_car.py FOLDER OUTPUT")
    main(Path(sys.argv[1]), Path(sys.argv[2]))
