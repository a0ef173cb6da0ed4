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

from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.interruption import INTERRUPTED, TERMINATED, Terminated, sigterm_as_interrupt
from proxytune.errors import InputError, ProxytuneError, RunError


class Command(NamedTuple):
    """A command: its module, loaded only when it is asked for, and its line in the help.

    Attributes:
        module: Its name in this room.
        summary: One line for people.
        resumes: Whether it continues where it was interrupted.
    """

    module: str
    summary: str
    resumes: bool = False

    def load(self) -> ModuleType:
        """The module."""
        return importlib.import_module(f"proxytune.cli.{self.module}")


COMMANDS: dict[str, Command] = {
    "study": Command("study", "run or resume a study: find the θ that makes the simulator most useful", resumes=True),
    "score": Command("score", "measure how useful a simulator is, from two tables of scores"),
    "sweep": Command("sweep", "measure usefulness along one parameter", resumes=True),
    "teach": Command(
        "teach",
        "measure PLV (proxy learning value): how much a simulator saves in training",
        resumes=True,
    ),
    "drive": Command("drive", "show an episode, the proxy beside the target: metrics, a picture or an animation"),
    "import": Command("importing", "make a log of a ROS bag, a CSV, a TUM trajectory or arrays, and say what is in it"),
    "measure": Command("measure", "drive a study's agents in the domain of a model file and write their scores"),
    "record": Command("record", "drive the domain of a model file through manoeuvres and write the log"),
    "diagnose": Command("diagnose", "find the effect that the model lacks, from a log of measured drives"),
    "loop": Command("loop", "tune, diagnose, extend, tune again: before and after on one page", resumes=True),
    "predict": Command("predict", "predict the poses of a log with a fitted model"),
    "compare": Command("compare", "compare how fast each search engine finds a good θ", resumes=True),
    "plot": Command("plot", "draw a study's figures and report again, without simulating"),
    "new": Command("new", "write a robot, study or domain family to start from"),
    "export": Command("export", "write what was found to a URDF, a MuJoCo model or ROS parameters"),
    "list": Command("listing", "list robots, maps, effects, agents, metrics, engines or measures"),
}

DONE, FAILED, BAD_INPUT = 0, 1, 2


def parser(words: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """The parser, with the options of every command; with words, only of the first command that they name."""
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
        command.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done, 1 failed, 2 bad input or usage; 130 interrupted (Ctrl-C) and 143 terminated (SIGTERM): commands that
        resume keep everything finished.
    """
    words = sys.argv[1:] if argv is None else argv
    arguments = parser(words).parse_args(words, argparse.Namespace(words=words))
    command = COMMANDS[arguments.command]
    try:
        with sigterm_as_interrupt():
            _print(command.load().run(arguments), arguments.json)
    except ProxytuneError as problem:
        _complain(arguments.command, str(problem))
        return BAD_INPUT if isinstance(problem, InputError) else FAILED
    except KeyboardInterrupt as problem:
        word, status = ("terminated", TERMINATED) if isinstance(problem, Terminated) else ("interrupted", INTERRUPTED)
        kept = "everything finished is kept; run the same command to continue"
        left = kept if command.resumes else "nothing was written; run the same command to start again"
        _complain(arguments.command, f"{word}; {left}")
        return status
    return DONE


def _print(answer: Answer, as_json: bool) -> None:
    """Print a command's answer; a closed pipe is not an error.

    Raises:
        RunError: If it cannot be written.
    """
    try:
        if as_json:
            print(json.dumps(answer.document, indent=2, allow_nan=False, ensure_ascii=False))
        else:
            Console().print(answer.text)
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_the_rest()
    except OSError as problem:
        _discard_the_rest()
        raise RunError(f"standard output: cannot be written ({problem.strerror}); make room and run again") from None


def _discard_the_rest() -> None:
    """Drop what is still in the buffer, which would raise once more when Python ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(command: str, line: str) -> None:
    print(f"proxytune {command}: {line}", file=sys.stderr)
