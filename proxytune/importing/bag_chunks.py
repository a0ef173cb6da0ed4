"""The packed chunks of a bag, counted before anything reads them: a bag of a megabyte may unpack to gigabytes.

ROS 1 bags and mcap files pack many messages together, ROS 2 bags of sqlite3 a whole file or each message. What the
files say of the sizes is not believed, as the libraries that unpack them do not check it before.
"""

import bz2
import struct
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from proxytune.settings import allowed_bytes
from proxytune.unpacking import BAG_MB, check_unpacked, unpacked_size

DENSEST = 100
"""Times its own size: pictures of a world that stands still pack so well, and hardly anything else."""
Chunk = tuple[str, bytes]
"""How bytes are packed, "bz2", "lz4" or "zstd", and the bytes."""


def check_bag_size(path: Path) -> None:
    """Refuse a bag whose files unpack to more than is allowed; what is damaged is left to whoever reads it."""
    _check(path, (chunk for file in _files(path) for chunk in _chunks(file)))


def check_messages_size(path: Path, reader: Any) -> None:
    """Refuse a bag whose messages, each packed by itself, unpack to more; the library's reader of it is open."""
    inside: list[Any] = [getattr(one, "storage", None) for one in reader.readers]
    folders = [one for one in inside if hasattr(one, "storages")]
    packed = [folder for folder in folders if folder.metadata.compression_mode == "message"]
    stores = [store for folder in packed for store in folder.storages]
    _check(path, (("zstd", bytes(row[-1])) for store in stores for row in store.messages(store.connections)))


def _files(path: Path) -> list[Path]:
    return [path] if path.is_file() else [file for file in path.glob("*") if file.is_file()]


def _check(path: Path, chunks: Iterable[Chunk]) -> None:
    most, size = max(allowed_bytes(BAG_MB), DENSEST * sum(file.stat().st_size for file in _files(path))), 0
    for packing, data in chunks:
        with suppress(Exception):  # What is damaged fails in many ways, the libraries' own
            size += unpacked_size(_decompressor(packing), data, most - size)
        if size > most:
            check_unpacked(path, size, most / 1e6)


def _decompressor(packing: str) -> Callable[[], Any]:
    if packing == "bz2":
        return bz2.BZ2Decompressor
    if packing == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        made: Callable[[], Any] = LZ4FrameDecompressor
        return made
    if sys.version_info >= (3, 14):
        from compression.zstd import ZstdDecompressor
    else:
        from backports.zstd import ZstdDecompressor
    return ZstdDecompressor


def _chunks(path: Path) -> Iterator[Chunk]:
    with suppress(OSError, struct.error, ValueError, OverflowError), path.open("rb") as file:
        start = file.read(16)
        if start.startswith(b"#ROSBAG"):
            file.seek(start.find(b"\n") + 1)
            yield from _of_ros1(file, path.stat().st_size)
        elif start.startswith(b"\x89MCAP0\r\n"):
            file.seek(8)
            yield from _of_mcap(file, path.stat().st_size)
        elif start.startswith(ZSTD):
            yield "zstd", start + file.read()


ZSTD = b"\x28\xb5\x2f\xfd"


def _of_ros1(file: IO[bytes], most: int) -> Iterator[Chunk]:
    """Records are a header of fields, name=value, and data; each has its length before it, of `most` bytes at most."""
    while length := file.read(4):
        header, fields = file.read(min(most, *struct.unpack("<I", length))), dict[bytes, bytes]()
        while header:
            (size,) = struct.unpack_from("<I", header)
            name, _, value = header[4 : 4 + size].partition(b"=")
            fields[name], header = value, header[4 + size :]
        (size,) = struct.unpack("<I", file.read(4))
        packing = fields.get(b"compression", b"none").decode()
        if fields.get(b"op") == b"\x05" and packing in ("bz2", "lz4"):
            yield packing, file.read(min(size, most))
        else:
            file.seek(size, 1)


def _of_mcap(file: IO[bytes], most: int) -> Iterator[Chunk]:
    """Records are a kind and a length; a chunk states times, size and checksum (28 bytes) and its packing first."""
    while kind := file.read(1):
        (size,) = struct.unpack("<Q", file.read(8))
        if kind != b"\x06":
            file.seek(size, 1)
            continue
        head = file.read(32)
        packing = file.read(min(most, *struct.unpack("<I", head[28:]))).decode()
        file.seek(8, 1)
        data = file.read(min(most, max(0, size - 40 - len(packing))))
        if packing in ("lz4", "zstd"):
            yield packing, data
