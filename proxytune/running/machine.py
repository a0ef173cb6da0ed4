"""What the machine lacks is no failure of the code that met it."""

import errno

from proxytune.errors import RunError
from proxytune.extensions import describe, place_of

OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)


def check_machine(whose: str, problem: BaseException | None, remedy: str) -> None:
    """Refuse to call something failed of what memory, disk or descriptors lacked, whoever caught that first.

    Args:
        whose: What was under way, as the complaint begins.
        problem: What was raised.
        remedy: How to run again, as the complaint ends.

    Raises:
        RunError: With what the machine lacked.
    """
    while problem is not None:
        if isinstance(problem, MemoryError) or getattr(problem, "errno", None) in OF_THE_MACHINE:
            where = place_of(problem)
            raise RunError(
                f"{whose}: the machine failed ({describe(problem)}){where}; run again to continue, {remedy}"
            ) from None
        problem = problem.__cause__ or problem.__context__
