"""Pictures of a page: as data in it, at a size at which their letters are as large as the text."""

import base64
from io import BytesIO
from typing import NamedTuple

from PIL import Image

ENLARGED = 144.0
"""Pixels of the page to an inch of a figure: 1.5 times its printed size, where 8 pt are the page's 16 pixels."""


class Drawn(NamedTuple):
    """A picture as HTML takes it.

    Attributes:
        source: Its bytes as a data URI.
        width: How wide it is drawn where there is room [pixel]; 0 as wide as it likes.
    """

    source: str
    width: int


def drawn(image: bytes) -> Drawn:
    """A PNG, GIF or SVG as data.

    Raises:
        ValueError: If it is none of them.
    """
    kind = _kind(image)
    data = base64.b64encode(image).decode("ascii")
    return Drawn(f"data:image/{kind};base64,{data}", 0 if kind == "svg+xml" else _width(image))


def _kind(image: bytes) -> str:
    if image.startswith(b"\x89PNG\r\n"):
        return "png"
    if image.startswith(b"GIF8"):
        return "gif"
    if b"<svg" in image[:1000]:
        return "svg+xml"
    raise ValueError("the picture is no PNG, GIF or SVG")


def _width(image: bytes) -> int:
    """Its pixels; those of a figure, which states how many make an inch, at 1.5 times its printed size."""
    with Image.open(BytesIO(image)) as opened:
        dots = opened.info.get("dpi")
        return round(opened.width * ENLARGED / dots[0]) if dots and dots[0] else opened.width
