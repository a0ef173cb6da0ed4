"""`study` and `plot` of several families: each tuned in the same time, and compared."""

import sys
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any

from proxytune.api.families import FamiliesReport, Spending, read_families, run_opened_families
from proxytune.api.studies import most_episodes
from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.live_page import renewed_page
from proxytune.report import families_text
from proxytune.running import Bars, Watcher
from proxytune.study import Study, StudySettings


def compare_families(settings: StudySettings, spending: Spending) -> Answer:
    """Run what is left of every family, and compare them; finished ones are summed up again without simulating."""
    begun = time.perf_counter()
    report = run_opened_families(settings, Terminal(), spending)
    seconds = {"total": time.perf_counter() - begun, "episodes": report.spent.seconds}
    return _answer(report, {"episodes": {"run": report.spent.episodes}, "seconds": seconds})


def redraw_families(settings: StudySettings) -> Answer:
    """Draw the figure and the page of several families again; nothing is simulated."""
    return _answer(read_families(settings.path), {})


def _answer(report: FamiliesReport, spent: Mapping[str, Any]) -> Answer:
    figure, page = report.write()
    document = {**report.document(), **spent, "figures": [str(figure)], "report": str(page)}
    return Answer(document, families_text(report.compared, {"figure": figure, "report": page}))


class Terminal:
    """Tells on standard error how it goes."""

    def say(self, line: str) -> None:
        """One line."""
        print(f"proxytune study: {line}", file=sys.stderr, flush=True)

    def tuning(self, study: Study) -> AbstractContextManager[Watcher]:
        """A bar of episodes, and the family's page while it is tuned."""
        settings = study.settings
        return renewed_page(settings, study.objective.name, Bars(most_episodes(settings)))

    def teaching(self, points: int) -> AbstractContextManager[Watcher]:
        """A bar of points of learning curves."""
        return Bars(points, "points of learning curves")
