"""Pictures of a camera's topic as arrays of red, green and blue."""

import struct
import zlib
from collections.abc import Iterator, Mapping
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from proxytune.errors import LogError
from proxytune.importing.ros.bag import Bag, open_bag
from proxytune.importing.ros.messages import collect
from proxytune.importing.ros.stamps import choose_times
from proxytune.importing.source import Pictures

Picture = NDArray[np.uint8]

ENCODINGS: Mapping[str, tuple[int, tuple[int, int, int]]] = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
}
"""Bytes of a pixel, and which of them are red, green and blue."""

BROKEN = (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error, Image.DecompressionBombError)
"""What Pillow raises at pictures that are cut off or damaged."""


def read_pictures(bag: Bag, topic: str, stamps: str) -> tuple[Pictures, tuple[str, ...]]:
    """The pictures of a topic, and what there is to say of their times.

    Times are read at once, the pictures when they are asked for, from the bag opened anew.

    Raises:
        LogError: If a message cannot be read, or its pixels are of a kind that is not known.
    """
    both, _ = collect(bag, topic, _check)
    times, notes = choose_times(both, stamps, topic)
    return Pictures(times, partial(iterate, bag.path, topic)), notes


def iterate(path: Path, topic: str) -> Iterator[Picture]:
    """The pictures of a topic, one after the other, (rows, columns, 3) each.

    Raises:
        LogError: If one cannot be read.
    """
    with open_bag(path) as bag:
        for number, (_, message) in enumerate(bag.messages(topic), start=1):
            try:
                picture = picture_of(message)
            except LogError as problem:
                raise LogError(f"{path}: {topic}, message {number}: {problem}") from None
            yield picture


def picture_of(message: Any) -> Picture:
    """Red, green and blue (rows, columns, 3) of an Image or a CompressedImage.

    Raises:
        LogError: If its encoding is not known, or it is damaged.
    """
    return _plain(message) if hasattr(message, "encoding") else _compressed(message)


def _check(message: Any) -> tuple[float, ...]:
    """Refuse a picture that could not be made later; a compressed one shows only when it is opened."""
    if not hasattr(message, "encoding"):
        return ()
    if message.encoding not in ENCODINGS:
        known = ", ".join(ENCODINGS)
        raise LogError(f"encoding '{message.encoding}' is none of {known}; leave pictures out by --pictures none")
    if not (message.width and message.height):
        raise LogError("has no pixels; record it again, or leave pictures out by --pictures none")
    channels = ENCODINGS[message.encoding][0]
    if message.step < channels * message.width or len(message.data) < message.step * message.height:
        size = f"{message.width} × {message.height} pixels in rows of {message.step} bytes"
        raise LogError(f"{len(message.data)} bytes do not hold {size}; record it again, or take --pictures none")
    return ()


def _plain(message: Any) -> Picture:
    _check(message)
    channels, order = ENCODINGS[message.encoding]
    rows = np.asarray(message.data, dtype=np.uint8)[: message.step * message.height].reshape(message.height, -1)
    pixels = rows[:, : channels * message.width].reshape(message.height, message.width, channels)
    return np.ascontiguousarray(pixels[:, :, order])


def _compressed(message: Any) -> Picture:
    try:
        with Image.open(BytesIO(np.asarray(message.data, dtype=np.uint8).tobytes())) as image:
            if image.mode.startswith(("I", "F")):
                raise LogError("has more than 8 bits a pixel; leave pictures out by --pictures none")
            return np.array(image.convert("RGB"))
    except BROKEN:
        text = f"is no picture that can be read (format '{message.format}')"
        raise LogError(f"{text}; record it again, or leave pictures out by --pictures none") from None
