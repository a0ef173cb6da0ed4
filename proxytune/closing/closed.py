"""A loop that has come to its end."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from proxytune.api.studies import StudyReport
from proxytune.closing.opening import Loop
from proxytune.usefulness import Assessment


@dataclass(frozen=True)
class Closed:
    """A loop that has come to its end.

    Attributes:
        loop: Which one.
        before: The study.
        diagnosis: What `diagnose --json` prints of the log.
        after: The extended study; None where nothing was found to extend the proxy by.
        held_out: What held-out agents say of both tuned proxies; None where there are none, or nothing was found.
        done: The steps that this run has done or gone on with.
        episodes: How many episodes this run has driven.
    """

    loop: Loop
    before: StudyReport
    diagnosis: Mapping[str, Any]
    after: StudyReport | None
    held_out: tuple[Assessment, Assessment] | None
    done: tuple[str, ...]
    episodes: int
