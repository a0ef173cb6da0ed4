"""`completion`: a script with which a shell completes commands, options and files."""

import argparse
from collections.abc import Iterator
from pathlib import Path

from proxytune.cli.terminal import Answer
from proxytune.errors import InputError, to_install


def run(arguments: argparse.Namespace) -> Answer:
    """Print the script for a shell, made from the parser with every option that it has."""
    from proxytune.cli.main import parser

    try:
        import shtab
    except ImportError:
        raise InputError(f"completion needs shtab, which is not installed; {to_install('completion')}") from None
    whole = parser(prog="proxytune")
    for action in _actions(whole):
        if action.type is Path:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    script = str(shtab.complete(whole, arguments.shell))
    return Answer({"shell": arguments.shell, "script": script}, script)


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
