"""One drive of a fictitious robot, and the four forms of file that others would write it in."""

import numpy as np

ROWS = 60
STEP_S = 0.05
TIMES = 1_700_000_000.0 + STEP_S * np.arange(ROWS)
SPEEDS = np.column_stack((0.3 + 0.1 * np.sin(np.arange(ROWS) / 5), 0.7 + 0.2 * np.cos(np.arange(ROWS) / 7)))
TURNED = 2.0 + STEP_S * np.concatenate(([0.0], np.cumsum(SPEEDS[:-1, 1])))
HEADINGS = np.arctan2(np.sin(TURNED), np.cos(TURNED))
STEPS = STEP_S * SPEEDS[:, :1] * np.column_stack((np.cos(TURNED), np.sin(TURNED)))
PLACES = np.array([1.5, -0.5]) + np.vstack((np.zeros((1, 2)), np.cumsum(STEPS[:-1], axis=0)))


def write(path, header, columns, separator=","):
    """Write a text table."""
    rows = (separator.join(f"{value:.17g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def write_csv(folder):
    """A CSV file in ns, mm and deg."""
    stamps = [int(stamp) for stamp in np.rint((TIMES - 1.7e9) * 1e9).astype(int) + 1_700_000_000 * 10**9]
    columns = (PLACES[:, 0] * 1e3, PLACES[:, 1] * 1e3, np.degrees(HEADINGS), SPEEDS[:, 0], SPEEDS[:, 1])
    rows = (f"{stamp}," + ",".join(f"{v:.12g}" for v in row) for stamp, *row in zip(stamps, *columns, strict=True))
    (folder / "run1.csv").write_text("\n".join(["stamp_ns,pos_x_mm,pos_y_mm,yaw_deg,cmd_lin,cmd_ang", *rows]) + "\n")
    return folder / "run1.csv"


def write_tum(folder):
    """A TUM trajectory with its commands beside it."""
    zero = np.zeros(ROWS)
    turned = (zero, zero, np.sin(HEADINGS / 2), np.cos(HEADINGS / 2))
    path = write(folder / "run1.tum", "# time x y z qx qy qz qw", (TIMES, *PLACES.T, zero, *turned), " ")
    write(folder / "run1_commands.csv", "time,v,omega", (TIMES, *SPEEDS.T))
    return path


def write_mrclam(folder, robot="Robot1"):
    """The two files of a robot of the MRCLAM data set."""
    write(folder / f"{robot}_Odometry.dat", "# Time [sec]  forward [m/s]  angular [rad/s]", (TIMES, *SPEEDS.T), " \t ")
    return write(folder / f"{robot}_Groundtruth.dat", "# Time x y heading", (TIMES, *PLACES.T, HEADINGS), "   ")


def write_arrays(folder, **changes):
    """gym-duckietown's arrays."""
    arrays = {
        "timestamps": TIMES,
        "actions": SPEEDS,
        "positions": np.column_stack((PLACES[:, 0], np.zeros(ROWS), -PLACES[:, 1])),
        "angles": HEADINGS,
        **changes,
    }
    np.savez(folder / "run1.npz", **{name: array for name, array in arrays.items() if array is not None})
    return folder / "run1.npz"
