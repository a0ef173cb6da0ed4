"""What made-up classrooms round Wobbly share: its members, a journal, and keys of [domain] of their own."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from wobbly import Wobbly, wobbly

from proxytune.domain import Episode
from proxytune.settings import Section


class Walled:
    """Hands on what it has not itself to the Wobbly inside."""

    inner: Wobbly
    journal: str

    best_score = 60.0

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name == "inner":
            raise AttributeError(name)
        return getattr(self.inner, name)

    def _note(self, what: str, episode: Episode) -> None:
        if self.journal:
            with open(self.journal, "a") as journal:
                journal.write(f"{what} {episode.seed}\n")


def inside(section: Section, model: Path | None, keys: Iterable[str]) -> tuple[Wobbly, dict[str, Any]]:
    """The Wobbly that a [domain] table describes, and the values of those of the classroom's own keys that it has."""
    own = {key: section.values[key] for key in section.values if key in set(keys)}
    rest = Section(section.path, section.name, {k: v for k, v in section.values.items() if k not in own})
    return wobbly(rest, model=model), own
