"""`loop`: tune, diagnose, extend, tune again, and compare before with after."""

import argparse
import shlex
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proxytune.cli.diagnose import shares
from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.steps import Steps
from proxytune.cli.terminal.study_folder import study_folder
from proxytune.logs import Log
from proxytune.loop import COLUMNS, Closed, close_loop, document_of, notes_of, open_loop, page_of, rows_of, table_rows
from proxytune.report.page.rendering import html_of
from proxytune.report.writing import write_text
from proxytune.running import Bars, Watcher


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study, its log and its twin."""
    parser.add_argument(
        "path", type=Path, metavar="STUDY", help="a study's folder, or where to copy one that comes with proxytune"
    )
    parser.add_argument(
        "--log", type=Path, metavar="LOG", help="the target's log, or what `import` reads [the twin's is recorded]"
    )
    parser.add_argument(
        "--twin", type=Path, metavar="MODEL", help="the target's model.toml, where it is a simulator [the key truth]"
    )


def run(arguments: argparse.Namespace) -> Answer:
    """Do every step that is not done, and write the page."""
    begun = time.perf_counter()
    folder = study_folder(arguments.path)
    loop = open_loop(folder, arguments.twin, arguments.log)
    closed = close_loop(loop, Terminal())
    page = loop.home / "report.html"
    write_text(page, html_of(page_of(closed, _command(arguments), datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"))))
    document = document_of(closed)
    document["files"] = {name: str(path) for name, path in _files(closed, page).items()}
    document["this_run"]["seconds"] = time.perf_counter() - begun
    return Answer(document, _text(closed, document["sentence"], document["next"], page))


class Terminal:
    """Tells on standard error how a loop goes."""

    def say(self, line: str) -> None:
        """One line."""
        print(f"proxytune loop: {line}", file=sys.stderr, flush=True)

    def episodes(self, total: int) -> AbstractContextManager[Watcher]:
        """A bar of episodes."""
        return Bars(total)

    def diagnosis(self, log: Log) -> AbstractContextManager[Callable[[str], None]]:
        """The steps of a diagnosis."""
        return Steps(shares(log))


def _command(arguments: argparse.Namespace) -> str:
    options = [("--log", arguments.log), ("--twin", arguments.twin)]
    given = [word for option, value in options if value for word in (option, str(value))]
    return shlex.join(["python", "-m", "proxytune", "loop", str(arguments.path), *given])


def _files(closed: Closed, page: Path) -> dict[str, Path]:
    """What was made, by name."""
    home = closed.loop.home
    found = {"model": home / "diagnosed" / "model.toml", "diagnosis": home / "diagnosed" / "diagnosis.json"}
    extended = {"extended": home / "extended" / "study.toml"} if closed.after else {}
    return {"report": page, "log": closed.loop.log or home / "log", **found, **extended}


def _text(closed: Closed, sentence: str, following: str, page: Path) -> Group:
    table = Table(box=None, pad_edge=False)
    for name in COLUMNS:
        table.add_column(name, overflow="fold")
    for row in table_rows(rows_of(closed)):
        table.add_row(*map(escape, row))
    notes = [Text(f"note: {note}") for note in notes_of(closed)]
    return Group(Text(sentence, style="bold"), table, *notes, Text(f"Next: {following}"), Text(str(page)))
