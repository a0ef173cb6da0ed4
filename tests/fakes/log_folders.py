"""Folders with a user's log, good or wrong, and what reading them says."""

from collections.abc import Mapping
from pathlib import Path

from one_line import complaint_of

from proxytune.logs import read_log


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write files by name into a folder, which need not be there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return folder


def complaint(folder: Path) -> str:
    """What reading the log complains of: one line, from the folder's name on."""
    complaint = complaint_of(read_log, folder)
    assert complaint.startswith(str(folder))
    return complaint.removeprefix(str(folder))
