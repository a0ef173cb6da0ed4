"""Ctrl-C and SIGTERM end a command alike: everything finished is kept, and its processes end too."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from proxytune.extensions import Interrupted, interrupt

INTERRUPTED, TERMINATED = 128 + signal.SIGINT, 128 + signal.SIGTERM
"""Exit statuses that shells and schedulers expect: 130 and 143."""


class Terminated(Interrupted):
    """SIGTERM was received; raised in the main thread."""


@contextmanager
def signals_as_interruptions() -> Iterator[None]:
    """Raise Interrupted at every Ctrl-C and Terminated at the first SIGTERM.

    Later ones of the latter are ignored, so that cleaning up is not interrupted; so is Ctrl-C where it is already, as
    for a command that a script has put into the background.
    """
    before = {signal.SIGTERM: signal.signal(signal.SIGTERM, _terminate)}
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        before[signal.SIGINT] = signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _terminate(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise Terminated
