"""A user's modules as one value that another machine can import from."""

import hashlib
import io
import tempfile
import zipfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from proxytune.extensions.beside import open_folder
from proxytune.meaning import modules_beside

Packed = tuple[tuple[str, bytes], ...]
"""Folders, each with its modules as the bytes of a ZIP file."""


def pack(folders: Sequence[str]) -> Packed:
    """The modules of folders; other files stay where they are."""
    return tuple((folder, _zipped(Path(folder))) for folder in folders)


def unpack(packed: Packed) -> None:
    """Let this process import packed modules by the names that they had where they were packed."""
    for folder, content in packed:
        open_folder(folder, _unzipped(content))


def _zipped(folder: Path) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for path in modules_beside(folder):
            # No dates: the same modules are the same bytes.
            archive.writestr(zipfile.ZipInfo(path.relative_to(folder).as_posix()), path.read_bytes())
    return content.getvalue()


@lru_cache(maxsize=64)
def _unzipped(content: bytes) -> str:
    """A folder of this process's own with the files; it stays as long as the process does."""
    digest = hashlib.sha256(content).hexdigest()[:8]
    folder = tempfile.mkdtemp(prefix=f"proxytune_{digest}_")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(folder)
    return folder
