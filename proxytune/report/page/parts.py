"""What a page is made of: plain values, rendered elsewhere."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Picture:
    """A figure with what to see in it.

    Attributes:
        title: What it is of, in a few words.
        image: The bytes of a PNG, GIF or SVG file.
        caption: What to see in it, a sentence or two.
    """

    title: str
    image: bytes
    caption: str


@dataclass(frozen=True)
class Table:
    """A table that scrolls where it is wider than the page.

    Attributes:
        title: Its heading.
        columns: Names of its columns, with units; none for pairs of names and values.
        rows: Its cells as text.
        notes: Sentences below it.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Words:
    """A heading with paragraphs.

    Attributes:
        title: The heading.
        paragraphs: Each a sentence or more.
    """

    title: str
    paragraphs: tuple[str, ...]


@dataclass(frozen=True)
class Foot:
    """What it takes to come by the page again.

    Attributes:
        command: The command that makes it, as typed in a shell.
        settings: Names and values.
        versions: Packages and their versions.
        date: When it was written.
    """

    command: str
    settings: tuple[tuple[str, str], ...]
    versions: tuple[tuple[str, str], ...]
    date: str


@dataclass(frozen=True)
class Page:
    """A page.

    Attributes:
        title: What it is about.
        answer: What was found, in a sentence.
        following: What to do next, in a sentence; "" where there is nothing to do.
        parts: Pictures, tables and words, in their order.
        foot: How to come by it again.
        renew_s: The page loads itself again so often while the work is under way [s]; 0 once it has ended.
    """

    title: str
    answer: str
    following: str
    parts: tuple[Picture | Table | Words, ...]
    foot: Foot
    renew_s: int = 0
