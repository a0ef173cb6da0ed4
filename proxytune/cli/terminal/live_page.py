"""A study's page while the study runs: written anew every few seconds, as its episodes end."""

import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress

from proxytune.errors import ProxytuneError
from proxytune.report import RENEW_S, write_live_page
from proxytune.running import Watcher
from proxytune.storage import Store
from proxytune.study import StudySettings


class LivePage:
    """Hears how a run goes, passes it on, and writes the study's page."""

    def __init__(self, settings: StudySettings, objective: str, watcher: Watcher) -> None:
        self._settings, self._objective, self._watcher = settings, objective, watcher
        self._path = settings.home / "report.html"
        self._doing, self._due = "", 0.0
        self.written = False

    def begin(self, what: str, known: int) -> None:
        """Something begins."""
        self._doing = what
        self._watcher.begin(what, known)

    def episode(self) -> None:
        """One more episode has been run; the page is written where the last time was long enough ago."""
        self._watcher.episode()
        if time.monotonic() >= self._due:
            self.write(self._doing)
            self._due = time.monotonic() + RENEW_S

    def best(self, score: float) -> None:
        """The lowest score so far."""
        self._watcher.best(score)

    def finished(self, what: str) -> None:
        """Something has ended."""
        self._watcher.finished(what)

    def waiting(self, episode: str, seconds: float) -> None:
        """An episode has been under way for long."""
        self._watcher.waiting(episode, seconds)

    def write(self, doing: str) -> None:
        """Write the page, and say at the first time where it is."""
        # The run is worth more than its page, and the page of the end says what is wrong with the place.
        with suppress(ProxytuneError):
            with Store.read(self._settings.home) as store:
                trials = [one for one in store.trials(self._objective) if one.state != "open"]
            write_live_page(self._path, self._settings, self._objective, trials, doing)
            if not self.written:
                print(f"proxytune study: page: {self._path} (renews itself while the study runs)", file=sys.stderr)
            self.written = True


@contextmanager
def renewed_page(
    settings: StudySettings, objective: str, watching: AbstractContextManager[Watcher]
) -> Iterator[Watcher]:
    """A watcher that keeps the study's page up to date; a run that is stopped leaves a page that says so.

    Args:
        settings: The study's.
        objective: The measure that its trials are searched by.
        watching: Gives what else hears of every episode.
    """
    with watching as watcher:
        page = LivePage(settings, objective, watcher)
        try:
            yield page
        except BaseException:
            if page.written:
                page.write("")
            raise
