"""The entry point: finds the command, prints its answer, and turns our exceptions into one line and an exit status."""

import argparse
import errno
import re
import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import NoReturn

import proxytune
from proxytune.cli.commands import COMMANDS, add_options, epilog, names_in
from proxytune.cli.terminal import FAILED, Answer, print_answer, prints_to_stderr, signals_as_interruptions, stopped_by
from proxytune.errors import InputError, ProxytuneError
from proxytune.extensions import Interrupted, running_none
from proxytune.settings import nearest
from proxytune.starting import UNDER_WAY, lasting_stderr

DONE, BAD_INPUT = 0, 2
FORMATS = ("png", "svg", "pdf")
LACKING = (errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.ENOSPC)
EXIT_STATUS = "exit status: 0 done, 1 failed, 2 bad input, 129 hung up, 130 interrupted (Ctrl-C), 143 terminated"


class Parser(argparse.ArgumentParser):
    """A parser that says what was probably meant by a command, an option or a choice that there is not."""

    def error(self, message: str) -> NoReturn:
        """Complain in one line, as of all bad input, and end with 2."""
        if choice := re.fullmatch(r"(.*)invalid choice: '(.*)' \(choose from (.*)\)", message):
            where, word, listed = choice.groups()
            known = [one.strip(" '") for one in listed.split(",")]
            message = f"{where}unknown '{word}'; {nearest(word, known)}"
        _complain(self.prog, f"{message} (see {self.prog} --help)")
        self.exit(BAD_INPUT)


def program() -> str:
    """Command line that started the program."""
    return "proxytune" if Path(sys.argv[0]).stem == "proxytune" else "python -m proxytune"


def parser(words: Sequence[str] | None = None, prog: str = "") -> argparse.ArgumentParser:
    """The parser, with the options of every command; with words, only of the first command that they name."""
    prog = prog or program()
    top = Parser(
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
            add_options(command, name, *known.shares)
        add_shared_options(command, draws=known.draws)
        command.set_defaults(parser=command)
    return top


def parse(words: Sequence[str]) -> argparse.Namespace:
    """The command that words ask for, with its options; words that are none of these end the program with 2."""
    arguments, unknown = parser(words).parse_known_args(words, argparse.Namespace(words=words))
    if option := next((word.partition("=")[0] for word in unknown if word.startswith("--")), ""):
        known = re.findall(r"--[a-z][\w-]*", arguments.parser.format_help())
        arguments.parser.error(f"unknown option '{option}'; {nearest(option, set(known))}")
    if unknown:
        arguments.parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    return arguments


def add_shared_options(parser: argparse.ArgumentParser, *, draws: bool) -> None:
    """Add the options that commands have in common; figures have formats."""
    if draws:
        also = "figures also as SVG or PDF [PNG alone]"
        parser.add_argument("--format", type=formats, default=(), metavar="svg,pdf", help=also)
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")


def formats(text: str) -> tuple[str, ...]:
    """The formats of figures beside PNG that a list names."""
    named = tuple(dict.fromkeys(names_in(text)))
    for name in named:
        if name not in FORMATS:
            raise argparse.ArgumentTypeError(f"'{name}' is none of {', '.join(FORMATS)}")
    return tuple(name for name in named if name != "png")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done, 1 failed, 2 bad input or usage; 129 hung up (SIGHUP), 130 interrupted (Ctrl-C) and 143 terminated
        (SIGTERM): the command says what is kept.
    """
    words = sys.argv[1:] if argv is None else argv
    if not words:
        parser(words).print_help()
        return DONE
    arguments = parse(words)
    command = COMMANDS[arguments.command]
    # Of effects that are typed the code is asked for; what a file names is another's wish
    listed = getattr(arguments, "name", None) if arguments.command == "list" else None
    typed = (*names_in(getattr(arguments, "effects", "")), *names_in(listed or ""))
    with nullcontext() if command.runs_code else running_none(arguments.command, typed):
        run, program = (lambda: command.load()(arguments)), f"proxytune {arguments.command}"
        return run_command(run, arguments, program=program, left=command.left)


def run_command(answer_of: Callable[[], Answer], arguments: argparse.Namespace, *, program: str, left: str) -> int:
    """Run a command, and print its answer or, in one line, what came in between; gives its exit status.

    An interruption is told with what it leaves, and what the same command does then.
    """
    UNDER_WAY[:] = program, left
    with lasting_stderr():
        try:
            with signals_as_interruptions():
                return _run(answer_of, arguments, program, left)
        except Interrupted as problem:  # Just as signals begin or end to be heard so, or once more
            what, status = stopped_by(problem)
            _complain(program, f"{what}; {left}")
            return status


def _run(answer_of: Callable[[], Answer], arguments: argparse.Namespace, program: str, left: str) -> int:
    try:
        drawn: AbstractContextManager[None] = nullcontext()
        if named := getattr(arguments, "format", ()):  # What draws figures is loaded only for that
            from proxytune.report import figures_also_as

            drawn = figures_also_as(named)
        with drawn:
            with prints_to_stderr():
                answer = answer_of()
            print_answer(answer, as_json=arguments.json)
    except ProxytuneError as problem:
        _complain(program, str(problem))
        return BAD_INPUT if isinstance(problem, InputError) else FAILED
    except BaseException as problem:
        stopping = KeyboardInterrupt | SystemExit | MemoryError | OSError
        # A library may stumble over a signal, or over what the system refused it, and raise something else
        cause = problem if isinstance(problem, stopping) else _behind(problem)
        if cause is None:
            raise
        what, status = stopped_by(cause)
        _complain(program, f"{what}; {left}")
        return status
    return DONE


def _behind(problem: BaseException | None) -> KeyboardInterrupt | MemoryError | OSError | None:
    """The user's signal, or what memory, disk or descriptors lacked, among what led to a problem."""
    while problem is not None:
        if isinstance(problem, Interrupted | MemoryError):
            return problem
        if isinstance(problem, OSError) and problem.errno in LACKING:
            return problem
        problem = problem.__cause__ or problem.__context__
    return None


def _complain(program: str, line: str) -> None:
    print(f"{program}: {' '.join(line.splitlines())}", file=sys.stderr)
