"""SIGTERM ends a command as Ctrl-C does: everything finished is kept, and its processes end too."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED, TERMINATED = 128 + signal.SIGINT, 128 + signal.SIGTERM
"""Exit statuses that shells and schedulers expect: 130 and 143."""


class Terminated(KeyboardInterrupt):
    """SIGTERM was received; raised in the main thread."""


@contextmanager
def sigterm_as_interrupt() -> Iterator[None]:
    """Raise Terminated at the first SIGTERM; ignore later ones, so that cleaning up is not interrupted."""
    before = signal.signal(signal.SIGTERM, _raise)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL if before is None else before)


def _raise(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise Terminated
