"""Exports: what was found for other simulators and robots, a study's trials for other optimisers, and a filter."""

import filecmp
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from proxytune import driving, report
from proxytune.api.study import read_study
from proxytune.effects import Catalogue, FilterContext, effect_of
from proxytune.errors import InputError
from proxytune.files import check_place, write_whole
from proxytune.search import History, write_optuna, write_skopt
from proxytune.settings import check_numbers, figure_cautions, nearest
from proxytune.space import Theta
from proxytune.study import FILE_NAME, bare_family, read_study_settings, study_around

TRIALS: Mapping[str, Callable[[History, Path], None]] = {"optuna": write_optuna, "skopt": write_skopt}
"""Formats that take the trials of a study, not what was found."""
WRITERS: Mapping[str, Callable[[report.Instance], str]] = {
    "urdf": report.urdf_text,
    "mjcf": report.mjcf_text,
    "ros": report.ros_text,
}
NO_RATE_HZ = 20.0
"""A robot without a folder has no rate of control; none of the formats states one."""
COMMANDS = {"differential": ("twist", "duty"), "ackermann": ("twist", "ackermann", "speed_steering")}
"""What a filter takes, by how the robot drives."""
AT_REST_M_S = 1e-6


@dataclass(frozen=True, repr=False)
class ExportReport:
    """Result of an export: what was written for another simulator, the robot or another optimiser.

    Attributes:
        output: The file.
        to: Its format.
        lines: Each parameter with its place in the file, or without one; none where trials were written.
        facts: What `export --json` says beside them.
    """

    output: Path
    to: str
    lines: Sequence[report.ExportLine]
    facts: Mapping[str, Any]

    def __repr__(self) -> str:
        return f"ExportReport of {self.output} ({self.to})"

    def _repr_html_(self) -> str:
        return report.frame_html(repr(self), self.table())

    def table(self) -> pd.DataFrame:
        """One row per parameter: value, interval, unit, and its place in the file."""
        return pd.DataFrame([_row(line) for line in self.lines] or [dict(self.facts)])

    to_frame = table

    def document(self) -> dict[str, Any]:
        """The JSON document of `export --json`."""
        rows = {
            "written": [_row(line) for line in self.lines if line.place],
            "no_place": [_row(line) for line in self.lines if not line.place],
        }
        return {"output": str(self.output), "to": self.to, **self.facts, **({} if self.to in TRIALS else rows)}


def export(
    model: str | Path,
    output: str | Path,
    *,
    to: str = "",
    into: str | Path | None = None,
    wheels: Sequence[str] = (),
    has: str | Sequence[str] = (),
) -> ExportReport:
    """Write what was found for another simulator or the robot, or a study's trials for other optimisers.

    Args:
        model: A model.toml, or a study's folder: its best θ.
        output: The file to write.
        to: "urdf", "mjcf", "ros" or "filter"; of a study also "optuna" or "skopt".
        into: A URDF, SDF or MuJoCo model of yours, of which `output` becomes a patched copy; in place of `to`.
        wheels: Joints of the left and the right wheel in that file; found where they are not given.
        has: Effects that the simulator behind a filter has already.

    Raises:
        InputError: If what is given cannot be exported so.
        RunError: If the file cannot be written.
    """
    path, file = Path(model), Path(output)
    if bool(to) == (into is not None):
        raise InputError("give either --to FORMAT for a new file, or --into FILE for a patched copy of yours")
    if has and to != report.FILTER:
        raise InputError("--has: is for --to filter; leave it out")
    if wheels and into is None:
        raise InputError("--wheels: is for --into FILE; leave it out")
    settings = read_study_settings(path) if (path / FILE_NAME).is_file() or study_around(path) else None
    elsewhere = (settings.folder, *settings.targets) if settings else ()
    check_place(file, inputs=filter(None, (path, into, *path.glob("*.csv"), *elsewhere)))
    if to in TRIALS:
        return _export_trials(path, file, to)
    if to and to not in (report.FILTER, *WRITERS):
        raise InputError(f"--to {to}: no such format; {nearest(to, (report.FILTER, *WRITERS, *TRIALS))}")
    instance, cautions = _instance_of(path)
    check_place(file, inputs=robot_files(instance.robot.name, instance.robot.catalogue.folder))
    told: dict[str, Any] = {"robot": instance.robot.name, "cautions": list(cautions)}
    if into is not None:
        given = Path(into)
        patched = report.patch(instance, given, file, wheels)
        report.write_text(file, patched.text)
        facts = told | {"into": str(given), "has": sorted(patched.has), "diff": patched.diff}
        return ExportReport(file, given.suffix[1:], report.export_lines(instance, report.FILTER, patched.has), facts)
    there = _names_of(has, instance.robot.catalogue, "--has ") if to == report.FILTER else ()
    report.write_text(file, report.node_text(instance, there) if to == report.FILTER else WRITERS[to](instance))
    return ExportReport(file, to, report.export_lines(instance, to, there), told)


