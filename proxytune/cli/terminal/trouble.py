"""What stops a command that nobody nearer to it could name."""

from proxytune.cli.terminal.interruption import INTERRUPTED, TERMINATED, Terminated
from proxytune.extensions import describe, is_users, place_of

FAILED = 1


def stopped_by(problem: KeyboardInterrupt | SystemExit | MemoryError | OSError) -> tuple[str, int]:
    """What stopped a command, in one phrase, and its exit status."""
    if is_users(problem):
        return ("terminated", TERMINATED) if isinstance(problem, Terminated) else ("interrupted", INTERRUPTED)
    if isinstance(problem, MemoryError):
        return f"memory ran out ({describe(problem)}); ask for less", FAILED
    if isinstance(problem, OSError):
        return f"the system refused something ({describe(problem)}){place_of(problem)}", FAILED
    return f"code that is not proxytune's ended the command ({describe(problem)}){place_of(problem)}", FAILED
