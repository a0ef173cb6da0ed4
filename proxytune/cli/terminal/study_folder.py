"""The folder that a PATH means: an existing one, or a copy of a study that comes with the package."""

import contextlib
import shutil
import sys
from pathlib import Path

from proxytune.cli.terminal.trusting import remember
from proxytune.errors import InputError, ProxytuneError, StoreError
from proxytune.files import draft_path, shipped
from proxytune.settings import nearest
from proxytune.study import FILE_NAME, MADE, study_around

NOT_COPIED = (*MADE, "study.db*", "study.lock", "report.html", "__pycache__")
"""What running a study adds; not copied."""


def study_folder(path: Path) -> Path:
    """The study's folder, given as itself or as its study.toml; one of several families has its own in it.

    Where there is none and its last part names a study that comes with the package, that study is copied there.

    Raises:
        InputError: If there is no such study.
        StoreError: If the copy cannot be written.
    """
    folder = path.parent if path.name == FILE_NAME else path
    if study_around(folder, FILE_NAME) is not None:
        return folder
    if folder.exists():
        if not (folder / FILE_NAME).is_file():
            raise InputError(f"{folder}: has no {FILE_NAME}; give the folder of a study")
        return folder
    studies = {home.name: home for home in shipped("studies").iterdir() if (home / FILE_NAME).is_file()}
    if folder.name not in studies:
        hint = nearest(folder.name, studies)
        raise InputError(f"{folder}: no such folder, and no study of that name comes with proxytune; {hint}")
    _copy(studies[folder.name], folder)
    with contextlib.suppress(ProxytuneError):
        # Where it cannot be remembered, its code is still known by its contents.
        remember(folder)
    print(f"copied the study '{folder.name}', which comes with proxytune, to {folder}", file=sys.stderr)
    return folder


def _copy(source: Path, folder: Path) -> None:
    """Copy the whole folder or nothing."""
    draft = draft_path(folder)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, draft, ignore=shutil.ignore_patterns(*NOT_COPIED))
        draft.replace(folder)
    except (OSError, shutil.Error) as problem:
        with contextlib.suppress(OSError):
            shutil.rmtree(draft)
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else "copying failed"
        raise StoreError(f"{folder}: cannot be written ({reason}); choose another place") from None