def robot_files(name: str, folder: Path | None) -> tuple[Path, ...]:
    """The folder and the body that a robot is read from; none where it is unknown."""
    if not driving.is_robot(name, folder):
        return ()
    return tuple(filter(None, (driving.robot_home(name, folder), driving.read_robot(name, folder).urdf)))


def _names_of(has: str | Sequence[str], catalogue: Catalogue, what: str) -> tuple[str, ...]:
    """Effects that a simulator has already; a text is one of them."""
    names = (has,) if isinstance(has, str) else tuple(has)
    for name in names:
        if not catalogue.knows(name):
            raise InputError(f"{what}{name}: no such effect; {nearest(name, catalogue.names)}")
    return names


def _export_trials(folder: Path, output: Path, to: str) -> ExportReport:
    """Write all trials of a study; a file that is there may be a storage with other studies, and only the same goes."""
    if not folder.is_dir():
        raise InputError(f"{folder}: --to {to} takes the trials of a study; give the study's folder")
    history = read_study(folder).history()

    def write(draft: Path) -> None:
        TRIALS[to](history, draft)
        if output.exists() and not filecmp.cmp(output, draft, shallow=False):
            raise InputError(f"{output}: is there already; give another name, or move it away")

    write_whole(output, write)
    return ExportReport(output, to, (), {"name": history.name, "trials": len(history.trials)})


def _row(line: report.ExportLine) -> dict[str, Any]:
    interval = list(line.interval) if line.interval else None
    return asdict(line) | {"interval": interval, "place": line.place or None}


def _instance_of(path: Path) -> tuple[report.Instance, tuple[str, ...]]:
    """A study's best θ with its 95 % intervals, or a model.toml and its cautions.

    A model's robot and its own effects are looked for in the current folder.
    """
    if (diagnosed := path / "model.toml").is_file() and not (path / FILE_NAME).exists():
        raise InputError(f"{path}: is no study's folder; give what was diagnosed, {diagnosed}")
    if path.is_dir():
        settings = read_study_settings(path)
        ours = settings.family.startswith("proxytune.driving")
        # Its agents, which may be a user's code, are not asked for
        family = bare_family(replace(settings, agents=()), settings.proxy) if ours else None
        if not isinstance(family, driving.LaneFollowing):
            raise InputError(f"{path}: is a study of another simulator; only what drives here can be exported")
        result = read_study(path).result
        region = result.knowledge
        robot = driving.read_robot(family.robot, family.folder)
        theta = {**robot.theta, **dict(family.effects), **result.best.trial.theta}
        return report.Instance(robot, theta, dict(region.intervals), f"the best θ of the study {settings.name}"), ()
    model = driving.read_model_of(path, Path.cwd())
    catalogue = driving.catalogue_of(model.robot, Path.cwd())
    if driving.is_robot(model.robot, catalogue.folder):
        robot = driving.read_robot(model.robot, catalogue.folder)
    elif model.geometry:
        robot = driving.robot_from_geometry(model.robot, model.geometry, NO_RATE_HZ)
    else:
        remedy = f"go to the folder that {model.robot} lies in"
        raise InputError(f"{path}: its robot '{model.robot}' is unknown here; {remedy}")
    cautions = (*model.cautions, *figure_cautions(robot.figures, f"robot {robot.name}"))
    return report.Instance(robot, {**robot.theta, **model.theta}, model.intervals, str(path)), cautions


