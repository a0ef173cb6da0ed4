"""What is packed is measured before it is unpacked: a few kilobytes may say that they hold gigabytes.

One limit of each kind, and one environment variable that raises them all, as it does those of plain files.
"""

import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from proxytune.errors import InputError
from proxytune.settings import LARGEST, allowed_bytes

ARRAYS_MB = 1000
"""All arrays of a file together, or all pictures of a log as they are kept: what reads them takes two or three times
as much memory."""
BAG_MB = 1000
"""What a bag unpacks to, or a hundred times its own size: no recording of a robot is denser."""
PICTURE_MB = 200
"""One picture of red, green and blue: 66 megapixels."""


def check_unpacked(where: object, size: float, usual_mb: float) -> None:
    """Refuse what would unpack to more bytes than the usual limit of its kind [MB], or what somebody has raised it to.

    Raises:
        InputError: If it does, with what raises the limit; or if what is to raise it is no number.
    """
    most = allowed_bytes(usual_mb)
    if size > most:
        remedy = f"if it is meant, allow as much by the environment variable {LARGEST}={int(size / 1e6) + 1}"
        raise InputError(f"{where}: unpacks to {size / 1e6:.0f} MB or more, of {most / 1e6:.0f} MB at most; {remedy}")


def read_arrays(path: Path, usual_mb: float = ARRAYS_MB) -> dict[str, NDArray[Any]]:
    """The arrays of an .npz file, by name.

    Raises:
        InputError: If they unpack to more than is allowed.
        Exception: Nearly any, zipfile's, zlib's and numpy's own, where the file is damaged or holds pickled objects.
    """
    with path.open("rb") as stream:
        with zipfile.ZipFile(stream) as packed:
            # No more is ever unpacked of an entry than it states
            check_unpacked(path, sum(entry.file_size for entry in packed.infolist()), usual_mb)
        stream.seek(0)
        with np.load(stream, allow_pickle=False) as file:
            return {name: np.asarray(file[name]) for name in file.files}


@contextmanager
def open_picture(source: Path | IO[bytes], where: object, formats: tuple[str, ...]) -> Iterator[Image.Image]:
    """A picture whose size is known and whose pixels are not unpacked yet; a complaint names `where` it is.

    It may be of these formats, as Pillow calls them; others are handed to no decoder.

    Raises:
        InputError: If its pixels take more than is allowed.
        Exception: What Pillow raises at files that are damaged.
    """
    # Pillow's own limit, which nobody can raise from outside, gives way to ours
    kept, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(source, formats=formats) as image:
                size = f"{where}: a picture of {image.width} × {image.height}"
                check_unpacked(size, 3.0 * image.width * image.height, PICTURE_MB)
                yield image
    finally:
        Image.MAX_IMAGE_PIXELS = kept


AT_ONCE = 2**20


def unpacked_size(new: Callable[[], Any], data: bytes, most: float) -> int:
    """The bytes that packed ones unpack to, counted a megabyte at a time, up to where they are too many.

    A `new` decompressor, of bz2, lz4 or zstd, has `decompress`, `eof` and `unused_data`.

    Raises:
        Exception: The decompressor's own, where they are damaged.
    """
    size, unpacker = 0, new()
    while size <= most:
        piece = unpacker.decompress(data, AT_ONCE)
        size, data = size + len(piece), b""
        if unpacker.eof and unpacker.unused_data:
            data, unpacker = unpacker.unused_data, new()
        elif unpacker.eof or not piece:
            return size
    return size
