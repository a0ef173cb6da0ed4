"""One view model of everything that finds something: sentence, next step, tables, figures and notes.

A subject builds its view once from results; `text` shows it on a terminal, `html` as a page.
"""

import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, TypeAlias

from proxytune.identity import versions_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Drawn: TypeAlias = "bytes | Figure"
"""The bytes of a PNG, GIF or SVG file, or a figure."""
PACKAGES = ("proxytune", "numpy", "scipy", "pybullet")
"""Packages that results may depend on."""


@dataclass(frozen=True)
class Column:
    """A column by its head, which a terminal breaks where it has a line break, of texts or numbers with their units."""

    name: str
    numbers: bool = False


@dataclass(frozen=True)
class Table:
    """A table as people read it, with a heading and sentences below; without a head its columns have no names.

    The first cell of a row names it, and is indented where the row is part of the one above.
    """

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Picture:
    """A figure, or the bytes of a PNG, GIF or SVG file, with what it is of and what to see in it."""

    title: str
    image: Drawn
    caption: str


@dataclass(frozen=True)
class Paragraphs:
    """A heading with paragraphs of a sentence or more."""

    title: str
    paragraphs: tuple[str, ...]


Part = Picture | Table | Paragraphs


@dataclass(frozen=True)
class View:
    """Result of anything, for people: what was found and what to do next ("": nothing), a sentence each, and parts."""

    title: str
    sentence: str
    next_step: str
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Foot:
    """Facts that it takes to come by a page again: the command as typed, settings, versions of packages, the date."""

    command: str
    settings: tuple[tuple[str, str], ...]
    versions: tuple[tuple[str, str], ...]
    date: str


def columns_of(texts: Sequence[str], numbers: Sequence[str] = ()) -> tuple[Column, ...]:
    """Columns of texts, then columns of numbers."""
    return (*map(Column, texts), *(Column(name, numbers=True) for name in numbers))


def foot_of(command: str, settings: Iterable[tuple[str, str]] = ()) -> Foot:
    """The foot of a page that is written now."""
    known = [(name, version) for name, version in versions_of(PACKAGES).items() if version != "unknown"]
    versions = (("Python", platform.python_version()), *known)
    return Foot(command, tuple(settings), versions, f"{datetime.now().astimezone():%Y-%m-%d %H:%M %Z}")