class CommandFilter:
    """A filter before any simulator's step: its robot then moves as the one that was measured.

    Commands are bent as the model's command, actuation and motion effects do it, and told as what the simulator has to
    be asked for, so that it moves so. Effects of place and heading go by dead reckoning from `start` on.

    Args:
        model: A model.toml, a study's folder, or values by name in θ, with `figures` beside them.
        rate_hz: How often `step` is called per second; a command holds from one call to the next.
        command: "twist" for forward speed [m/s] and yaw rate [rad/s], "duty" for left and right in [−1, 1]; of a car
            "twist", "ackermann" for throttle and steering in [−1, 1], or "speed_steering" for speed [m/s] and the
            wheels' angle [rad].
        has: Effects that the simulator has already, as those that `export --into` wrote into its file.
        start: x, y [m] and heading [rad] at the start.
        seed: Seed of jitter and lost commands.
        figures: The robot's nominal figures, where the model is values; a car's have its wheelbase.
        reverse: Whether it drives backwards too, where the model is values.

    Raises:
        InputError: If the model, or an argument, cannot be used.
    """

    def __init__(
        self,
        model: str | Path | Theta,
        *,
        rate_hz: float,
        command: str = "twist",
        has: str | Sequence[str] = (),
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        seed: int = 0,
        figures: Mapping[str, float] | None = None,
        reverse: bool = True,
    ) -> None:
        if not (np.isfinite(rate_hz) and rate_hz > 0.0):
            raise InputError(f"rate_hz={rate_hz}: must be a positive number of calls per second")
        if isinstance(model, Mapping):
            if figures is None:
                raise InputError("figures: must be given where the model is values; take them from robot.toml")
            check_numbers(model)
            drive = "ackermann" if "wheelbase" in figures else "differential"
            robot = driving.Robot("given", "", dict(figures), {}, None, Catalogue(Path.cwd(), drive=drive), reverse)
            instance = report.Instance(robot, dict(model), {}, "given")
        else:
            instance, _ = _instance_of(Path(model))
        self._steers = instance.steers
        if command not in (kinds := COMMANDS[instance.robot.drive]):
            raise InputError(f"command='{command}': must be " + " or ".join(f"'{one}'" for one in kinds))
        there = _names_of(has, instance.robot.catalogue, "has=")
        left_out = set(there) - set(report.IN_WHEELS)
        effects = [one for name, one in instance.effects.items() if name not in left_out]
        self._twist, self._train = command == "twist", driving.drivetrain(instance.robot, effects)
        self._full, self._command, self._angle = instance.figure("full_speed"), command, 0.0
        if self._steers:
            self._wheelbase, self._lock = instance.figure("wheelbase"), math.radians(instance.figure("wheel_angle"))
        else:
            self._nominal = instance.figure("effective_baseline")
        behind = replace(instance, theta={n: v for n, v in instance.theta.items() if effect_of(n) in there})
        self._gains = behind.gains
        self._baseline = 0.0 if self._steers else behind.baseline_m
        x, y, heading = start
        figures_known, place = instance.robot.figures, np.array([[x, y]])
        context = FilterContext(rate_hz, np.zeros(2), figures_known, seed, np.array([heading]), place)
        self._memory = self._train.begin(context)

    def step(self, command: Sequence[float]) -> tuple[float, ...]:
        """What to ask of the simulator until the next step.

        Args:
            command: What the robot is told: forward speed and yaw rate, duties left and right, or a car's.

        Returns:
            For twists the forward speed, the sideways speed, which a robot on wheels cannot be asked for, and the
            yaw rate; else two numbers as the command's.

        Raises:
            InputError: If it is not two finite numbers.
        """
        given = np.asarray(command, dtype=float)
        if given.shape != (2,) or not np.isfinite(given).all():
            raise InputError(f"a command must be two finite numbers, got {command!r}")
        if self._steers:
            return self._step_car(given[0], given[1])
        duties = self._wheels(given[0], given[1], self._nominal) / self._full if self._twist else given
        moved, self._memory = self._train.apply(duties[None], self._memory)
        forward, sideways, yaw = moved[0].tolist()
        # What the simulator's own wheels make of it is undone
        left, right = self._wheels(forward, yaw, self._baseline) / np.array(self._gains)
        if not self._twist:
            return float(left / self._full), float(right / self._full)
        return float(left + right) / 2.0, sideways, float(right - left) / self._nominal

    def _step_car(self, first: float, second: float) -> tuple[float, ...]:
        unit = np.array((self._full, self._lock))
        wanted = np.array((first, second))
        if self._twist:
            wanted[1] = self._wheels_angle(first, second, 0.0)
        fractions = wanted if self._command == "ackermann" else wanted / unit
        moved, self._memory = self._train.apply(fractions[None], self._memory)
        forward, sideways, yaw = moved[0].tolist()
        speed = forward / self._gains[0]
        if self._twist:
            return speed, sideways, yaw / self._gains[0]
        self._angle = self._wheels_angle(forward, yaw, self._angle)
        asked = np.array((speed, self._angle)) / (unit if self._command == "ackermann" else 1.0)
        return float(asked[0]), float(asked[1])

    def _wheels_angle(self, forward: float, yaw: float, at_rest: float) -> float:
        """Angle of the front wheels [rad]; a car at rest does not tell it."""
        return math.atan(self._wheelbase * yaw / forward) if abs(forward) > AT_REST_M_S else at_rest

    @staticmethod
    def _wheels(forward: float, yaw: float, baseline: float) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Speeds of the left and right rims [m/s]."""
        return np.array((forward - yaw * baseline / 2.0, forward + yaw * baseline / 2.0))
