"""A diagnosis from Python: what a model lacks of a log."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from proxytune.diagnosis.diagnose import declared_effects
from proxytune.diagnosis.diagnose import diagnose as diagnose_log
from proxytune.diagnosis.measured.vehicle import robot_of
from proxytune.diagnosis.result import Diagnosis
from proxytune.effects import Catalogue
from proxytune.errors import InputError
from proxytune.logs import Log, read_log
from proxytune.report.diagnosis.document import document, model_file
from proxytune.report.diagnosis.figures import diagnosis_figures
from proxytune.report.diagnosis.notes import headline, notes
from proxytune.report.writing import save, write_text

IN_PYTHON = {"--robot": "robot=…", "--declared ": "declared: "}
"""What a complaint calls an option of the command, and what it is here."""


@dataclass(frozen=True, repr=False)
class DiagnosisReport:
    """What a log says of a model.

    Attributes:
        diagnosis: All of it.
    """

    diagnosis: Diagnosis

    def __repr__(self) -> str:
        return f"DiagnosisReport of {headline(self.diagnosis)}"

    @property
    def verdict(self) -> str:
        """Either "nothing missing", "explained", "partly explained", "unexplained" or "cannot be told"."""
        return self.diagnosis.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that the model lacks and that were added."""
        return tuple(adopted.effect for adopted in self.diagnosis.effects)

    @property
    def notes(self) -> tuple[str, ...]:
        """What else is to be known, a line each: what each effect is worth, what these drives could not show."""
        return tuple(notes(self.diagnosis))

    def parameters(self) -> pd.DataFrame:
        """One row per parameter of the extended model: value, 95 % interval (low, high), unit, value before."""
        before = self.diagnosis.declared
        rows = [
            (name, one.value, *one.interval, one.unit, before[name].value if name in before else None)
            for name, one in self.diagnosis.theta.items()
        ]
        columns = ["parameter", "value", "low", "high", "unit", "before"]
        return pd.DataFrame(rows, columns=columns).set_index("parameter")

    def errors(self) -> pd.DataFrame:
        """One row per horizon [s]: RMSE of position [m] on drives kept aside, before, after, and the noise floor."""
        rows = [(one.horizon_s, one.before.value, one.after.value, one.floor.lower) for one in self.diagnosis.errors]
        return pd.DataFrame(rows, columns=["horizon", "before", "after", "noise_floor"]).set_index("horizon")

    def figures(self) -> dict[str, Figure]:
        """The figures that there is something to draw for, by name."""
        return dict(diagnosis_figures(self.diagnosis))

    def document(self) -> dict[str, Any]:
        """What `diagnose --json` prints of it."""
        return document(self.diagnosis)

    def write(self, folder: str | Path) -> list[Path]:
        """Write diagnosis.json, model.toml, which `predict` and a study's `proxy` read, and the figures; their paths.

        Raises:
            RunError: If a file cannot be written.
        """
        home = Path(folder)
        text = json.dumps(self.document(), indent=2, allow_nan=False, ensure_ascii=False)
        write_text(home / "diagnosis.json", text)
        write_text(home / "model.toml", model_file(self.diagnosis))
        figures = {home / f"{name}.png": figure for name, figure in self.figures().items()}
        for path, figure in figures.items():
            save(figure, path)
        return [home / "diagnosis.json", home / "model.toml", *figures]


def diagnose(
    log: Log | str | Path,
    *,
    test: Log | str | Path | None = None,
    robot: str | None = None,
    declared: Sequence[str] | None = None,
    effects: Sequence[str] = (),
    seed: int = 1,
) -> DiagnosisReport:
    """Tune what is declared to a log, find the effects that the model lacks, and test both on drives kept aside.

    Args:
        log: A log, or its folder.
        test: Another log to test on; a part of the drives if not given.
        robot: Name of the robot, instead of the one that the log names.
        declared: Effects tuned in any case, as in ["trim", "delay"]; those of θ that the robot has if not given.
        effects: Effects of your own to try too, as "module:Attribute".
        seed: Seed of the null distributions.

    Raises:
        InputError: If the log, the robot or an effect cannot be used.
    """
    if seed < 0:
        raise InputError(f"seed must be at least 0, got {seed}")
    drives, others = _read(log), None if test is None else _read(test)
    try:
        vehicle = robot_of(drives, robot, Catalogue(Path.cwd(), tuple(effects)))
        names = declared_effects(vehicle) if declared is None else declared
        return DiagnosisReport(diagnose_log(drives, vehicle, names, test=others, seed=seed))
    except InputError as problem:
        raise type(problem)(_in_python(str(problem))) from None


def _read(log: Log | str | Path) -> Log:
    return log if isinstance(log, Log) else read_log(log)


def _in_python(problem: str) -> str:
    for option, argument in IN_PYTHON.items():
        problem = problem.replace(option, argument)
    return problem
