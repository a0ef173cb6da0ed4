"""Meanings of options that several commands have: the cluster, what to take from a source.

`typed` is the command as it was typed, `study_folder` what a PATH means: a folder, or a copy of a shipped study.
"""

import argparse
import shlex
import shutil
import sys
from collections.abc import Callable
from contextlib import nullcontext
from functools import wraps
from pathlib import Path
from typing import TypeVar

from proxytune.errors import InputError, StoreError
from proxytune.files import check_place, folder_draft_of, shipped
from proxytune.importing import Facts, Wanted, finite, read_geometry
from proxytune.running import on_cluster
from proxytune.settings import nearest, pairs_in
from proxytune.study import FILE_NAME, MADE, study_around


def typed(arguments: argparse.Namespace) -> str:
    """What repeats the command in a shell; "" where it was not typed but called."""
    words = [word for word in getattr(arguments, "words", ()) if word != "--json"]
    return shlex.join(["python", "-m", "proxytune", *words]) if words else ""


DASK = "dask"
Result = TypeVar("Result")


def on_its_cluster(run: Callable[[argparse.Namespace], Result]) -> Callable[[argparse.Namespace], Result]:
    """Run a command where its options say."""

    @wraps(run)
    def placed(arguments: argparse.Namespace) -> Result:
        if arguments.backend == DASK and not arguments.address:
            raise InputError("--backend dask: give --address too, that of the scheduler, as in tcp://127.0.0.1:8786")
        if arguments.address and arguments.backend != DASK:
            raise InputError(f"--address {arguments.address}: is for --backend dask; give that too")
        with on_cluster(arguments.address) if arguments.address else nullcontext():
            return run(arguments)

    return placed


def wanted_of(arguments: argparse.Namespace) -> Wanted:
    """Columns and topics to take."""
    return Wanted(
        commands=arguments.commands,
        poses=arguments.poses,
        frames=arguments.pictures,
        wheels=arguments.wheel_speeds,
        stamps=arguments.stamps,
        columns=pairs_in("--columns", arguments.columns, "OURS=THEIRS or OURS=THEIRS:UNIT, as in x=pos_x:mm"),
        kind=arguments.kind,
        vesc=Path(arguments.vesc) if arguments.vesc else None,
    )


def facts_of(arguments: argparse.Namespace) -> Facts:
    """Facts that only the user knows."""
    offset = arguments.clock_offset
    if offset not in ("", "fit") and finite(offset) is None:
        raise InputError(f"--clock-offset {offset}: give seconds, as in -0.25, or fit")
    log, road = vars(arguments).get("log"), arguments.map
    if (arguments.figure or road) and log and (log / "log.toml").is_file():
        option = "--figure" if arguments.figure else "--map"
        raise InputError(f"{option}: is for a bag or table, and {log} is a log already; state it in its log.toml")
    road = str(Path(road).resolve()) if road.endswith(".toml") else road
    return Facts(arguments.robot or "", read_geometry(arguments.figure), road, offset)


NOT_COPIED = (*MADE, "study.db*", "study.lock", "report.html", "__pycache__")
"""What running a study adds; not copied."""


def check_made(folder: Path) -> None:
    """Refuse a study's folder in which its figures and its page cannot be written, before anything is simulated."""
    check_place(folder / "figures", folder=True, ours=True)
    check_place(folder / "report.html", ours=True)


def study_folder(path: Path) -> Path:
    """The study's folder, given as itself or as its study.toml; one of several families has its own in it.

    Where there is none and its last part names a study that comes with the package, that study is copied there.
    """
    folder = path.parent if path.name == FILE_NAME else path
    if study_around(folder) is not None:
        return folder
    if folder.exists():
        if not (folder / FILE_NAME).is_file():
            raise InputError(f"{folder}: has no {FILE_NAME}; give the folder of a study")
        return folder
    studies = {home.name: home for home in shipped("studies").iterdir() if (home / FILE_NAME).is_file()}
    if folder.name not in studies:
        hint = nearest(folder.name, studies)
        raise InputError(f"{folder}: no such folder, and no study of that name comes with proxytune; {hint}")
    try:
        with folder_draft_of(folder) as draft:
            shutil.copytree(studies[folder.name], draft, ignore=shutil.ignore_patterns(*NOT_COPIED), dirs_exist_ok=True)
    except (OSError, shutil.Error) as problem:
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else "copying failed"
        raise StoreError(f"{folder}: cannot be written ({reason}); choose another place") from None
    print(f"copied the study '{folder.name}', which comes with proxytune, to {folder}", file=sys.stderr)
    return folder
