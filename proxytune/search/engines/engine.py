"""What an engine says of itself: nothing else in the package knows one engine from another."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

from proxytune.search.proposer import Proposer


class Library(NamedTuple):
    """A library that an engine needs and proxytune does not bring along.

    Attributes:
        modules: What is imported of it.
        name: What people call it.
        extra: The extra of proxytune that installs it.
    """

    modules: tuple[str, ...]
    name: str
    extra: str


class Look(NamedTuple):
    """How an engine is drawn where several are compared.

    Attributes:
        colour: A colour as Matplotlib has it.
        line: A line as Matplotlib has it.
    """

    colour: str
    line: Literal["solid", "dashed", "dotted", "dashdot"] = "solid"


@dataclass(frozen=True)
class Engine:
    """A search engine with all that is to be known of it.

    Attributes:
        name: What people type to have it.
        label: What it is called in a list.
        summary: One line on how it proposes.
        make: Makes the proposer: of a Goal if the engine learns from outputs, of nothing if it learns from scores.
        learns_from: Every agent's every metric ("outputs"), or the score that is composed of them alone ("scores").
        in_studies: Whether a study may name it; else it is for `compare` only.
        needs: A library that has to be installed besides; None if none is.
        look: How it would like to be drawn; None leaves that to the figure.
    """

    name: str
    label: str
    summary: str
    make: Callable[..., Proposer]
    learns_from: Literal["outputs", "scores"] = "scores"
    in_studies: bool = True
    needs: Library | None = None
    look: Look | None = None
