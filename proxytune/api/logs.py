"""A log from DataFrames."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
import tomlkit

from proxytune.api.frames import as_files
from proxytune.errors import LogError
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
    with as_files(frames) as folder:
        (folder / "log.toml").write_text(_toml(stated), encoding="utf-8")
        return read_log(folder)


def _toml(stated: Description) -> str:
    plain = {key: value.item() if isinstance(value, np.generic) else value for key, value in stated.items()}
    try:
        return tomlkit.dumps(plain)
    except TypeError as problem:
        raise LogError(f"log.toml: {problem}; give texts and numbers") from None
