"""Examinations: what a policy scores in several episodes."""

from collections.abc import Sequence

from proxytune.domain import Classroom, Episode, Policy
from proxytune.errors import EpisodeError


def examine(classroom: Classroom, episodes: Sequence[Episode], policy: Policy) -> list[float]:
    """The score of a policy in each episode, all at once where the classroom can do that.

    Raises:
        EpisodeError: If the domain or the policy fails, or scores are missing.
    """
    together = getattr(classroom, "examine_together", None)
    if together is None:
        return [classroom.examine(episode, policy) for episode in episodes]
    scores = list(together(episodes, policy))
    if len(scores) != len(episodes):
        raise EpisodeError(
            f"examine_together gave {len(scores)} scores for {len(episodes)} episodes; give each its own"
        )
    return scores
