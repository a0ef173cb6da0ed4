"""Run baselines: `python benchmarks/missing_effects/baselines.py DIR OUTPUT [--baselines NAME,…]`.

Each makes the entry OUTPUT/NAME. Cases that are finished are kept: a run that was stopped goes on where it was. What
needs a library imports it itself, so that any can run without the others' (requirements.txt).
"""

import argparse
import json
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))

from missing_effects import learned
from missing_effects.cases import Array, Case, FormatError, case_folders, read_case, write_drives, write_poses
from missing_effects.models import Fitted, fit, nominal, poses_of, twists


@dataclass(frozen=True)
class Answer:
    """What a baseline says of a case: poses (T, 3) of every held-out drive; names of effects, if it names any."""

    poses: Sequence[Array]
    names: tuple[str, ...] | None = None


def by_nominal_model(case: Case) -> Answer:
    """The maker's figures, nothing learnt."""
    figures = nominal(case.robot)
    return Answer(_paths(case, [twists(case.robot, figures, drive) for drive in case.held_out]))


NAMES = {
    "gain": "wheel_gain",
    "lag": "motor_lag",
    "track": "yaw_scrub",
    "friction": "dead_band",
    "steering_gain": "steering_gain",
    "steering_lag": "steering_lag",
}
"""What a figure of the textbook model that is not the maker's stands for."""


def by_least_squares(case: Case) -> Answer:
    """Gain, lag, track, friction, delay and trim by least squares; what is surely not the maker's figure is named."""
    fitted = fit(case.robot, case.drives)
    names = tuple(name for figure, name in NAMES.items() if figure in fitted.other)
    return Answer(_paths(case, [twists(case.robot, fitted.figures, drive) for drive in case.held_out]), names)


def _learnt(learn: Callable[[Case, Fitted], list[Array]]) -> Callable[[Case], Answer]:
    """A model that is learnt on top of the least squares; it names nothing."""
    return lambda case: Answer(_paths(case, learn(case, fit(case.robot, case.drives))))


def by_proxytune(case: Case) -> Answer:
    """`diagnose`, then `predict` with the model that it writes; the first name of each set of rivals counts.

    `predict` refuses a log with one pose a drive. It is given those of the maker's figures after the first: where a
    window is as long as the drive, it does not look at them.
    """
    import proxytune
    from proxytune.report.diagnosis.document import extended_model_text

    report = proxytune.diagnose(case.folder / "log")
    stand_in = by_nominal_model(case).poses
    drives = [replace(drive, poses=poses) for drive, poses in zip(case.held_out, stand_in, strict=True)]
    with tempfile.TemporaryDirectory() as folder:
        model, log = Path(folder) / "model.toml", Path(folder) / "held_out"
        model.write_text(extended_model_text(report.found), encoding="utf-8")
        write_drives(log / "samples.csv", drives, COMMANDS[case.robot["command"]])
        shutil.copy(case.folder / "held_out" / "log.toml", log)
        longest = max(float(drive.times[-1] - drive.times[0]) for drive in drives)
        table = proxytune.predict(model, log, horizon_s=longest).poses
    poses = {name: rows[["x", "y", "heading"]].to_numpy() for name, rows in table.groupby("episode")}
    return Answer([poses[drive.name] for drive in drives], report.effects)


COMMANDS = {
    "duty": ("left", "right"),
    "ackermann": ("throttle", "steering"),
    "speed_steering": ("speed", "steering_angle"),
}
"""Columns of samples.csv by kind of command."""


def _paths(case: Case, moved: Sequence[Array]) -> list[Array]:
    return [poses_of(one, drive.poses[0], drive.row_s) for one, drive in zip(moved, case.held_out, strict=True)]


BASELINES: Mapping[str, Callable[[Case], Answer]] = {
    "nominal": by_nominal_model,
    "proxytune": by_proxytune,
    "least_squares": by_least_squares,
    "pysindy": _learnt(learned.accelerations_by_pysindy),
    "gplearn": _learnt(learned.residual_by_gplearn),
    "gaussian_process": _learnt(learned.residual_by_gaussian_process),
    "neural_residual": _learnt(learned.residual_by_neural_network),
}


def run(folder: Path, output: Path, names: Sequence[str]) -> None:
    """Answer every case by every baseline, case by case, so that a run cut short has the same cases of each."""
    folders = case_folders(folder)
    for number, own in enumerate(folders, 1):
        case = read_case(own)
        for name in names:
            entry = output / name
            if (entry / f"{case.name}.json").exists():
                continue
            began = time.process_time()
            answer = BASELINES[name](case)
            seconds = time.process_time() - began
            write_poses(entry / f"{case.name}.csv", case.held_out, answer.poses)
            told = {"effects": answer.names, "seconds": round(seconds, 2)}
            (entry / f"{case.name}.json").write_text(json.dumps(told) + "\n", encoding="utf-8")
            print(f"{number} of {len(folders)} {name}: {seconds:.1f} s, {answer.names}", file=sys.stderr, flush=True)


def main() -> int:
    """Run the baselines asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="DIR", help="what write.py wrote")
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="where the entries go, a folder each")
    parser.add_argument("--baselines", default=",".join(BASELINES), help="which, separated by commas")
    asked = parser.parse_args()
    names = asked.baselines.split(",")
    if unknown := [name for name in names if name not in BASELINES]:
        parser.error(f"no baseline '{unknown[0]}'; there are {', '.join(BASELINES)}")
    warnings.filterwarnings("ignore")  # of learners about their own progress
    try:
        run(asked.folder, asked.output, names)
    except FormatError as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
