"""Troubles of a command that nobody nearer to them could name."""

from proxytune.extensions import describe, place_of


def stopped_by(problem: SystemExit | MemoryError | OSError) -> str:
    """What stopped a command, in one phrase."""
    if isinstance(problem, SystemExit):
        return f"code that is not proxytune's ended the command ({describe(problem)}){place_of(problem)}"
    if isinstance(problem, MemoryError):
        return f"memory ran out ({describe(problem)}); ask for less"
    return f"the system refused something ({describe(problem)}){place_of(problem)}"
