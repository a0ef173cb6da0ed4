"""Where every episode fails alike there is nothing to search: the study stops and says of what."""

import re
from collections.abc import Collection

from proxytune.domain import Outcome
from proxytune.errors import RunError


def check_some_work(outcomes: Collection[Outcome], where: str) -> None:
    """Refuse to go on if every episode has failed of the same.

    Args:
        outcomes: Of every agent.
        where: Whose episodes these are, as "the pre-flight".

    Raises:
        RunError: With the first failure.
    """
    failures = [outcome for outcome in outcomes if outcome.metrics is None]
    if failures and len(failures) == len(outcomes) and len(set(map(_kind, failures))) == 1:
        raise RunError(
            f"{failures[0].failure}; every agent fails so, in all {len(failures)} episodes of {where}: correct it and "
            "run the same command again"
        )


def _kind(failed: Outcome) -> str:
    """What failed, whichever the agent and whatever the numbers."""
    return re.sub(r"\d+", "", failed.failure.replace(f"'{failed.episode.agent}'", ""))
