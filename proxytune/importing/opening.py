"""Opening a log, whatever form it comes in."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from proxytune.importing.facts import Facts
from proxytune.importing.reading import read_source
from proxytune.importing.source import Source
from proxytune.importing.wanted import Wanted
from proxytune.importing.writing import fill_log, read_as, writable
from proxytune.logs import Log, read_log

NOTHING = Wanted()
NO_FACTS = Facts()


@contextmanager
def open_log(path: Path, wanted: Wanted = NOTHING, facts: Facts = NO_FACTS) -> Iterator[tuple[Log, tuple[str, ...]]]:
    """A log's folder, or a bag or table as the log that `import` would make of it, and what was found on the way.

    What is imported lies in a temporary folder for as long as the log is open.

    Raises:
        LogError: If it is neither.
    """
    if (path / "log.toml").is_file() or (path / "samples.csv").is_file():
        yield read_log(path), ()
        return
    source = read_source(path, wanted, facts.offset_s)
    with tempfile.TemporaryDirectory(prefix="proxytune_") as home:
        folder = Path(home)
        named = source_without_unnamed_pictures(source, facts)
        with writable(folder):
            fill_log(folder, named, facts, path.resolve().stem, origin=path.name)
        yield read_as(folder, path), source.notes


def source_without_unnamed_pictures(source: Source, facts: Facts) -> Source:
    """The source without its pictures where nobody says which map they show, and a note of it."""
    if facts.road or all(drive.pictures is None for drive in source.drives):
        return source
    drives = tuple(replace(drive, pictures=None) for drive in source.drives)
    note = "pictures are left out: name the map that they show with --map"
    return replace(source, drives=drives, notes=(*source.notes, note))
