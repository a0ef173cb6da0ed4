"""`loop`: tune, diagnose, extend, tune again, and compare before with after."""

import argparse
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from proxytune.cli.diagnose import shares
from proxytune.cli.options import check_made, study_folder, typed
from proxytune.cli.terminal import Answer, Steps
from proxytune.files import check_place
from proxytune.logs import Log
from proxytune.loop import Closed, Teller, run_loop, text_of
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
    document = report.document()
    document["files"] = {name: str(path) for name, path in _files(report.closed, page).items()}
    document["this_run"]["seconds"] = time.perf_counter() - begun
    return Answer(document, text_of(report.closed, page))


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
        return Steps(shares(log))


def _files(closed: Closed, page: Path) -> dict[str, Path]:
    home = closed.loop.home
    found = {"model": home / "diagnosed" / "model.toml", "diagnosis": home / "diagnosed" / "diagnosis.json"}
    extended = {"extended": home / "extended" / "study.toml"} if closed.after else {}
    return {"report": page, "log": closed.loop.log or home / "log", **found, **extended}
