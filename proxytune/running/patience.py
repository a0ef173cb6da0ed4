"""Episodes that have been under way for long are told of: nothing else shows that an agent hangs."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator

from proxytune.domain import Episode, Outcome

LONG_S = 60.0
"""An episode that has been under way for so long is told of [s]."""
NAME = "patience"


class Patience:
    """Says again and again which episode has been under way longest, if that is long; use as a context.

    What tells is called from a thread of its own.
    """

    def __init__(self, tell: Callable[[str, float], None]) -> None:
        self._tell, self._begun, self._ended = tell, dict[Episode, float](), threading.Event()
        self._thread = threading.Thread(target=self._watch, name=NAME, daemon=True)

    def __enter__(self) -> "Patience":
        self._thread.start()
        return self

    def __exit__(self, *problem: object) -> None:
        self._ended.set()
        self._thread.join()

    def begins_unless(self, skip: Callable[[Episode], bool]) -> Callable[[Episode], bool]:
        """Whether an episode is skipped, asked when it is about to begin: if not, it is under way from then on."""

        def asked(episode: Episode) -> bool:
            skipped = skip(episode)
            if not skipped:
                self._begun[episode] = time.monotonic()
            return skipped

        return asked

    def until_there(self, outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
        """The outcomes, whose episodes are under way no more."""
        for outcome in outcomes:
            self._begun.pop(outcome.episode, None)
            yield outcome

    def _watch(self) -> None:
        while not self._ended.wait(LONG_S / 10.0):
            for episode, since in sorted(self._begun.items(), key=lambda begun: begun[1])[:1]:
                seconds = time.monotonic() - since
                if seconds >= LONG_S:
                    self._tell(f"agent '{episode.agent}' from start {episode.start}", seconds)
