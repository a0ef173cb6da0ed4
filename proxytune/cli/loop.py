"""`loop`: tune, diagnose, extend, tune again, and compare before with after."""

import argparse
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

from proxytune.cli.diagnose import shares
from proxytune.cli.options import check_made, study_folder, typed
from proxytune.cli.terminal import Answer, steps
from proxytune.files import check_place
from proxytune.logs import Log
from proxytune.loop import Teller, run_loop, text_of
from proxytune.running import Bars, Watcher


def run(arguments: argparse.Namespace) -> Answer:
    """Do every step that is not done, and write the page."""
    begun = time.perf_counter()
    folder = study_folder(arguments.path)
    check_made(folder)
    for name in ("diagnosed", "extended"):
        check_place(folder / "loop" / name, folder=True, ours=True)
    check_place(folder / "loop" / "report.html", ours=True)
    report = run_loop(folder, log=arguments.log, twin=arguments.twin, teller=Terminal())
    page = report.write(typed(arguments))
    closed, document = report.closed, report.document()
    home = closed.loop.home
    files = {"report": page, "log": closed.loop.log or home / "log", "model": home / "diagnosed" / "model.toml"}
    files |= {"diagnosis": home / "diagnosed" / "diagnosis.json"}
    files |= {"extended": home / "extended" / "study.toml"} if closed.after else {}
    document["files"] = {name: str(path) for name, path in files.items()}
    document["this_run"]["seconds"] = time.perf_counter() - begun
    return Answer(document, text_of(closed, page))


class Terminal(Teller):
    """Tells on standard error how a loop goes."""

    def say(self, line: str) -> None:
        """One line."""
        print(f"proxytune loop: {line}", file=sys.stderr, flush=True)

    def episodes(self, total: int) -> AbstractContextManager[Watcher]:
        """A bar of episodes."""
        return Bars(total)

    def diagnosis(self, log: Log) -> AbstractContextManager[Callable[[str], None]]:
        """The steps of a diagnosis."""
        return steps(shares(log))
