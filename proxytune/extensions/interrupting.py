"""Whose a KeyboardInterrupt is: the user's Ctrl-C, or an exception of that name raised by code that is not ours."""

import signal
from types import FrameType


class Interrupted(KeyboardInterrupt):
    """The user has pressed Ctrl-C; raised in the main thread."""


def interrupt(number: int, frame: FrameType | None) -> None:
    """What SIGINT does on the command line.

    Raises:
        Interrupted: Always.
    """
    raise Interrupted


def is_users(problem: BaseException) -> bool:
    """Whether what was raised is the user's Ctrl-C.

    Where SIGINT raises Interrupted, or is ignored as in the processes that do pieces of work, any other
    KeyboardInterrupt is not, unless it was raised on catching that one. Under another handler, as in a Python session,
    every one is.
    """
    if not isinstance(problem, KeyboardInterrupt):
        return False
    if signal.getsignal(signal.SIGINT) not in (interrupt, signal.SIG_IGN):
        return True
    return isinstance(problem, Interrupted) or isinstance(problem.__context__, Interrupted)
