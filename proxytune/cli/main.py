"""The entry point: finds the command, prints its answer, and turns our exceptions into one line and an exit status."""

import argparse
import importlib
import json
import os
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import NamedTuple

from rich.console import Console

from proxytune.cli.answer import Answer
from proxytune.cli.interruption import INTERRUPTED, TERMINATED, Terminated, sigterm_as_interrupt
from proxytune.errors import InputError, ProxytuneError, RunError


class Command(NamedTuple):
    """A command: the module that does it, loaded only when it is asked for, and what it is told of.

    Attributes:
        module: Its name in this room.
        summary: One line for people.
        resumes: Whether it goes on where it was interrupted.
    """

    module: str
    summary: str
    resumes: bool = False

    def load(self) -> ModuleType:
        """The module."""
        return importlib.import_module(f"proxytune.cli.{self.module}")


COMMANDS: dict[str, Command] = {
    "study": Command("study", "run or resume a study; safe to repeat", resumes=True),
    "score": Command("score", "usefulness of proxies from tables of scores"),
    "sweep": Command("sweep", "usefulness along one parameter", resumes=True),
    "teach": Command("teach", "learning curves and PLV: what a proxy is worth as a teacher", resumes=True),
    "measure": Command("measure", "score a study's agents in the domain of a model file"),
    "record": Command("record", "drive a model file through manoeuvres and write the log"),
    "diagnose": Command("diagnose", "close the loop: from measured drives to the effect that the model lacks"),
    "predict": Command("predict", "what a fitted model says of any log"),
    "compare": Command("compare", "how fast each search engine finds a good theta", resumes=True),
    "plot": Command("plot", "draw a study's figures again"),
    "list": Command("listing", "robots, maps, effects, agents or metrics"),
}

DONE, FAILED, BAD_INPUT = 0, 1, 2


def parser(words: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """The command line's grammar, with the options of every command; of the first that these words name, if any."""
    top = argparse.ArgumentParser(
        prog="python -m proxytune",
        description="Find out how useful a robot simulator is, tune it to the robot, and learn what it still lacks.",
    )
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    asked = next((word for word in words or () if not word.startswith("-")), "")
    for name, (_, summary, _) in COMMANDS.items():
        command = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        if words is None or name == asked:
            COMMANDS[name].load().configure(command)
        command.add_argument("--json", action="store_true", help="print one JSON document on standard output")
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done, 1 failed, 2 bad input or usage; 130 interrupted (Ctrl-C) and 143 terminated (SIGTERM), with everything
        finished kept by the commands that can go on.
    """
    words = sys.argv[1:] if argv is None else argv
    arguments = parser(words).parse_args(words)
    command = COMMANDS[arguments.command]
    try:
        with sigterm_as_interrupt():
            _print(command.load().run(arguments), arguments.json)
    except ProxytuneError as problem:
        _complain(arguments.command, str(problem))
        return BAD_INPUT if isinstance(problem, InputError) else FAILED
    except KeyboardInterrupt as problem:
        word, status = ("terminated", TERMINATED) if isinstance(problem, Terminated) else ("interrupted", INTERRUPTED)
        kept = "what was finished is kept, the same command goes on"
        left = kept if command.resumes else "nothing was written, the same command begins anew"
        _complain(arguments.command, f"{word}; {left}")
        return status
    return DONE


def _print(answer: Answer, as_json: bool) -> None:
    """Print a command's answer on standard output, of which a reader may have seen enough.

    Raises:
        RunError: If it cannot be written.
    """
    try:
        if as_json:
            print(json.dumps(answer.document, indent=2, allow_nan=False, ensure_ascii=False))
        else:
            Console().print(answer.shown)
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_the_rest()
    except OSError as problem:
        _discard_the_rest()
        raise RunError(f"standard output: cannot be written ({problem.strerror}); make room and run again") from None


def _discard_the_rest() -> None:
    """What is still in the buffer would raise once more when Python ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(command: str, line: str) -> None:
    print(f"proxytune {command}: {line}", file=sys.stderr)
