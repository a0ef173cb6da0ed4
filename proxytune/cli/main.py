"""The entry point: finds the command, prints its answer, and turns our exceptions into one line and an exit status."""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from types import ModuleType

from rich.console import Console

from proxytune.cli import compare, diagnose, listing, measure, plot, predict, record, score, study, sweep
from proxytune.errors import InputError, ProxytuneError

COMMANDS: dict[str, tuple[ModuleType, str]] = {
    "study": (study, "run or resume a study; safe to repeat"),
    "score": (score, "usefulness of proxies from tables of scores"),
    "sweep": (sweep, "usefulness along one parameter"),
    "measure": (measure, "score a study's agents in the domain of a model file"),
    "record": (record, "drive a model file through manoeuvres and write the log"),
    "diagnose": (diagnose, "close the loop: from measured drives to the effect that the model lacks"),
    "predict": (predict, "what a fitted model says of any log"),
    "compare": (compare, "how fast each search engine finds a good theta"),
    "plot": (plot, "draw a study's figures again"),
    "list": (listing, "robots, effects, agents or metrics"),
}

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def parser() -> argparse.ArgumentParser:
    """The command line's grammar."""
    top = argparse.ArgumentParser(
        prog="python -m proxytune",
        description="Find out how useful a robot simulator is, tune it to the robot, and learn what it still lacks.",
    )
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (module, summary) in COMMANDS.items():
        command = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        module.configure(command)
        command.add_argument("--json", action="store_true", help="print one JSON document on standard output")
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done, 1 failed, 2 bad input or usage, 130 interrupted with everything finished kept.
    """
    arguments = parser().parse_args(argv)
    try:
        answer = COMMANDS[arguments.command][0].run(arguments)
        if arguments.json:
            print(json.dumps(answer.document, indent=2, allow_nan=False, ensure_ascii=False))
        else:
            Console().print(answer.shown)
        sys.stdout.flush()
    except ProxytuneError as problem:
        print(f"proxytune {arguments.command}: {problem}", file=sys.stderr)
        return BAD_INPUT if isinstance(problem, InputError) else FAILED
    except KeyboardInterrupt:
        print(
            f"proxytune {arguments.command}: interrupted; what was finished is kept, the same command goes on",
            file=sys.stderr,
        )
        return INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    return DONE
