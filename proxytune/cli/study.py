"""`study`: run or resume a study, of several families, by PLV, or a bank, and sum it up; its page while it runs."""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

from proxytune import report, study
from proxytune.api import FamiliesReport, most_episodes, run_opened, run_opened_families
from proxytune.cli.options import check_made, on_its_cluster, study_folder
from proxytune.cli.terminal import Answer
from proxytune.errors import ProxytuneError
from proxytune.files import check_place
from proxytune.running import Bars, Watcher
from proxytune.search import make_proposer
from proxytune.storage import Store, locked
from proxytune.teaching import PlvSearch, load_setup, most_examinations, search_space

MOST_ON_PAGE = 0.02
"""No larger share of a run is spent on its page."""


class LivePage:
    """Hears how a run goes, passes it on, and writes the study's page."""

    def __init__(self, settings: study.StudySettings, objective: str, watcher: Watcher) -> None:
        self._settings, self._objective, self._watcher = settings, objective, watcher
        self._path = settings.home / "report.html"
        self._doing, self._due = "", 0.0
        self.written = False
        self.best, self.finished, self.waiting = watcher.best, watcher.finished, watcher.waiting

    def begin(self, what: str, known: int) -> None:
        """Something begins."""
        self._doing = what
        self._watcher.begin(what, known)

    def episode(self) -> None:
        """One more episode has been run; the page is written where the last time was long enough ago."""
        self._watcher.episode()
        begin = time.monotonic()
        if begin >= self._due:
            self.write(self._doing)
            end = time.monotonic()
            self._due = end + max(report.RENEW_S, (end - begin) / MOST_ON_PAGE)

    def write(self, doing: str) -> None:
        """Write the page, and say at the first time where it is."""
        # The run is worth more than its page, and the page of the end says what is wrong with the place.
        with suppress(ProxytuneError):
            with Store.read(self._settings.home) as store:
                trials = [one for one in store.trials(self._objective) if one.state != "open"]
            report.write_live_page(self._path, self._settings, self._objective, trials, doing)
            if not self.written:
                _say(f"page: {self._path} (renews itself while the study runs)")
            self.written = True


@contextmanager
def renewed_page(
    settings: study.StudySettings, objective: str, watching: AbstractContextManager[Watcher]
) -> Iterator[Watcher]:
    """A watcher that keeps the study's page up to date; a run that is stopped leaves a page that says so."""
    with watching as watcher:
        page = LivePage(settings, objective, watcher)
        try:
            yield page
        except BaseException:
            if page.written:
                page.write("")
            raise


def families_answer(several: FamiliesReport, spent: Mapping[str, Any]) -> Answer:
    """Draw the figure and the page of several families, and say what was found and spent."""
    figure, page = several.write()
    document = {**several.document(), **spent, "figures": [str(figure)], "report": str(page)}
    return Answer(document, report.families_text(several.compared, {"figure": figure, "report": page}))


def _say(line: str) -> None:
    print(f"proxytune study: {line}", file=sys.stderr, flush=True)


def _bars(opened: study.Study) -> AbstractContextManager[Watcher]:
    """A bar of episodes, and the study's page while it is tuned."""
    return renewed_page(opened.settings, opened.objective.name, Bars(most_episodes(opened.settings)))


def search_by_plv(opened: study.Study, folder: Path, by_prpv: Callable[[], study.StudyResult]) -> Answer:
    """Run what is left of a search by PLV; first narrow the box by PRPV where the study asks for it."""
    settings = opened.settings
    setup = load_setup(settings)
    widths = setup.settings.widths
    search_space(settings, widths, {})
    predictive = by_prpv() if setup.settings.narrow else None
    space = search_space(settings, widths, predictive.knowledge.as_good[1] if predictive else {})
    terminal = Bars(most_examinations(setup.settings), "points of learning curves")
    with locked(folder), Store.open(folder) as store, renewed_page(settings, study.LEARNING, terminal) as bars:
        search = PlvSearch(settings, setup, store, space, bars)
        chosen = predictive.best.trial.theta if predictive else None
        result = search.run(make_proposer(opened.engine, settings.initial), chosen)
    figure, page = report.write_plv_report(result, folder)
    document = {**report.plv_document(result), "figure": str(figure), "report": str(page)}
    return Answer(document, report.plv_text(result, {"figure": figure, "report": page}))


def run_a_bank(settings: study.StudySettings, arguments: argparse.Namespace) -> Answer:
    """Run what is left of a bank, and write its table of trials and its page."""
    check_place(settings.home / study.BANK_FILE, ours=True)
    opened = study.with_spending(study.open_bank(settings), budget=arguments.budget, jobs=arguments.jobs)
    with locked(settings.home), Store.open(settings.home) as store, Bars(most_episodes(opened.settings)) as bars:
        if arguments.retry_failed:
            store.forget_failures()
        run = study.StudyRun(opened, store, bars)
        study.run_bank(run)
        bank, table = study.bank_of(run), study.write_table(run)
    files = {"table": table, "report": report.write_bank_page(bank, table)}
    costs = {"episodes": {"run": run.spent.episodes}, "seconds": {"episodes": run.spent.seconds}}
    document = {**report.bank_document(bank), **costs, **{name: str(path) for name, path in files.items()}}
    return Answer(document, report.bank_text(bank, files))


@on_its_cluster
def run(arguments: argparse.Namespace) -> Answer:
    """Run what is left of a study; a finished one is summed up again without simulating."""
    begun = time.perf_counter()
    folder = study_folder(arguments.path)
    settings, again = study.read_study_settings(folder), arguments.retry_failed
    check_made(folder)
    if settings.families:
        own = {"budget": arguments.budget, "jobs": arguments.jobs}
        several = run_opened_families(settings, _say, _bars, retry_failed=again, **own)
        seconds = {"total": time.perf_counter() - begun, "episodes": several.spent.seconds}
        return families_answer(several, {"episodes": {"run": several.spent.episodes}, "seconds": seconds})
    if not settings.targets:
        return run_a_bank(settings, arguments)
    opened = study.with_spending(study.open_settings(settings), budget=arguments.budget, jobs=arguments.jobs)
    if opened.settings.objective == study.LEARNING:
        return search_by_plv(opened, folder, lambda: run_opened(opened, _bars(opened), _say, again).result)
    found = run_opened(opened, _bars(opened), _say, again)
    figures, page = found.write(folder)
    result, spent, total = found.result, found.spent, time.perf_counter() - begun
    reused = result.episodes - (spent.episodes - spent.unused)
    outside = max(0.0, total - spent.seconds / opened.settings.jobs)  # Waiting included
    document = {
        **found.document(),
        "episodes": {"run": spent.episodes, "reused": reused, "failed": result.failed_episodes},
        "seconds": {"total": total, "episodes": spent.seconds, "outside_episodes": outside},
        "figures": [str(path) for path in figures],
        "report": str(page),
    }
    costs = f"{spent.episodes} run, {reused} reused; {total:.0f} s, of which {outside:.0f} s outside episodes"
    return Answer(document, report.study_text(result, costs, {"figures": figures[0].parent, "report": page}))
