"""What every command returns: one JSON document, and the same for people."""

from dataclasses import dataclass
from typing import Any

from rich.console import RenderableType


@dataclass(frozen=True)
class Answer:
    """The result of a command.

    Attributes:
        document: What `--json` prints: plain numbers, texts, lists and dicts, None where undefined.
        text: What a person reads on standard output; of a plain text no line is broken.
    """

    document: dict[str, Any]
    text: RenderableType
