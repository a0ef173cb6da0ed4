"""A source written as a log's folder: whole, or not at all."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas as pd
import tomlkit
from PIL import Image

from proxytune.errors import InputError, LogError, RunError
from proxytune.importing.facts import Facts
from proxytune.importing.source import Commands, Drive, Pictures, Poses, Source
from proxytune.logs import COMMANDS, Log, read_log

PICTURES = "frames/%06d.png"


def write_log(source: Source, folder: Path, facts: Facts, origin: str) -> None:
    """Write log.toml, samples.csv, commands.csv and pictures.

    Args:
        source: What was read and checked.
        folder: The log's folder, which must not exist or be empty.
        facts: What only the user knows.
        origin: Where it came from, for log.toml.

    Raises:
        InputError: If the folder is not free.
        LogError: If what was read makes no log.
        RunError: If it cannot be written.
    """
    folder = folder.resolve()
    with _written_whole(folder) as draft:
        fill_log(draft, source, facts, folder.name, origin)
        read_as(draft, folder)


def fill_log(folder: Path, source: Source, facts: Facts, name: str, origin: str) -> None:
    """Write a log's files into a folder that is there.

    Args:
        folder: Where to.
        source: What was read and checked.
        facts: What only the user knows.
        name: What the log is called.
        origin: Where it came from, for log.toml.
    """
    _write_table(folder / "samples.csv", [_samples(drive.name, drive.poses) for drive in source.drives])
    commands = [_commands(drive.name, drive.commands) for drive in source.drives if drive.commands is not None]
    if commands:
        _write_table(folder / "commands.csv", commands)
    pictures = [drive for drive in source.drives if drive.pictures is not None]
    if pictures:
        _write_pictures(folder, pictures)
    text = _description(source, name, facts, origin, with_pictures=bool(pictures))
    (folder / "log.toml").write_text(text, encoding="utf-8")


def read_as(folder: Path, shown: Path) -> Log:
    """Read a log that lies elsewhere for the moment; complaints name where the user knows it.

    Raises:
        LogError: If it is none.
    """
    try:
        return read_log(folder)
    except LogError as problem:
        raise LogError(str(problem).replace(str(folder), str(shown))) from None


@contextmanager
def _written_whole(folder: Path) -> Iterator[Path]:
    """A folder to fill that becomes the wanted one once it is whole."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is there already; give a folder that is not")
    with writable(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as draft:
            inside = Path(draft) / "log"
            inside.mkdir()
            yield inside
            if folder.exists():
                folder.rmdir()
            shutil.move(inside, folder)


@contextmanager
def writable(folder: Path) -> Iterator[None]:
    """Tell in one line what keeps a folder from being written.

    Raises:
        RunError: If something does.
    """
    try:
        yield
    except OSError as problem:
        raise RunError(f"{folder}: cannot be written ({problem.strerror}); make room, or give another folder") from None


def _samples(name: str, poses: Poses) -> pd.DataFrame:
    columns = np.column_stack((poses.times, poses.places[:, :2], np.unwrap(poses.headings)))
    return _named(name, columns, ("time", "x", "y", "heading"))


def _commands(name: str, commands: Commands) -> pd.DataFrame:
    return _named(name, np.column_stack((commands.times, commands.values)), ("time", *COMMANDS[commands.kind]))


def _named(name: str, columns: np.ndarray, names: tuple[str, ...]) -> pd.DataFrame:
    table = pd.DataFrame(columns, columns=list(names))
    table.insert(0, "episode", name)
    return table


def _write_table(path: Path, tables: list[pd.DataFrame]) -> None:
    pd.concat(tables).to_csv(path, index=False, lineterminator="\n")


def _write_pictures(folder: Path, drives: list[Drive]) -> None:
    """Every picture by its number, one in memory at a time, and frames.csv."""
    (folder / "frames").mkdir()
    rows: list[tuple[int, str, float]] = []
    for drive in drives:
        for time, picture in _timed(drive.pictures):
            Image.fromarray(picture).save(folder / (PICTURES % len(rows)))
            rows.append((len(rows), drive.name, time))
    pd.DataFrame(rows, columns=["frame", "episode", "time"]).to_csv(folder / "frames.csv", index=False)


def _timed(pictures: Pictures | None) -> Iterator[tuple[float, np.ndarray]]:
    if pictures is not None:
        yield from zip(pictures.times.tolist(), pictures.read(), strict=True)


def _description(source: Source, name: str, facts: Facts, origin: str, *, with_pictures: bool) -> str:
    """The text of log.toml."""
    kinds = {drive.commands.kind for drive in source.drives if drive.commands is not None}
    stated = {"format": 1, "name": name, "robot": facts.robot or name, "command": next(iter(kinds), "none")}
    stated |= {"source": f"{origin}, {source.form}"} | dict(facts.figures)
    if facts.clock_offset:
        stated["clock_offset_s"] = facts.clock_offset if facts.clock_offset == "fit" else float(facts.clock_offset)
    if with_pictures:
        stated["map"] = facts.road
    return tomlkit.dumps(stated | ({"camera": {"frames": PICTURES}} if with_pictures else {}))
