"""Reading whatever a user has: the form is told by what is in it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from proxytune.errors import LogError
from proxytune.importing.checks import checked_drive
from proxytune.importing.plausibility import check_units
from proxytune.importing.ros import is_bag, read_bag
from proxytune.importing.source import Source
from proxytune.importing.survey import clock_notes, survey
from proxytune.importing.tables.arrays import is_arrays, read_arrays
from proxytune.importing.tables.csv_tables import is_csv_tables, read_csv_tables
from proxytune.importing.tables.mrclam import is_mrclam, read_mrclam
from proxytune.importing.tables.tum import is_tum, read_tum
from proxytune.importing.wanted import Wanted


class Form(NamedTuple):
    """A form that recordings come in: what tells it, and what reads it."""

    recognise: Callable[[Path], bool]
    read: Callable[[Path, Wanted], Source]


FORMS = (
    Form(is_bag, read_bag),
    Form(is_arrays, read_arrays),
    Form(is_mrclam, read_mrclam),
    Form(is_tum, read_tum),
    Form(is_csv_tables, read_csv_tables),
)
"""From what is told most surely to what takes any text."""

KNOWN = "a ROS bag (.bag, .db3, .mcap or a folder of them), CSV, TUM or MRCLAM files, or arrays (.npz)"


def read_source(path: Path, wanted: Wanted, offset_s: float = 0.0) -> Source:
    """What a source holds: its drives with stamps in order, and notes on what was taken and what is odd.

    Args:
        path: The source.
        wanted: What to take from it.
        offset_s: How much later its poses are stamped than its commands, as far as that is known [s].

    Raises:
        LogError: If it is none of the known forms, or lacks what a log needs.
    """
    if not path.exists():
        raise LogError(f"{path}: no such folder; check the path")
    if not (path.is_file() or path.is_dir()):
        # A pipe would be waited for, and a device never ends.
        raise LogError(f"{path}: is a device or a pipe; copy what it gives into a file, and give that")
    for form in FORMS:
        if form.recognise(path):
            return _checked(form.read(path, wanted), path, offset_s)
    raise LogError(f"{path}: is no recording that is known; give {KNOWN}")


def _checked(source: Source, path: Path, offset_s: float) -> Source:
    drives, notes = [], list(source.notes)
    for drive in source.drives:
        one, found = checked_drive(drive, str(path), offset_s)
        check_units(one, str(path))
        drives.append(one)
        notes += found
    kinds = {drive.commands.kind if drive.commands else "none" for drive in drives}
    if len(kinds) > 1:
        raise LogError(
            f"{path}: its drives have commands of several kinds ({', '.join(sorted(kinds))}); import them apart"
        )
    surveys = tuple(survey(drive) for drive in drives)
    if kinds != {"none"}:
        notes += clock_notes(surveys)
    return replace(source, drives=tuple(drives), notes=tuple(notes), surveys=surveys)
