"""Opening a log, whatever form it comes in: the form is told by what is in it.

A source is read, checked, put in numbers drive by drive, and written as a log's folder: whole, or not at all.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomlkit
from PIL import Image

from proxytune.arrays import Floats
from proxytune.errors import InputError, LogError, RunError
from proxytune.files import folder_draft_of, temporary_folder
from proxytune.importing.arrays import is_arrays, read_arrays
from proxytune.importing.bag import bags_in
from proxytune.importing.checks import check_units, checked_drive, lag_of
from proxytune.importing.source import Drive, Facts, Pictures, Source, Survey, Wanted
from proxytune.importing.tables import is_csv_tables, is_mrclam, is_tum, read_csv_tables, read_mrclam, read_tum
from proxytune.importing.topics import read_bag
from proxytune.logs import COMMANDS, ENABLED, WHEELS, Log, read_log

GAP_S = 0.5
"""A longer time without a pose is a gap."""


def survey(drive: Drive) -> Survey:
    """The numbers of a drive whose stamps are in order."""
    times = drive.poses.times
    steps = np.diff(times)
    usual = float(np.median(steps))
    gaps = steps[steps > max(GAP_S, 3.0 * usual)]
    missing = float(np.maximum(np.rint(steps / usual) - 1.0, 0.0)[steps <= GAP_S].sum())
    return Survey(
        name=drive.name,
        seconds=float(times[-1] - times[0]),
        poses=len(times),
        poses_hz=1.0 / usual,
        lost=missing / (missing + len(steps) + 1),
        gaps=len(gaps),
        longest_gap_s=float(gaps.max(initial=0.0)),
        jitter_s=float(steps[steps < 1.5 * usual].std()),
        commands=0 if drive.commands is None else len(drive.commands.times),
        frames=0 if drive.pictures is None else len(drive.pictures.times),
        lag_s=lag_of(drive),
    )


def clock_notes(drives: Sequence[Survey]) -> list[str]:
    """Tell what the lags say of the clocks of commands and poses, in a sentence."""
    lags = [(one.lag_s, one.name) for one in drives if one.lag_s is not None]
    if early := [pair for pair in lags if pair[0] < 0.0]:
        lag, first = min(early)
        turn = f"{len(early)} of {len(drives)} drives turn before they are told to (up to {-lag:.2f} s, {first})"
        remedy = "diagnose corrects that, --clock-offset declares it"
        return [f"{turn}: two clocks stamped commands and poses; {remedy}"]
    if not lags:
        return ["no drive turns as commanded, long and clearly enough to tell whether commands and poses share a clock"]
    usual = float(np.median([lag for lag, _ in lags]))
    together = "delay, lag and an offset between the two clocks together, which nothing here can tell apart"
    return [f"it turns {usual:.2f} s after its commands: {together}"]


def rows_notes(drives: Sequence[Drive]) -> list[str]:
    """Tell how late commands may be that are known only where poses are: a row has the last one before it."""
    apart = [
        float(np.median(np.diff(one.poses.times)))
        for one in drives
        if one.commands is not None and one.commands.in_rows and np.isin(one.commands.times, one.poses.times).all()
    ]
    if not apart:
        return []
    late = max(apart)
    return [
        f"commands stand in the rows of poses, {late:.3g} s apart: one that was issued between two rows stands in the "
        f"later one, on average {late / 2.0:.2g} s late, and delays come out that much too short; unless they were "
        "issued as the rows were written, log them with times of their own (command_time=, or a commands.csv)"
    ]


FORMS: Mapping[Callable[[Path], object], Callable[[Path, Wanted], Source]] = {
    bags_in: read_bag,
    is_arrays: read_arrays,
    is_mrclam: read_mrclam,
    is_tum: read_tum,
    is_csv_tables: read_csv_tables,
}
"""What tells a form that recordings come in, and what reads it; from the surest to what takes any text."""
ONLY_FOR: Mapping[str, tuple[str, str, Sequence[object]]] = {
    "vesc": ("--vesc", "bags", (read_bag,)),
    "stamps": ("--stamps", "bags", (read_bag,)),
    "wheels": ("--wheel-speeds", "bags (a table's wheels are named by --columns)", (read_bag,)),
    "poses": ("--poses", "bags and MRCLAM", (read_bag, read_mrclam)),
    "frames": ("--pictures", "bags and .npz", (read_bag, read_arrays)),
    "columns": ("--columns", "tables and arrays", (read_arrays, read_tum, read_csv_tables)),
}
"""What of Wanted is not for every form: its option, what that is for, and what reads it."""
KNOWN = "a ROS bag (.bag, .db3, .mcap or a folder of them), CSV, TUM or MRCLAM files, or arrays (.npz)"


def read_source(path: Path, wanted: Wanted, offset_s: float = 0.0) -> Source:
    """Read a source: its drives with stamps in order, and notes on what was taken and what is odd.

    Its poses are stamped later than its commands by `offset_s`, as far as that is known [s].
    """
    if not path.exists():
        raise LogError(f"{path}: no such folder; check the path")
    if not (path.is_file() or path.is_dir()):
        # A pipe would be waited for, and a device never ends.
        raise LogError(f"{path}: is a device or a pipe; copy what it gives into a file, and give that")
    read = next((read for recognise, read in FORMS.items() if recognise(path)), None)
    if read is None:
        raise LogError(f"{path}: is no recording that is known; give {KNOWN}")
    for name, (option, forms, readers) in ONLY_FOR.items():
        if read not in readers and getattr(wanted, name) not in (getattr(NOTHING, name), "none"):
            raise LogError(f"{path}: {option} is for {forms}; leave it out")
    source = read(path, wanted)
    drives, notes = [], list(source.notes)
    for drive in source.drives:
        one, found = checked_drive(drive, str(path), offset_s)
        check_units(one, str(path))
        drives.append(one)
        notes += found
    kinds = {drive.commands.kind if drive.commands else "none" for drive in drives}
    if len(kinds) > 1:
        several = ", ".join(sorted(kinds))
        raise LogError(f"{path}: its drives have commands of several kinds ({several}); import them apart")
    surveys = tuple(survey(drive) for drive in drives)
    if kinds != {"none"}:
        notes += [*clock_notes(surveys), *rows_notes(drives)]
    return replace(source, drives=tuple(drives), notes=tuple(notes), surveys=surveys)


PICTURES = "frames/%06d.png"


def write_log(source: Source, folder: Path, facts: Facts, origin: str) -> Log:
    """Write log.toml with where it came from, samples.csv, commands.csv and pictures; gives the log that it reads as.

    The folder must not exist or be empty, or else be this very log: an InputError. A LogError if what was read makes no
    log, a RunError if it cannot be written.
    """
    folder = folder.resolve()
    with writable(folder), folder_draft_of(folder) as draft:
        fill_log(draft, source, facts, folder.name, origin)
        return read_as(draft, folder)


def fill_log(folder: Path, source: Source, facts: Facts, name: str, origin: str) -> None:
    """Write the files of a log of this name into a folder that is there, with its origin in log.toml."""
    samples, commands = [], []
    for drive in source.drives:
        poses = (drive.poses.times, drive.poses.places[:, :2], np.unwrap(drive.poses.headings))
        wheels = () if drive.wheels is None else drive.wheels.at(drive.poses.times)
        names = ("time", "x", "y", "heading", *WHEELS)[: 4 + len(wheels)]
        samples.append(_named(drive.name, (*poses, *wheels), names))
        if drive.commands is not None:
            names = ("time", *COMMANDS[drive.commands.kind], ENABLED)[: 1 + drive.commands.values.shape[1]]
            commands.append(_named(drive.name, (drive.commands.times, drive.commands.values), names))
    # Where every command was written down with a pose, both stand in one table.
    if commands and all(
        drive.commands is not None and np.array_equal(drive.commands.times, drive.poses.times)
        for drive in source.drives
    ):
        samples, commands = [pd.merge(*both) for both in zip(commands, samples, strict=True)], []
    for name_of_file, tables in (("samples.csv", samples), ("commands.csv", commands)):
        if tables:
            pd.concat(tables).to_csv(folder / name_of_file, index=False, lineterminator="\n")
    pictures = [(drive.name, drive.pictures) for drive in source.drives if drive.pictures is not None]
    kinds = {drive.commands.kind for drive in source.drives if drive.commands is not None}
    stated: dict[str, Any] = {"format": 1, "name": name, "robot": facts.robot or name}
    stated |= {"command": next(iter(kinds), "none"), "source": f"{origin}, {source.form}"} | dict(facts.figures)
    if facts.clock_offset:
        stated["clock_offset_s"] = facts.clock_offset if facts.clock_offset == "fit" else float(facts.clock_offset)
    if pictures:
        _write_pictures(folder, pictures)
        stated |= {"map": facts.road, "camera": {"frames": PICTURES}}
    (folder / "log.toml").write_text(tomlkit.dumps(stated), encoding="utf-8")


def read_as(folder: Path, shown: Path) -> Log:
    """Read a log that lies elsewhere for the moment; complaints name where the user knows it."""
    try:
        return read_log(folder)
    except LogError as problem:
        raise LogError(str(problem).replace(str(folder), str(shown))) from None


@contextmanager
def writable(folder: Path) -> Iterator[None]:
    """Tell in one line what keeps a folder from being written: an InputError if something is there, else a RunError."""
    try:
        yield
    except FileExistsError:
        raise InputError(f"{folder}: is there already; give a folder that is not") from None
    except OSError as problem:
        raise RunError(f"{folder}: cannot be written ({problem.strerror}); make room, or give another folder") from None


def _named(episode: str, columns: tuple[Floats, ...], names: tuple[str, ...]) -> pd.DataFrame:
    table = pd.DataFrame(np.column_stack(columns), columns=list(names))
    table.insert(0, "episode", episode)
    return table


def _write_pictures(folder: Path, drives: list[tuple[str, Pictures]]) -> None:
    """Every picture by its number, one in memory at a time, and frames.csv."""
    (folder / "frames").mkdir()
    rows: list[tuple[int, str, float]] = []
    for name, pictures in drives:
        for time, picture in zip(pictures.times.tolist(), pictures.read(), strict=True):
            Image.fromarray(picture).save(folder / (PICTURES % len(rows)))
            rows.append((len(rows), name, time))
    pd.DataFrame(rows, columns=["frame", "episode", "time"]).to_csv(folder / "frames.csv", index=False)


NOTHING = Wanted()
NO_FACTS = Facts()


@contextmanager
def open_log(
    source: Log | str | Path, wanted: Wanted = NOTHING, facts: Facts = NO_FACTS
) -> Iterator[tuple[Log, tuple[str, ...]]]:
    """A log itself, its folder, or a bag or table as the log that `import` makes of it, and what was found on the way.

    What is imported lies in a temporary folder for as long as the log is open.
    """
    if isinstance(source, Log):
        yield source, ()
        return
    path = Path(source)
    if (path / "log.toml").is_file() or (path / "samples.csv").is_file():
        if wanted != NOTHING or facts.clock_offset:
            raise LogError(f"{path}: is a log already; state it in log.toml, as in clock_offset_s, not by options")
        yield read_log(path), ()
        return
    found = read_source(path, wanted, facts.offset_s)
    with as_log(with_named_pictures(found, facts), facts, path) as log:
        yield log, found.notes


@contextmanager
def as_log(source: Source, facts: Facts, path: Path) -> Iterator[Log]:
    """The log that a source makes, read at a path, in a temporary folder for as long as it is open."""
    with temporary_folder() as folder:
        with writable(folder):
            fill_log(folder, source, facts, path.resolve().stem, origin=path.name)
        yield read_as(folder, path)


def with_named_pictures(source: Source, facts: Facts) -> Source:
    """The source without its pictures where nobody says which map they show, and a note of it."""
    if facts.road or all(drive.pictures is None for drive in source.drives):
        return source
    drives = tuple(replace(drive, pictures=None) for drive in source.drives)
    note = "pictures are left out: name the map that they show with --map"
    return replace(source, drives=drives, notes=(*source.notes, note))
