"""Every command, as commands.toml has it: what it is called, does, leaves when it is stopped, and may run."""

import importlib
import tomllib
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import NamedTuple


class Command(NamedTuple):
    """A command: its module, loaded only when it is asked for, its line in the help, and examples for that."""

    module: str
    summary: str
    examples: Sequence[str]
    resumes: bool = False
    kept: str = ""
    draws: bool = False
    runs_code: bool = False

    @property
    def left(self) -> str:
        """Say what an interruption leaves, and what the same command does then."""
        kept = self.kept or ("everything finished is kept" if self.resumes else "nothing was written")
        return f"{kept}; run the same command to {'continue' if self.resumes else 'start again'}"

    def load(self) -> ModuleType:
        """The module."""
        return importlib.import_module(f"proxytune.cli.{self.module}")


TABLES = tomllib.loads(Path(__file__).with_name("commands.toml").read_text(encoding="utf-8"))
COMMANDS = {name: Command(**{"module": name, **table}) for name, table in TABLES.items()}


def names_in(given: str) -> tuple[str, ...]:
    """The names of a list with commas."""
    return tuple(name.strip() for name in given.split(",") if name.strip())


def epilog(command: str, program: str) -> str:
    """The examples of a command, to stand below its help."""
    return "\n".join(["examples:", *(f"  {program} {line}" for line in COMMANDS[command].examples)])
