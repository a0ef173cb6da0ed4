"""A log from DataFrames."""

import json
from collections.abc import Mapping

import pandas as pd

from proxytune.api.frames import as_files
from proxytune.logs import Log, read_log

Description = Mapping[str, str | float]


def log_of(samples: pd.DataFrame, description: Description, commands: pd.DataFrame | None = None) -> Log:
    """A log from what its files would hold.

    Args:
        samples: The columns of samples.csv: episode, time [s], commands, x, y [m], heading [rad].
        description: The keys of log.toml, as in {"robot": "duckiebot", "command": "duty", "rate_hz": 20}.
        commands: The columns of commands.csv, where commands have times of their own.

    Raises:
        LogError: If it is no such log, with table, row and column.
    """
    frames = {"samples": samples} if commands is None else {"samples": samples, "commands": commands}
    stated = {"name": "log", **description}
    values = {key: json.dumps(value, ensure_ascii=False, default=float) for key, value in stated.items()}
    text = "".join(f"{json.dumps(key)} = {value}\n" for key, value in values.items())
    with as_files(frames) as folder:
        (folder / "log.toml").write_text(text, encoding="utf-8")
        return read_log(folder)
