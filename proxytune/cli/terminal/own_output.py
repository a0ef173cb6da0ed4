"""Standard output holds a command's answer and nothing else: what agents print goes to standard error."""

import io
import json
import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any

from rich.console import Console

from proxytune.cli.terminal.answer import Answer
from proxytune.errors import RunError

OUT, ERR = 1, 2
"""The descriptors, which code in C writes to, and which other processes inherit."""


@contextmanager
def prints_to_stderr() -> Iterator[None]:
    """Send to standard error whatever this process, and those that it starts, write to standard output meanwhile."""
    sys.stdout.flush()
    kept = _redirected()
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if kept is not None:
            os.dup2(kept, OUT)
            os.close(kept)


def _redirected() -> int | None:
    """A descriptor of what standard output was; None where one of the two is closed: then nothing is to be parted."""
    try:
        kept = os.dup(OUT)
        os.dup2(ERR, OUT)
    except OSError:
        return None
    return kept


def print_answer(answer: Answer, *, as_json: bool) -> None:
    """Print a command's answer; a closed pipe is not an error, and letters that a terminal lacks are escaped.

    Raises:
        RunError: If it cannot be written.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        if as_json:
            print(_json_text(answer.document))
        elif isinstance(answer.text, str):
            print(answer.text)
        else:
            Console().print(answer.text)
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_the_rest()
    except OSError as problem:
        _discard_the_rest()
        raise RunError(f"standard output: cannot be written ({problem.strerror}); make room and run again") from None


def _json_text(document: dict[str, Any]) -> str:
    """The document; in ASCII, as JSON escapes it, where standard output cannot hold its letters."""
    document = _defined(document)
    text = json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        return json.dumps(document, indent=2, allow_nan=False)
    return text


def _defined(value: Any) -> Any:
    """A document whose numbers are finite: what has no value, or too large a one, is None."""
    if isinstance(value, dict):
        return {key: _defined(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_defined(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _discard_the_rest() -> None:
    """Drop what is still in the buffer, which would raise once more when Python ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
