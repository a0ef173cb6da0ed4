"""The entry point: finds the command, prints its answer, and turns our exceptions into one line and an exit status."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import proxytune
from proxytune.cli.examples import epilog
from proxytune.cli.terminal.interruption import INTERRUPTED, TERMINATED, Terminated, sigterm_as_interrupt
from proxytune.cli.terminal.own_output import print_answer, prints_to_stderr
from proxytune.cli.terminal.trouble import stopped_by
from proxytune.errors import InputError, ProxytuneError


class Command(NamedTuple):
    """A command: its module, loaded only when it is asked for, and its line in the help.

    Attributes:
        module: Its name in this room.
        summary: One line for people.
        resumes: Whether it continues where it was interrupted.
        kept: What an interruption leaves, in one phrase; everything finished, or nothing, where it does not say.
        draws: Whether it writes figures.
    """

    module: str
    summary: str
    resumes: bool = False
    kept: str = ""
    draws: bool = False

    @property
    def left(self) -> str:
        """What an interruption leaves, and what the same command does then."""
        kept = self.kept or ("everything finished is kept" if self.resumes else "nothing was written")
        return f"{kept}; run the same command to {'continue' if self.resumes else 'start again'}"

    def load(self) -> ModuleType:
        """The module."""
        return importlib.import_module(f"proxytune.cli.{self.module}")


COMMANDS: dict[str, Command] = {
    "study": Command(
        "study",
        "run or resume a study: find the θ that makes the simulator most useful",
        resumes=True,
        kept="every finished trial and episode is kept",
        draws=True,
    ),
    "score": Command(
        "score",
        "measure how useful a simulator is, from two tables of scores",
        kept="of the output only whole files were written",
        draws=True,
    ),
    "sweep": Command(
        "sweep",
        "measure usefulness along one parameter",
        resumes=True,
        kept="every finished episode is kept",
        draws=True,
    ),
    "teach": Command(
        "teach",
        "measure PLV (proxy learning value): how much a simulator saves in training",
        resumes=True,
        kept="every finished point of a learning curve is kept",
        draws=True,
    ),
    "drive": Command(
        "drive",
        "show an episode, the proxy beside the target: metrics, a picture or an animation",
        kept="the picture is the old one or none",
    ),
    "import": Command("importing", "make a log of a ROS bag, a CSV, a TUM trajectory or arrays, and say what is in it"),
    "measure": Command("measure", "drive a study's agents in the domain of a model file and write their scores"),
    "record": Command(
        "record",
        "drive the domain of a model file through manoeuvres and write the log",
        kept="no log was written, at most some of its pictures",
    ),
    "diagnose": Command(
        "diagnose",
        "find the effect that the model lacks, from a log of measured drives",
        kept="findings are written last, each file whole or not at all",
        draws=True,
    ),
    "loop": Command(
        "loop",
        "tune, diagnose, extend, tune again: before and after on one page",
        resumes=True,
        kept="every finished step, trial and episode is kept",
        draws=True,
    ),
    "predict": Command(
        "predict",
        "predict the poses of a log with a fitted model",
        kept="no table was written, at most some of the pictures",
    ),
    "compare": Command(
        "compare",
        "compare how fast each search engine finds a good θ",
        resumes=True,
        kept="every finished run and episode is kept",
        draws=True,
    ),
    "plot": Command(
        "plot",
        "draw a study's figures and report again, without simulating",
        kept="every file is the old one or the new one",
        draws=True,
    ),
    "new": Command("new", "write a robot, study or domain family to start from"),
    "export": Command("export", "write what was found for another simulator, the robot or another optimiser"),
    "list": Command("listing", "list robots, maps, effects, agents, metrics, engines or measures"),
    "completion": Command("completion", "print a script that completes commands and options in your shell"),
}

DONE, FAILED, BAD_INPUT = 0, 1, 2
FORMATS = ("png", "svg", "pdf")


EXIT_STATUS = "exit status: 0 done, 1 failed, 2 bad input, 130 interrupted (Ctrl-C), 143 terminated (SIGTERM)"


def program() -> str:
    """What the program was started as."""
    return "proxytune" if Path(sys.argv[0]).stem == "proxytune" else "python -m proxytune"


def parser(words: Sequence[str] | None = None, prog: str = "") -> argparse.ArgumentParser:
    """The parser, with the options of every command; with words, only of the first command that they name."""
    prog = prog or program()
    top = argparse.ArgumentParser(
        prog=prog,
        description="Find out how useful a robot simulator is, tune it to the robot, and learn what it still lacks.",
        epilog=EXIT_STATUS,
    )
    top.add_argument("--version", action="version", version=f"proxytune {proxytune.__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    asked = next((word for word in words or () if not word.startswith("-")), "")
    for name, known in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=known.summary,
            description=f"{known.summary[0].upper()}{known.summary[1:]}.",
            epilog=epilog(name, prog),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if words is None or name == asked:
            known.load().configure(command)
        if known.draws:
            command.add_argument(
                "--format", type=formats, default=(), metavar="svg,pdf", help="figures also as SVG or PDF [PNG alone]"
            )
        command.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    return top


def formats(text: str) -> tuple[str, ...]:
    """The formats of figures beside PNG that a list names.

    Raises:
        ArgumentTypeError: If it names another.
    """
    named = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in named:
        if name not in FORMATS:
            raise argparse.ArgumentTypeError(f"'{name}' is none of {', '.join(FORMATS)}")
    return tuple(name for name in named if name != "png")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done, 1 failed, 2 bad input or usage; 130 interrupted (Ctrl-C) and 143 terminated (SIGTERM): the command
        says what is kept.
    """
    words = sys.argv[1:] if argv is None else argv
    arguments = parser(words).parse_args(words, argparse.Namespace(words=words))
    command = COMMANDS[arguments.command]
    try:
        with sigterm_as_interrupt(), _figures(getattr(arguments, "format", ())):
            with prints_to_stderr():
                answer = command.load().run(arguments)
            print_answer(answer, as_json=arguments.json)
    except ProxytuneError as problem:
        _complain(arguments.command, str(problem))
        return BAD_INPUT if isinstance(problem, InputError) else FAILED
    except (SystemExit, MemoryError, OSError) as problem:
        _complain(arguments.command, f"{stopped_by(problem)}; {command.left}")
        return FAILED
    except KeyboardInterrupt as problem:
        word, status = ("terminated", TERMINATED) if isinstance(problem, Terminated) else ("interrupted", INTERRUPTED)
        _complain(arguments.command, f"{word}; {command.left}")
        return status
    return DONE


def _figures(named: Sequence[str]) -> AbstractContextManager[None]:
    """Have figures written in other formats too; what draws them is loaded only for that."""
    if not named:
        return nullcontext()
    from proxytune.report.writing import figures_also_as

    return figures_also_as(named)


def _complain(command: str, line: str) -> None:
    print(f"proxytune {command}: {' '.join(line.splitlines())}", file=sys.stderr)
