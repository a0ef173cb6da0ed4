"""Examinations: what a policy scores in several episodes."""

import math
from collections.abc import Sequence

from proxytune.domain import Classroom, Episode, Policy
from proxytune.errors import EpisodeError


def examine(classroom: Classroom, episodes: Sequence[Episode], policy: Policy) -> list[float]:
    """The score of a policy in each episode, all at once where the classroom can do that.

    Raises:
        EpisodeError: If the domain or the policy fails, or a score is missing or no finite number.
    """
    together = getattr(classroom, "examine_together", None)
    if together is None:
        scores = [classroom.examine(episode, policy) for episode in episodes]
    else:
        scores = list(together(episodes, policy))
    if len(scores) != len(episodes):
        raise EpisodeError(
            f"examine_together gave {len(scores)} scores for {len(episodes)} episodes; give each its own"
        )
    for start, score in enumerate(scores):
        if not math.isfinite(score):
            raise EpisodeError(f"the examination from start {start} gave {score!r}; give a finite score")
    return scores
