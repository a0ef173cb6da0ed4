"""A diagnosis from Python: what a model lacks of a log, of motion and camera."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from proxytune import report
from proxytune.diagnosis import (
    LIMITS,
    RULES,
    CameraDiagnosis,
    Diagnosis,
    Limits,
    LogDiagnosis,
    Rules,
    diagnose_log,
    robot_of,
)
from proxytune.effects import Catalogue
from proxytune.errors import InputError
from proxytune.importing import open_log
from proxytune.logs import Log
from proxytune.settings import check_whole

IN_PYTHON = {"--robot": "robot=…", "--declared ": "declared: ", "--test": "test"}
"""What a complaint calls an option of the command, and what it is here."""


@dataclass(frozen=True, repr=False)
class DiagnosisReport(report.Shown):
    """Result of a diagnosis: what a log says of a model.

    Attributes:
        found: All of it.
    """

    found: LogDiagnosis

    def __repr__(self) -> str:
        return f"DiagnosisReport of {report.diagnosis_headline(self.found)}"

    def view(self) -> report.View:
        """What the page shows."""
        return report.diagnosis_view(self.found, self.figures())

    @property
    def diagnosis(self) -> Diagnosis | None:
        """All that the drives say, or None where the log has no commands, or they say nothing."""
        return self.found.motion

    @property
    def camera(self) -> CameraDiagnosis | None:
        """All that the frames say, or None where the log has none, or they say nothing."""
        return self.found.camera

    @property
    def verdict(self) -> str:
        """Either "nothing missing", "explained", "partly explained", "unexplained" or "cannot be told".

        It is that on motion; the camera's where there is none on motion.
        """
        return self._parts[0].verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that the model lacks and that were added, those on motion first."""
        return tuple(added.effect for part in self._parts for added in part.effects)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes, a line each: what each effect is worth, what this log could not show."""
        return tuple(report.diagnosis_notes(self.found))

    @property
    def _parts(self) -> tuple[Diagnosis | CameraDiagnosis, ...]:
        return tuple(part for part in (self.found.motion, self.found.camera) if part is not None)

    def parameters(self) -> pd.DataFrame:
        """One row per parameter of the extended model: value, 95 % interval (low, high), unit, value before."""
        rows = [
            (name, one.value, *one.interval, one.unit, part.declared[name].value if name in part.declared else None)
            for part in self._parts
            for name, one in part.theta.items()
        ]
        columns = ["parameter", "value", "low", "high", "unit", "before"]
        return pd.DataFrame(rows, columns=columns).set_index("parameter")

    to_frame = parameters

    def errors(self) -> pd.DataFrame:
        """One row per horizon [s]: RMSE of position [m] on drives kept aside, before, after, and the noise floor."""
        errors = () if self.found.motion is None else self.found.motion.errors
        rows = [(one.horizon_s, one.before.value, one.after.value, one.floor.lower) for one in errors]
        return pd.DataFrame(rows, columns=["horizon", "before", "after", "noise_floor"]).set_index("horizon")

    def camera_errors(self) -> pd.DataFrame:
        """Mean errors on frames kept aside, before, after, noise floor: `markings` [px], `brightness` [grey levels]."""
        both = () if self.camera is None else (("markings", self.camera.pixels), ("brightness", self.camera.grey))
        rows = [
            (name, one.before.value, one.after.value, report.camera_noise_floor(one), one.unit) for name, one in both
        ]
        return pd.DataFrame(rows, columns=["of", "before", "after", "noise_floor", "unit"]).set_index("of")

    def figures(self) -> dict[str, Figure]:
        """The figures that there is something to draw for, by name."""
        return report.diagnosis_figures(self.found)

    def document(self) -> dict[str, Any]:
        """The JSON document of `diagnose --json`."""
        return report.diagnosis_document(self.found)

    def write(self, folder: str | Path, command: str = "") -> list[Path]:
        """Write diagnosis.json, model.toml (for `predict` and a study's `proxy`), next drive, figures and page; paths.

        Args:
            folder: Where to.
            command: What the page's foot says makes it again.

        Raises:
            RunError: If a file cannot be written.
        """
        return report.write_diagnosis(self.found, Path(folder), command)


def diagnose(
    log: Log | str | Path,
    *,
    test: Log | str | Path | None = None,
    robot: str | None = None,
    declared: Sequence[str] | None = None,
    effects: Sequence[str] = (),
    seed: int = 1,
    rules: Rules = RULES,
    limits: Limits = LIMITS,
) -> DiagnosisReport:
    """Tune what is declared to a log, find the effects that the model lacks, and test both on what was kept aside.

    Motion is diagnosed where the log has commands, the camera where it has frames.

    Args:
        log: A log, its folder, or a bag, CSV or trajectory that says all there is to know (`import` has options).
        test: Another log to test motion on; a part of the drives if not given.
        robot: Name of the robot, instead of the one that the log names.
        declared: Effects tuned in any case, on motion and camera, as in ["trim", "camera_pitch"]; those of θ that the
            robot has if not given.
        effects: Effects of your own to try too, as "module:Attribute".
        seed: Seed of the null distributions.
        rules: Thresholds of the selection, as in replace(RULES, p_value=0.01).
        limits: Of the next drive, as in Limits(room=(4.0, 3.0)).

    Raises:
        InputError: If the log, the robot or an effect cannot be used.
    """
    check_whole("seed", seed)
    with open_log(log) as (drives, _), nullcontext((None, ())) if test is None else open_log(test) as (others, _):
        try:
            vehicle = robot_of(drives, robot, Catalogue(Path.cwd(), tuple(effects)))
            found = diagnose_log(drives, vehicle, declared, test=others, seed=seed, rules=rules, limits=limits)
            return DiagnosisReport(found)
        except InputError as problem:
            told = str(problem)
            for option, argument in IN_PYTHON.items():
                told = told.replace(option, argument)
            raise type(problem)(told) from None
