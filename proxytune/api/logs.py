"""A diagnosis from Python: a log from DataFrames, and what the model lacks of it."""

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from proxytune.diagnosis.diagnose import declared_effects
from proxytune.diagnosis.diagnose import diagnose as diagnose_log
from proxytune.diagnosis.measured.vehicle import robot_of
from proxytune.diagnosis.result import Diagnosis
from proxytune.errors import LogError
from proxytune.logs import Log, read_log

Description = Mapping[str, str | float]


def log_of(samples: pd.DataFrame, description: Description, commands: pd.DataFrame | None = None) -> Log:
    """A log from what its files would hold.

    Args:
        samples: The columns of samples.csv: episode, time [s], commands, x, y [m], heading [rad].
        description: The keys of log.toml: robot, command, rate_hz, and what it says of the robot.
        commands: The columns of commands.csv, where commands have times of their own.

    Raises:
        LogError: If it is no such log, with row and column.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in description.items()]
        (folder / "log.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
        samples.to_csv(folder / "samples.csv", index=False)
        if commands is not None:
            commands.to_csv(folder / "commands.csv", index=False)
        try:
            return read_log(folder)
        except LogError as problem:
            raise LogError(str(problem).replace(f"{folder}/", "")) from None


def diagnose(
    log: Log | str | Path, *, robot: str | None = None, declared: Sequence[str] | None = None, seed: int = 1
) -> Diagnosis:
    """Tune what is declared to a log, and find the effects that the model lacks.

    Args:
        log: A log, or its folder.
        robot: Name of the robot, instead of the one that the log names.
        declared: Effects tuned in any case; those of θ that the robot has if not given.
        seed: Seed of the null distributions.

    Raises:
        InputError: If the log, the robot or an effect cannot be used.
    """
    drives = log if isinstance(log, Log) else read_log(Path(log))
    vehicle = robot_of(drives, robot)
    names = declared_effects(vehicle) if declared is None else declared
    return diagnose_log(drives, vehicle, names, seed=seed)
