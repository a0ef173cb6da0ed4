"""Every command, as commands.toml has it: what it is called, does, leaves when it is stopped, and may run.

What it takes is in options.toml, which `add_options` tells a parser.
"""

import argparse
import importlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from proxytune.files import package_table


class Command(NamedTuple):
    """A command: its module, or a function of one, loaded only when it is asked for, its line in the help, examples."""

    module: str
    summary: str
    examples: Sequence[str]
    shares: Sequence[str] = ()
    resumes: bool = False
    kept: str = ""
    draws: bool = False
    runs_code: bool = False

    @property
    def left(self) -> str:
        """Say what an interruption leaves, and what the same command does then."""
        kept = self.kept or ("everything finished is kept" if self.resumes else "nothing was written")
        return f"{kept}; run the same command to {'continue' if self.resumes else 'start again'}"

    def load(self) -> Any:
        """The function that runs the command: `run` of its module, or the one that is named."""
        module, _, function = self.module.partition(".")
        return getattr(importlib.import_module(f"proxytune.cli.{module}"), function or "run")


TABLES, OPTIONS = package_table("cli/commands.toml"), package_table("cli/options.toml")
COMMANDS = {name: Command(**{"module": name, **table}) for name, table in TABLES.items()}
TYPES: Mapping[str, Callable[[str], object]] = {"int": int, "float": float, "path": Path}


def add_options(parser: argparse.ArgumentParser, *tables: str) -> None:
    """Add the options of these tables of options.toml, in their order; a table within a table is a group."""
    for table in tables:
        for name, given in OPTIONS[table].items():
            grouped = "help" not in given
            to = parser.add_argument_group(name) if grouped else parser
            for option, words in given.items() if grouped else ((name, given),):
                known: dict[str, Any] = {key: value for key, value in words.items() if key != "late"}
                if kind := TYPES.get(words.get("type", "")):
                    known["type"] = kind
                to.add_argument(option, **known)
                if "late" in words:
                    _take_late(parser, option, kind or str)


def _take_late(parser: argparse.ArgumentParser, name: str, kind: Callable[[str], object]) -> None:
    """Let options stand before a last argument that may be left out: argparse takes it for left out at the first."""
    plain = parser.parse_known_args

    def parse(
        words: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        known, rest = plain(words, namespace)
        if rest and getattr(known, name) is None and not rest[0].startswith("-"):
            setattr(known, name, kind(rest.pop(0)))
        return known, rest

    parser.parse_known_args = parse  # type: ignore[method-assign, assignment]


def names_in(given: str) -> tuple[str, ...]:
    """The names of a list with commas."""
    return tuple(name.strip() for name in given.split(",") if name.strip())


def epilog(command: str, program: str) -> str:
    """The examples of a command, to stand below its help."""
    return "\n".join(["examples:", *(f"  {program} {line}" for line in COMMANDS[command].examples)])
