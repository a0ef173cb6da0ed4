"""A skeleton: the files of something to start from, and what to do with them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from string import Template


@dataclass(frozen=True)
class Skeleton:
    """What `new` writes.

    Attributes:
        files: Texts by file name.
        next: The commands to type then.
        notes: What was read and what is to be known, in one line each.
    """

    files: Mapping[str, str]
    next: tuple[str, ...]
    notes: tuple[str, ...] = field(default=())


def fill(template: str, **values: object) -> str:
    """A file of templates/ with its $names replaced."""
    text = (files("proxytune.skeletons") / "templates" / template).read_text(encoding="utf-8")
    return Template(text).substitute(values)
