"""How a broken promise is told: in one line."""

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from proxytune.errors import ConformanceError, ProxytuneError
from proxytune.extensions import describe

Answer = TypeVar("Answer")


def claim(holds: Any, line: str) -> None:
    """Refuse what does not hold.

    Raises:
        ConformanceError: With this line.
    """
    if not holds:
        raise ConformanceError(line)


def claim_members(thing: Any, what: str, members: Iterable[str]) -> None:
    """Refuse what lacks a member.

    Raises:
        ConformanceError: With the names of those it lacks.
    """
    lacks = [member for member in members if not hasattr(thing, member)]
    claim(not lacks, f"{what} lacks {', '.join(lacks)}; add what every one of its kind must have")


def ask(what: str, question: Callable[[], Answer]) -> Answer:
    """What an extension answers.

    Raises:
        ConformanceError: If it raises instead.
    """
    try:
        return question()
    except ConformanceError:
        raise
    except ProxytuneError as problem:
        raise ConformanceError(str(problem)) from problem
    except Exception as problem:
        raise ConformanceError(f"{what} raised {describe(problem)}; it must not") from problem
